"""Consistency checks between the tables of a scene."""
