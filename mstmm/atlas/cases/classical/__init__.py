"""Steps in absolute coordinates, by the classical matrices."""
