"""How a graph is doing, from what its nodes say on /diagnostics, and what to do about it. No ROS."""
