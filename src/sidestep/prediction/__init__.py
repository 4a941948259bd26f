"""Where people will be (Eqs. 4, 6, 7) and how likely a collision is."""
