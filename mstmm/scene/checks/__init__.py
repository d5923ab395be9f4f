"""What the tables of a scene say to each other."""
