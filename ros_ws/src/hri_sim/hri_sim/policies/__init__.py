"""Data sets, training and evaluation of learnt policies."""
