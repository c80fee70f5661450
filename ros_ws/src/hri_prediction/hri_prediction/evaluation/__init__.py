"""How good predictions are: replayed sample by sample, beside simple predictors."""
