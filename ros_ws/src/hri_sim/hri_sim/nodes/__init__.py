"""Executable nodes of this package."""
