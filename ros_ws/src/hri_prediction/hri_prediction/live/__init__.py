"""Live motion capture: a stream of markers becomes samples of arms."""
