"""The benchmark of planners: conditions, episodes in virtual time, runs on many cores."""
