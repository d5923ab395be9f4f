/* Sweep by runs of links; see links.h. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "link_steps.h"
#include "sweep_steps.h"

#define MSTMM_INLINE static inline __attribute__((always_inline, unused))
#define MSTMM_RARE static __attribute__((noinline, cold, unused))
#define MSTMM_LIKELY(x) __builtin_expect(!!(x), 1)

#include "fused_sincos.c"

typedef double two_t __attribute__((vector_size(16)));
typedef long long two_bits_t __attribute__((vector_size(16)));

MSTMM_INLINE int two_sincos_near(two_t x)
{
    const two_bits_t near = (x >= -MSTMM_SINCOS_RANGE) & (x <= MSTMM_SINCOS_RANGE);
    return (near[0] & near[1]) != 0;
}
MSTMM_SINCOS(two_t, two_bits_t, 2, two_sincos)

/* Numbers of S and e side by side, as they travel from link to link. */
#define CARRIED 27

/* --- splitting into runs ---------------------------------------------------------------------- */

static int continues(const mstmm_model *model, const mstmm_branch *run, const int *children, int i)
{
    const mstmm_body *body = &model->bodies[i], *before = body - 1;
    if (body->parent != i - 1) return 0;
    if (!run->numbers) return !body->kernels->link_condense;
    return body->kernels->link_condense == before->kernels->link_condense && children[i - 1] == 1 &&
           body->q == before->q + before->nq && body->u == before->u + before->nu;
}

static void begin_run(const mstmm_model *model, mstmm_branch *run, const real **numbers, int i)
{
    const mstmm_body *body = &model->bodies[i];
    *run = (mstmm_branch){.first = i,
                          .parent = body->parent,
                          .q = body->q,
                          .u = body->u,
                          .nq = body->nq,
                          .nu = body->nu,
                          .place = -1,
                          .parent_place = -1};
    if (!body->kernels->link_condense) return;
    run->numbers = numbers + i;
    run->angles = body->kernels->link_angles;
    run->turn = body->kernels->link_turn;
    run->forward = body->kernels->link_forward;
    run->condense = body->kernels->link_condense;
    run->recover = body->kernels->link_recover;
}

/* A run that is the only child of the previous run passes S and e on to it if both consist of
 * links. */
static void join_runs(mstmm_branch *before, mstmm_branch *run)
{
    if (!before->numbers || !run->numbers) return;
    run->joined = 1;
    before->open = 0;
}

static int64_t link_size(const mstmm_branch *run)
{
    return MSTMM_LINK_TURN((int64_t)run->nu) +
           (run->angles ? MSTMM_LINK_ANGLE : MSTMM_LINK_ROTATION);
}

/* Run that contains a body; the runs are in the order of the bodies. */
static const mstmm_branch *find_run(const mstmm_branch *runs, int n, int body)
{
    int low = 0, high = n;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (runs[middle].first <= body)
            low = middle;
        else
            high = middle;
    }
    return &runs[low];
}

int mstmm_fill_runs(const mstmm_model *model, mstmm_branch *runs, const real **numbers,
                    real *gathered, int64_t place, int64_t *size)
{
    int n = 0;
    int64_t begin = place;
    int *children = (int *)numbers; /* one number a body, until the pointers come */
    memset(children, 0, (size_t)model->n_bodies * sizeof(int));
    for (int i = 0; i < model->n_bodies; i++)
        if (model->bodies[i].parent >= 0) children[model->bodies[i].parent]++;
    for (int i = 0; i < model->n_bodies; i++) {
        if (n == 0 || !continues(model, &runs[n - 1], children, i))
            begin_run(model, &runs[n++], numbers, i);
        mstmm_branch *run = &runs[n - 1];
        if (run->count++ == 0 && n > 1 && run->parent == i - 1 && children[i - 1] == 1)
            join_runs(run - 1, run);
        run->open = children[i] > 0;
    }
    for (int k = 0; k < n; k++) {
        mstmm_branch *run = &runs[k];
        if (run->numbers) {
            run->place = place;
            place += run->count * link_size(run);
        }
        if (run->parent < 0) continue;
        const mstmm_branch *outer = find_run(runs, n, run->parent);
        if (outer->numbers)
            run->parent_place = outer->place + (run->parent - outer->first) * link_size(outer);
    }
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_kernels *kernels = model->bodies[i].kernels;
        const int own = MSTMM_LINK_OWN + kernels->link_numbers;
        numbers[i] = model->bodies[i].link;
        if (!gathered || !kernels->link_condense) continue;
        memcpy(gathered, numbers[i], (size_t)own * sizeof(real));
        numbers[i] = gathered;
        gathered += own;
    }
    *size = place - begin;
    return n;
}

