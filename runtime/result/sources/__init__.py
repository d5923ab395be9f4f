"""Quantities of the elements of a scene: hinges, springs, bushings, loads, loop constraints."""
