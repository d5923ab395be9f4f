"""Language of definitions and derivations: elements, notation, functions."""
