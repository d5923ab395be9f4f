"""Expansion of flexible bodies into nodes of the tree, or their replacement by rigid bodies."""
