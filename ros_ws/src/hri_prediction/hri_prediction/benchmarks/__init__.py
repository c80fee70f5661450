"""Measurements of the cores, beside plain NumPy and implementations by others."""
