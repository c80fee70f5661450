"""Training of parameter adaptation on simulated motions of the benchmark's tuning tasks."""
