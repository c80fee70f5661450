"""People whose reaches are optima of known weights, and what inverse optimal control makes of them."""
