"""The hybrid predictor on trial: simulated people who do not move as its models do, and recorded ones."""
