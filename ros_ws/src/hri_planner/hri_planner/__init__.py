"""Robot motion: the KUKA LWR4+ model, motion planners, policies and their ROS 2 nodes."""
