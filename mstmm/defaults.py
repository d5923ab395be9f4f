"""Default settings of runs, defined only here."""

#: Method of fixed steps, sessions and batches.  Other runs use "auto", which starts with it.
METHOD = "dop853"

#: Relative and absolute tolerance (the latter in the units of q and u).
RTOL, ATOL = 1e-9, 1e-12

#: Work-precision chart: wall-clock seconds, target error of the recommended setting, output times
#: at which errors are evaluated, repetitions of the measurement of CPU times.
CHART_BUDGET, CHART_ERROR, CHART_SAMPLES, CHART_ROUNDS = 60.0, 1e-3, 101, 3

#: Advice: output times at which errors are evaluated.
ADVICE_SAMPLES = 201
