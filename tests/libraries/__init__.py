"""The cache of compiled libraries and all that can go wrong with it."""
