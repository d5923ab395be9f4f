"""What a run does unless it is told otherwise: said here, and nowhere else."""

#: Method of the time integration.
METHOD = "dop853"

#: Relative and absolute tolerance (the latter in the units of q and u).
RTOL, ATOL = 1e-9, 1e-12
