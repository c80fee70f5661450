"""How a policy's motions compare with recorded ones (section 5.4)."""
