"""Evaluation at single states and batches: accelerations, efforts, mass matrices, points."""
