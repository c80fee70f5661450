"""Training of policies; needs torch (``requirements/training.txt``), which nothing else does."""
