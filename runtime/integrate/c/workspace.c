/* Failures of a run, and numbers that are not finite. */
#include "workspace.h"

int mstmm_note(mstmm_run *run, int status, int64_t code, int64_t component, double time)
{
    run->count.fail_status = status;
    run->count.code = code;
    run->count.component = component;
    run->real.fail_time = time;
    return status;
}

int64_t mstmm_first_not_finite(int64_t n, const double *x)
{
    for (int64_t i = 0; i < n; i++)
        if (!isfinite(x[i])) return i;
    return -1;
}

MSTMM_WIDE int mstmm_all_finite(int64_t n, const double *x)
{
    wide zeros = {0.0}; /* 0 * x is 0 for finite x and NaN otherwise */
    double rest = 0.0;
    int64_t i = 0;
    for (; i + WIDE <= n; i += WIDE) zeros += 0.0 * *(const wide *)(x + i);
    for (; i < n; i++) rest += 0.0 * x[i];
    return mstmm_total(&zeros) + rest == 0.0;
}

int mstmm_check_finite(const mstmm_work *work, double t, const double *x)
{
    const int64_t n = work->system->n_state;
    if (mstmm_all_finite(n, x)) return 0;
    return mstmm_note(work->run, MSTMM_NOT_FINITE, 0, mstmm_first_not_finite(n, x), t);
}
