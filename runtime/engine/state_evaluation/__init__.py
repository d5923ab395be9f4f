"""Evaluation at given states: accelerations, efforts, mass matrices, points; one or many."""
