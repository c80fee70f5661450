"""What the planner's kernel is measured beside, and checked against."""
