"""What a run does unless it is told otherwise: said here, and nowhere else."""

#: Method of fixed steps, sessions and batches.  Other runs are made by "auto", which begins by it.
METHOD = "dop853"

#: Relative and absolute tolerance (the latter in the units of q and u).
RTOL, ATOL = 1e-9, 1e-12

#: A chart: seconds of the clock, error for which a setting is recommended, times at which errors
#: are looked at, rounds in which processor times are taken again.
CHART_BUDGET, CHART_ERROR, CHART_SAMPLES, CHART_ROUNDS = 60.0, 1e-3, 101, 3

#: An advice: times at which errors are looked at.
ADVICE_SAMPLES = 201
