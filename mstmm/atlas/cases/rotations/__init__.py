"""Cases of coordinates of rotations."""
