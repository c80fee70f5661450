"""Launching without the ros2 command line: supervised node processes, and the conductor of a run."""
