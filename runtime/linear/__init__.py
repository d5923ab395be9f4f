"""Linear models of scenes about a state: matrices, modes and responses."""
