"""Accelerations, efforts and mass matrices of states that are given: one, or many."""
