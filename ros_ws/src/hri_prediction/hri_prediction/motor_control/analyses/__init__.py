"""What the explanations of many reaches have in common (thesis 2.2.5, 2.2.6, 2.3, 3.3.3)."""
