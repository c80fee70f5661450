"""Policies learned from two people: recurrent networks that accelerate a hand as a person would.

NumPy alone runs them; :mod:`hri_planner.rnn.training` needs torch.
"""
