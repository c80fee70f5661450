"""Encounters of people with a robot whose speed is monitored: whether anybody is touched while it moves."""
