"""Simulated people: arm postures, reaching movements and how they are tracked."""
