"""Linear models of scenes with closed loops."""
