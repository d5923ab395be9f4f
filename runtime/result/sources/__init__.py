"""Quantities of what a scene is made of: hinges, springs, bushings, loads, what closes loops."""
