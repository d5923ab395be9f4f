"""Closed loops by the looped engine: assembly, rank, and what a model tells of them."""
