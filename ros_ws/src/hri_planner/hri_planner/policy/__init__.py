"""Running learnt policies: from what they want of the hand to joint speeds, at a safe separation."""