/* --- passes ----------------------------------------------------------------------------------- */

/* Bias motion or deviation of the parent of a run: a link, or a body's or the ground's block. */
static const real *parent_numbers(const mstmm_state *state, const mstmm_branch *run, int in_block)
{
    return run->parent_place >= 0
               ? state->workspace + run->parent_place + MSTMM_LINK_MOTION
               : mstmm_block(state->model, state->workspace, run->parent) + in_block;
}

/* Link k of a run.  Inlined, so that what a pass does not read is not computed. */
MSTMM_INLINE mstmm_link_at link_at(mstmm_state *state, const mstmm_branch *run, int k)
{
    return (mstmm_link_at){
        .state = state,
        .index = run->first + k,
        .nu = run->nu,
        .turn = run->turn,
        .forward = run->forward,
        .condense = run->condense,
        .recover = run->recover,
        .link = state->workspace + run->place + k * link_size(run),
        .q = state->q + run->q + (int64_t)k * run->nq,
        .u = state->u + run->u + (int64_t)k * run->nu,
        .qdot = state->qdot + run->q + (int64_t)k * run->nq,
        .udot = state->udot + run->u + (int64_t)k * run->nu,
    };
}

/* Cosines and sines of a run: all angles first, so that they can share the work. */
static void turn_links(mstmm_state *state, const mstmm_branch *run)
{
    const int64_t size = link_size(run);
    mstmm_link_at at = link_at(state, run, 0);
    for (int k = 0; k < run->count; k += 2, at.link += 2 * size) {
        const int both = k + 1 < run->count;
        real *turn = at.link + MSTMM_LINK_TURN(run->nu);
        two_t x = {0, 0};
        at.numbers = run->numbers[k];
        mstmm_at_link_turn(at);
        at.q += run->nq;
        x[0] = turn[0];
        if (both) {
            mstmm_link_at next = at;
            next.numbers = run->numbers[k + 1];
            next.link += size;
            mstmm_at_link_turn(next);
            at.q += run->nq;
            x[1] = turn[size];
        }
        const two_sincos_t pair = two_sincos(x);
        turn[0] = pair.cosine[0];
        turn[1] = pair.sine[0];
        if (!both) break;
        turn[size] = pair.cosine[1];
        turn[size + 1] = pair.sine[1];
    }
}

static int forward_links(mstmm_state *state, const mstmm_branch *run)
{
    if (run->angles) turn_links(state, run);
    const int64_t size = link_size(run);
    mstmm_link_at at = link_at(state, run, 0);
    at.outer_motion = parent_numbers(state, run, MSTMM_BLOCK_MOTION);
    for (int k = 0; k < run->count; k++, at.index++) {
        at.numbers = run->numbers[k];
        if (!run->angles) mstmm_at_link_turn(at);
        const int code = mstmm_at_link_forward(at);
        if (code) return code;
        at.outer_motion = at.link + MSTMM_LINK_MOTION;
        at.link += size;
        at.q += run->nq;
        at.u += run->nu;
        at.qdot += run->nq;
    }
    if (run->open) {
        real *block = mstmm_block(state->model, state->workspace, run->first + run->count - 1);
        memset(block + MSTMM_BLOCK_S, 0, CARRIED * sizeof(real)); /* S, then e */
    }
    return 0;
}

