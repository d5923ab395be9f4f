"""Runs that reach a target error: choice of method and search over tolerances."""
