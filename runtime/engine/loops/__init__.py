"""Closed loops in the looped engine: assembly, rank and analysis."""
