"""Symbolic matrix equations: Newton-Euler, hinges, laws and the sweep."""
