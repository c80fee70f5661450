"""Between ROS messages and the planner cores."""
