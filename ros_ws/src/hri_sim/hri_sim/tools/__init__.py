"""Command line tools; the files in ``scripts/`` call their ``main``."""
