"""Experiments that ship: where goals, obstacles and targets are, and how much is tried."""
