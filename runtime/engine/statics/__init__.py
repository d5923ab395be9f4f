"""Static equilibrium: search and stability."""
