"""What the robot is told when: to move, to stop, to go on, and how a motion ends. No ROS."""
