"""Closed loops in the looped engine: assembly, rank, and the analysis that a model shows."""
