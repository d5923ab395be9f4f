"""What a linear model shows: its outputs, and how each follows from its coordinates."""
