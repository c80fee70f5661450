"""Scenarios: who sits where, what reaches for what, and the generator of test conditions."""
