"""Validators of single scene values, and their error messages."""
