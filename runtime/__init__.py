"""Numbers only: scenes packed into the compiled engine, integrated, observed, saved.  No SymPy."""
