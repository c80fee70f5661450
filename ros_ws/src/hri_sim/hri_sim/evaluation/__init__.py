"""Evaluation of the predictor on simulated and recorded people: command lines and tables."""
