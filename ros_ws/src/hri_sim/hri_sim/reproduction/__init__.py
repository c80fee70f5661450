"""The planner's tables and pictures of the documentation, made again by one command."""
