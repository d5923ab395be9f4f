"""Cases of steps in absolute coordinates, by the classical matrices."""
