"""A scene in three dimensions: what it looks like, how it moves, pages and films of it."""
