"""Linear models of closed loops: motions of drives, and states that move."""
