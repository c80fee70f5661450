"""What came of things that went wrong: figures, bars, tables, and people who meet the robot."""
