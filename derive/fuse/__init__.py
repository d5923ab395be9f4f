"""Code of one scene from its sweep on an expression graph; runs without SymPy."""
