"""Cases of steps in time."""
