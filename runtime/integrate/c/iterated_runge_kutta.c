/* Stages of an iterated Runge-Kutta method: after the first one, blocks of up to eight nodes whose
 * right-hand sides are independent, so that they fill the lanes of a vector.
 *
 * States are interleaved: component i of node j at [(j / L) n L + i L + j % L] with L lanes. */
#include <string.h>

#include "iterated_runge_kutta.h"

MSTMM_INLINE int64_t lane_place(int64_t n, int lanes, int64_t component, int node)
{
    return (node / lanes) * n * lanes + component * lanes + node % lanes;
}

/* Y = y + h A K for all nodes; in the first iteration K is k_0 for every node. */
MSTMM_INLINE void mix_nodes(const mstmm_work *work, int nodes, int lanes, int first)
{
    const mstmm_tableau *tableau = work->tableau;
    const int64_t n = work->system->n_state;
    const double h = work->run->real.h, *restrict base = work->y, *restrict k0 = work->k;
    const double *restrict k = work->lanes_k;
    double *restrict to = work->lanes_y;
    double at[GROUP] = {0.0}, state[GROUP];
    memcpy(at, tableau->c + 1, (size_t)nodes * sizeof *at);
    for (int64_t i = 0; i < n; i++) {
        for (int part = 0; part < GROUP; part += WIDE) {
            wide sum = {0.0};
            if (first) {
                sum = *(const wide *)(at + part) * k0[i];
            } else {
#pragma GCC unroll 8
                for (int j = 0; j < nodes; j++)
                    sum += *(const wide *)(tableau->mix + GROUP * j + part) *
                           k[lane_place(n, lanes, i, j)];
            }
            *(wide *)(state + part) = base[i] + h * sum;
        }
        for (int j = 0; j < GROUP; j += lanes)
            memcpy(to + lane_place(n, lanes, i, j), state + j, (size_t)lanes * sizeof(double));
    }
}

/* The right-hand side of one node after the other, for systems without lanes */
static int evaluate_nodes(const mstmm_work *work, const double *t)
{
    const int64_t n = work->system->n_state;
    int status = 0;
    for (int j = 0; j < work->tableau->n_nodes && !status; j++) {
        for (int64_t i = 0; i < n; i++)
            work->y_stage[i] = work->lanes_y[lane_place(n, GROUP, i, j)];
        status = mstmm_evaluate(work, t[j], work->y_stage, work->y_event);
        for (int64_t i = 0; i < n; i++)
            work->lanes_k[lane_place(n, GROUP, i, j)] = work->y_event[i];
    }
    return status;
}

static int evaluate_lanes(const mstmm_work *work, const double *t)
{
    const mstmm_system *system = work->system;
    const int nodes = work->tableau->n_nodes, lanes = system->lanes;
    int codes[GROUP] = {0};
    for (int j = 0; j < nodes; j += lanes) {
        const int64_t start = lane_place(system->n_state, lanes, 0, j);
        if (!system->rhs_lanes(system->context, t + j, work->lanes_y + start, work->lanes_k + start,
                               codes))
            continue;
        for (int k = 0; k < lanes; k++)
            if (codes[k]) return mstmm_note(work->run, MSTMM_RHS_FAILED, codes[k], -1, t[j + k]);
    }
    work->run->count.evaluations += nodes;
    return 0;
}

/* Copies a block of stages to the rows that the step, the error and dense output read. */
MSTMM_INLINE void keep_block(const mstmm_work *work, int nodes, int lanes, int iteration)
{
    const int64_t n = work->system->n_state;
    double *k = work->k + (1 + iteration * nodes) * work->row;
    for (int j = 0; j < nodes; j++)
        for (int64_t i = 0; i < n; i++)
            k[j * work->row + i] = work->lanes_k[lane_place(n, lanes, i, j)];
}

MSTMM_INLINE int iterate_stages(const mstmm_work *work, int nodes, int lanes)
{
    const mstmm_tableau *tableau = work->tableau;
    double t[GROUP];
    int status = 0;
    for (int j = 0; j < GROUP; j++)
        t[j] = mstmm_time_in(work->run, tableau->c[1 + (j < nodes ? j : nodes - 1)]);
    for (int iteration = 0; iteration < tableau->n_iterations && !status; iteration++) {
        mix_nodes(work, nodes, lanes, iteration == 0);
        status = work->system->lanes ? evaluate_lanes(work, t) : evaluate_nodes(work, t);
        if (!status && tableau->is_read[iteration]) keep_block(work, nodes, lanes, iteration);
    }
    return status;
}

MSTMM_WIDE int mstmm_iterate(const mstmm_work *work)
{
    const int nodes = work->tableau->n_nodes, lanes = work->system->lanes;
    if (lanes == 4) return iterate_stages(work, nodes, 4);
    if (lanes == 2) return iterate_stages(work, nodes, 2);
    return nodes == GROUP ? iterate_stages(work, GROUP, GROUP) : iterate_stages(work, nodes, GROUP);
}
