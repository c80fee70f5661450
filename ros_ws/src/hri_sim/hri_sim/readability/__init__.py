"""Simulated people who guess where the robot is going, and experiments with them."""
