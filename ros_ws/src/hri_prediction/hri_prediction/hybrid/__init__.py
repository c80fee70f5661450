"""Prediction of people never seen: a first guess by optimal control, and what their own reaches add."""
