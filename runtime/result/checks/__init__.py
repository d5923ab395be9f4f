"""Checks of runs and states: one class per kind of risk, and the measures that they judge."""
