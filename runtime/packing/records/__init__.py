"""A System as the C records of the looped engine: written, never read."""