int mstmm_hook_links_forward(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    for (int k = 0; k < model->n_runs; k++) {
        const mstmm_branch *run = &model->runs[k];
        if (run->numbers) {
            const int code = forward_links(state, run);
            if (code) return code;
            continue;
        }
        const real *parent = parent_numbers(state, run, MSTMM_BLOCK_MOTION);
        for (int i = run->first; i < run->first + run->count; i++) {
            const int code = mstmm_at_forward(state, i, parent);
            if (code) return code;
            parent = state->workspace + model->bodies[i].block + MSTMM_BLOCK_MOTION;
        }
    }
    return 0;
}

/* Efforts on the hinge of a run's body k. */
static const real *link_efforts(const mstmm_state *state, const mstmm_branch *run, int k)
{
    const mstmm_model *model = state->model;
    if (model->n_laws)
        return mstmm_of_speeds(mstmm_block(model, state->workspace, run->first + k), run->nu,
                               MSTMM_SPEED_TAU);
    return state->efforts ? state->efforts + run->u + (int64_t)k * run->nu : mstmm_zeros;
}

/* S and e on their way from link to link, and from run to run where these are joined. */
typedef struct {
    real numbers[2][CARRIED];
    int next;           /* of the two, to be written */
    const real *handed; /* to the next run; NULL: it is not joined with this one */
} carried_t;

static int condense_links(mstmm_state *state, const mstmm_branch *run, carried_t *carried)
{
    const int64_t size = link_size(run);
    const int last = run->first + run->count - 1;
    mstmm_link_at at = link_at(state, run, run->count - 1);
    at.inner = carried->handed ? carried->handed
               : run->open     ? mstmm_block(state->model, state->workspace, last) + MSTMM_BLOCK_S
                               : mstmm_zeros;
    for (int k = run->count - 1; k >= 0; k--, at.link -= size, at.index--) {
        at.numbers = run->numbers[k];
        at.outer = carried->numbers[carried->next];
        carried->next = !carried->next;
        at.tau = link_efforts(state, run, k);
        const int code = mstmm_at_link_condense(at);
        if (code) return code;
        at.inner = at.outer;
    }
    carried->handed = run->joined ? at.outer : NULL;
    if (run->joined) return 0;
    real *parent = mstmm_block(state->model, state->workspace, run->parent) + MSTMM_BLOCK_S;
    for (int j = 0; j < CARRIED; j++) parent[j] += at.outer[j];
    return 0;
}

int mstmm_hook_links_condense(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    carried_t carried = {.next = 0, .handed = NULL};
    for (int k = model->n_runs - 1; k >= 0; k--) {
        const mstmm_branch *run = &model->runs[k];
        int code = run->numbers ? condense_links(state, run, &carried) : 0;
        for (int i = run->first + run->count - 1; !code && !run->numbers && i >= run->first; i--)
            code = mstmm_at_condense(state, i);
        if (code) return code;
    }
    return 0;
}

static void recover_links(mstmm_state *state, const mstmm_branch *run)
{
    const int64_t size = link_size(run);
    mstmm_link_at at = link_at(state, run, 0);
    at.outer_delta = parent_numbers(state, run, MSTMM_BLOCK_DELTA);
    for (int k = 0; k < run->count; k++) {
        at.numbers = run->numbers[k];
        mstmm_at_link_recover(at);
        at.outer_delta = at.link + MSTMM_LINK_MOTION;
        at.link += size;
        at.udot += run->nu;
    }
}

int mstmm_hook_links_recover(mstmm_state *state)
{
    const mstmm_model *model = state->model;
    for (int k = 0; k < model->n_runs; k++) {
        const mstmm_branch *run = &model->runs[k];
        if (run->numbers) {
            recover_links(state, run);
            continue;
        }
        const real *parent = parent_numbers(state, run, MSTMM_BLOCK_DELTA);
        for (int i = run->first; i < run->first + run->count; i++) {
            const int code = mstmm_at_recover(state, i, parent);
            if (code) return code;
            parent = state->workspace + model->bodies[i].block + MSTMM_BLOCK_DELTA;
        }
    }
    return 0;
}
