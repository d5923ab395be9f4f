"""Checks before a run, checks of answers about a state, and the reaction to risks."""
