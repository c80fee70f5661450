"""A graph that runs for long, with faults: what is drawn, what is measured, and the report of it."""
