"""Scenes made linear about a state: their matrices, and what follows from them."""
