"""Why people reach as they do: optimal control of reaching, and its inverse (thesis chapter 2)."""
