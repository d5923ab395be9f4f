"""What a definition and a derivation are written in: elements, notation, functions."""
