"""Rotors: the fixed frame of spinning bodies."""
