"""Recorded and live motion of tracked arms."""
