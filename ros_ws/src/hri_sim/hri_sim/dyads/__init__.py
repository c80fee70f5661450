"""Two simulated people who reach through the same space and give way to each other."""
