"""Closed loops: the spanning tree after cutting hinges, and the plan of the constraint rows."""
