"""Rotors: linear models in the fixed frame, multi-blade coordinates, unbalance response."""
