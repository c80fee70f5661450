"""Human motion: geometry, tracks, arm models and online prediction of reaching."""
