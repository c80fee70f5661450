"""Parameter files of the planner."""
