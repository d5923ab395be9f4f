"""Static equilibrium: the search for it, and what holds it."""
