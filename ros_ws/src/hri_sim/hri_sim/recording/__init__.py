"""Recording runs to bags and playing recordings back."""
