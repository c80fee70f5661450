"""Files with results: where they go, and what they say of where they come from."""
