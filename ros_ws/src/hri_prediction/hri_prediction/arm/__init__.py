"""Geometry and models of the human arm."""
