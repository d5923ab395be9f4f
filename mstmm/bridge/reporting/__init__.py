"""A run as one page: what it is, what vouches for it, how it moves, the equations behind it."""
