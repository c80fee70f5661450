"""Dynamic movement primitives in tool space, with a dynamic potential field."""
