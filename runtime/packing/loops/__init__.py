"""Closed loops: the tree that is left when hinges are cut, and the plan of their rows."""
