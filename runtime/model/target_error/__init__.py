"""A wanted error: what may be asked for, and the runs that reach it."""
