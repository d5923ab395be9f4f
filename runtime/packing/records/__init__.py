"""C records of the looped engine, written from a System and never read back."""
