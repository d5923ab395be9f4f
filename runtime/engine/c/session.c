/* Ticks of a session: inputs into memory, and the run to the end of the tick. */
#include <math.h>
#include <string.h>

#include "session.h"

static const real SAME = 1e-9; /* of a step: a time so near to a grid point is that point */

/* The tick ends where a single run with the same steps would end a step. */
static real tick_end(const mstmm_run *run, real dt)
{
    const real end = run->real.t + dt, h = run->fixed_step;
    if (!(h > 0)) return end;
    for (int64_t i = run->count.break_index; i < run->n_breaks; i++) {
        if (run->breaks[i] > end + SAME * h) break;
        if (fabs(run->breaks[i] - end) <= SAME * h) return run->breaks[i];
    }
    const real grid = run->t_start + nearbyint((end - run->t_start) / h) * h;
    return fabs(grid - end) <= SAME * h ? grid : end;
}

static int reject_call(mstmm_session *session, int which)
{
    session->refused = which;
    return MSTMM_REFUSED;
}

int mstmm_session_rest(mstmm_session *session, real wall)
{
    for (;;) {
        session->run->n_samples = 0; /* only events leave samples */
        const int status = mstmm_advance(session->run, wall);
        if (status != MSTMM_BUFFER_FULL) return status;
    }
}

int mstmm_session_advance(mstmm_session *session, real dt, real wall)
{
    mstmm_run *run = session->run;
    const real end = tick_end(run, dt);
    const size_t bytes = (size_t)session->n * sizeof(real);
    if (!(dt >= 0) || !isfinite(end)) return reject_call(session, -1);
    for (int i = 0; i < session->n; i++)
        if (!isfinite(session->given[i])) return reject_call(session, i);
    if (run->count.status == MSTMM_STOPPED) return reject_call(session, -2);
    if (end >= session->reach) return MSTMM_UNMAPPED;
    const int changed = bytes && memcmp(session->held, session->given, bytes);
    if (changed) {
        memcpy(session->held, session->given, bytes);
        if (session->scene->base) session->scene->base->known = 0;
    }
    const int status = mstmm_run_go_on(run, end, changed);
    return status ? status : mstmm_session_rest(session, wall);
}
