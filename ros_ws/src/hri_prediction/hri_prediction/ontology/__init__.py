"""What two people do with each other: the cases of interaction, and which of them is going on."""
