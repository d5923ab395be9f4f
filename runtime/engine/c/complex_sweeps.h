/* Sweeps in complex numbers; this text follows the passes in complex_steps.c. */
#ifdef MSTMM_LANES
#include "cache_tiling.h"

typedef struct {
    mstmm_complex_state state;
    mstmm_complex_slope slope;
    mstmm_complex_tangents tangents;
    complex_t s, square;
    mstmm_lanes growth;
    mstmm_bits grown;
    int place[MSTMM_LANES]; /* of which s each is */
} mstmm_lanes_at;

/* Inertia in S: angular accelerations to moments, accelerations to forces. */
static inline void inertia_sizes(const complex_t *S, mstmm_lanes *sizes)
{
    sizes[0] = sizes[1] = (mstmm_lanes){0};
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) {
            sizes[0] += z_size(S[6 * (3 + row) + 3 + column]);
            sizes[1] += z_size(S[6 * (6 + row) + column]);
        }
}

/* Contributions of bodies at s, numbers `first` to before `end`, written from `to`. */
static void write_contributions(const mstmm_response *of, const mstmm_lanes_at *with, int64_t first,
                                int64_t end, complex_t *to)
{
    const real *by_rate = of->contributions, *by_square = by_rate + of->n_numbers;
    const real *lost = by_square + of->n_numbers;
    const complex_t s = with->s, square = with->square;
    for (int64_t k = first; k < end; k++, to++) {
        to->re = with->tangents.held[k] + s.re * by_rate[k] + square.re * by_square[k];
        to->im = s.im * by_rate[k] + square.im * by_square[k];
        if (of->stiffer) to->im += lost[k];
    }
}

/* Contributions of a body, without numbers that the elimination computes; S in reused memory. */
static void write_body_contributions(const mstmm_response *of, mstmm_lanes_at *with, int index)
{
    const mstmm_model *model = of->at->model;
    const mstmm_body *body = &model->bodies[index];
    const int64_t own = body->tangent, B = own + MSTMM_TANGENT_B(body->nu, body->nq);
    const int64_t made = own + MSTMM_TANGENT_H(body->nu, body->nq);
    const int64_t behind = own + MSTMM_TANGENT_NUMBERS(body->nu, body->nq);
    const int64_t end =
        index + 1 < model->n_bodies ? model->bodies[index + 1].tangent : of->n_numbers;
    complex_t *numbers = with->tangents.numbers;
    write_contributions(of, with, own, B, numbers + mstmm_carried_at(&with->tangents, body));
    write_contributions(of, with, B, made, numbers + B);
    write_contributions(of, with, behind, end, numbers + behind);
}

/* --- bodies by their dynamic stiffness --- */

/* Where the effect of cause `j` on `k` is, both of three rotations and three displacements of the
 * frame, and the shapes. */
static complex_t *effect_entry(complex_t *S, complex_t *bend, int n, int j, int k)
{
    const int load = k < 3 ? 3 + k : k - 3;
    if (j < 6)
        return k < 6 ? S + 6 * (3 + j) + load : bend + MSTMM_BEND_Z_Z(n) + n * (3 + j) + k - 6;
    return k < 6 ? bend + MSTMM_BEND_K(n) + 6 * (j - 6) + load
                 : bend + MSTMM_BEND_Z_X(n) + n * (j - 6) + k - 6;
}

/* Frames are described by accelerations: s^2 times their displacements. */
static void write_exact_body(const mstmm_response *of, mstmm_lanes_at *with, int body,
                             int64_t first)
{
    const mstmm_body *one = &of->at->model->bodies[body];
    const int n = mstmm_modes_of(one->modal), size = 6 + n;
    complex_t *numbers = with->tangents.numbers;
    complex_t *S = numbers + mstmm_carried_at(&with->tangents, one);
    complex_t *bend = numbers + one->modal->tangent;
    const complex_t per_square = z_inverse(with->square);
    for (int j = 0; j < size; j++)
        for (int k = 0; k < size; k++) {
            complex_t value, *to = effect_entry(S, bend, n, j, k);
            for (int lane = 0; lane < MSTMM_LANES; lane++) {
                const real *from =
                    of->exact + 2 * (with->place[lane] * of->exact_numbers + first + j * size + k);
                value.re[lane] = from[0];
                value.im[lane] = from[1];
            }
            if (j < 6) value = z_mul(per_square, value);
            *to = value;
        }
}

/* Real parts of the pivots of bodies. */
static void keep_pivots(const mstmm_response *of, const mstmm_lanes_at *with, int count)
{
    const mstmm_model *model = of->at->model;
    const complex_t *numbers = with->tangents.numbers;
    int64_t place = 0;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        int columns[6];
        if (body->idle) continue;
        const int shapes = body->modal ? mstmm_modes_of(body->modal) : 0;
        const int speeds = body->section ? 0 : mstmm_free_speeds(of->at->memory, body, columns);
        const complex_t *from[] = {
            shapes ? numbers + body->modal->tangent + MSTMM_BEND_D(shapes) : NULL,
            numbers + body->tangent + MSTMM_TANGENT_INVERSE(body->nu, body->nq)};
        const int sizes[] = {shapes * shapes, speeds * speeds};
        for (int part = 0; part < 2; part++)
            for (int k = 0; k < sizes[part]; k++, place++)
                for (int lane = 0; lane < count; lane++)
                    of->pivots[lane * of->n_pivots + place] = from[part][k].re[lane];
    }
}

/* Prefetch distance in bodies: lanes have many numbers. */
#define MSTMM_COMPLEX_AHEAD 2

/* Prefetches the numbers of a body for a sweep: contributions common to all frequencies, if
 * `with_contributions`, results of the elimination, loads and motions. */
static inline void prefetch_body(const mstmm_response *of, const mstmm_lanes_at *with, int index,
                                 int with_contributions)
{
    const mstmm_model *model = of->at->model;
    if (index < 0 || index >= model->n_bodies) return;
    const mstmm_body *body = &model->bodies[index];
    const int nu = body->nu;
    const int64_t own = body->tangent, kept = own + MSTMM_TANGENT_B(nu, body->nq);
    const complex_t *numbers = with->tangents.numbers;
    mstmm_fetch(numbers + kept, numbers + own + MSTMM_TANGENT_KNOWN(nu, body->nq));
    if (with_contributions) {
        const int64_t end = own + MSTMM_TANGENT_V(nu, body->nq);
        mstmm_fetch(with->tangents.held + own, with->tangents.held + end);
        for (int k = 0; k < 2; k++) {
            const real *from = of->contributions + k * of->n_numbers;
            mstmm_fetch(from + own, from + end);
        }
    } else {
        const complex_t *block = with->slope.workspace + body->block;
        mstmm_fetch(block + MSTMM_BLOCK_E, mstmm_of_speeds(block, nu, MSTMM_SPEED_TAU) + nu);
    }
}

/* Contributions are computed just before a body uses them, while they are in the cache. */
static int eliminate(mstmm_response *of, mstmm_lanes_at *with)
{
    const mstmm_model *model = of->at->model;
    int64_t exact = 0;
    int begun = model->n_bodies, next = 0;
    with->growth = 1 + (mstmm_lanes){0};
    with->grown = -1 + (mstmm_bits){0};
    for (int i = model->n_bodies - 1; i >= 0; i--) {
        const mstmm_body *body = &model->bodies[i];
        const complex_t *S = with->tangents.numbers + mstmm_carried_at(&with->tangents, body);
        const int least = mstmm_least_parent(model, i, i + 1);
        while (begun > least) {
            if (mstmm_beyond_cache(model))
                prefetch_body(of, with, begun - 1 - MSTMM_COMPLEX_AHEAD, 1);
            write_body_contributions(of, with, --begun);
        }
        for (; next < of->n_exact && of->exact_bodies[next] >= begun; next++) {
            const int size = 6 + mstmm_modes_of(model->bodies[of->exact_bodies[next]].modal);
            write_exact_body(of, with, of->exact_bodies[next], exact);
            exact += size * size;
        }
        mstmm_lanes before[2], after[2];
        inertia_sizes(S, before);
        const int code = mstmm_complex_at_tangent_elimination(&with->state, i);
        if (code) return code;
        inertia_sizes(S, after);
        for (int k = 0; k < 2; k++) {
            const mstmm_bits more = (before[k] > 0) & (after[k] > with->growth * before[k]);
            const mstmm_bits growth = (mstmm_bits)(after[k] / before[k]);
            with->growth = (mstmm_lanes)((more & growth) | (~more & (mstmm_bits)with->growth));
            with->grown = (more & i) | (~more & with->grown);
        }
    }
    return 0;
}

static int solve_tree_in_lanes(const mstmm_response *of, mstmm_lanes_at *with,
                               const complex_t *column, complex_t *unit, complex_t *x)
{
    mstmm_complex_state *state = &with->state;
    const int n = state->model->n_bodies, ahead = MSTMM_COMPLEX_AHEAD;
    const int far = mstmm_beyond_cache(state->model);
    int code = 0;
    memset(with->slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(complex_t)); /* the ground's */
    state->column = column;
    state->answer = x;
    int begun = n;
    for (; unit && !code && begun > 0; begun--)
        code = mstmm_complex_at_tangent_column(state, begun - 1);
    if (unit) *unit = z_plain(1);
    for (int i = n - 1; !code && i >= 0; i--) {
        const int least = mstmm_least_parent(state->model, i, i + 1);
        if (far) prefetch_body(of, with, i - ahead, 0);
        for (; !code && begun > least; begun--)
            code = mstmm_complex_at_tangent_column(state, begun - 1);
        if (!code) code = mstmm_complex_at_tangent_backward(state, i);
    }
    for (int i = 0; !code && i < n; i++) {
        if (far) prefetch_body(of, with, i + ahead, 0);
        code = mstmm_complex_at_tangent_forward(state, i);
    }
    return code;
}

/* --- couplings of distant bodies --- */

/* Change of every coupling along x, lane by lane, real and imaginary parts one after the other. */
static int coupling_changes(mstmm_response *of, const mstmm_lanes_at *with, const complex_t *x,
                            complex_t *changes)
{
    const int nu = of->at->model->nu, m = of->at->n_coupled;
    real *moved = of->scratch, *d_u = moved + nu, *d_a = d_u + nu, *found = d_a + nu;
    real *lossy = found + m;
    for (int part = 0; part < 2 * MSTMM_LANES; part++) {
        const int lane = part / 2, imaginary = part % 2;
        for (int j = 0; j < nu; j++) {
            const complex_t du = z_mul(with->s, x[j]);
            const complex_t da = z_mul(with->square, x[j]);
            moved[j] = imaginary ? x[j].im[lane] : x[j].re[lane];
            d_u[j] = imaginary ? du.im[lane] : du.re[lane];
            d_a[j] = imaginary ? da.im[lane] : da.re[lane];
        }
        int code = mstmm_coupled_along(of->at, moved, d_u, d_a, found);
        if (!code && of->stiffer) code = mstmm_coupled_along(of->stiffer, moved, d_u, d_a, lossy);
        if (code) return code;
        for (int k = 0; k < m; k++) {
            const real lost = of->stiffer ? lossy[k] - found[k] : 0;
            if (imaginary) {
                changes[k].im[lane] += found[k];
                changes[k].re[lane] -= lost;
            } else {
                changes[k].re[lane] = found[k];
                changes[k].im[lane] = lost;
            }
        }
    }
    return 0;
}

/* Unit solutions Y of all couplings, and the inverse of 1 - G Y for c = G x. */
static int close_couplings(mstmm_response *of, mstmm_lanes_at *with)
{
    const mstmm_couplings *all = of->at->couplings;
    const mstmm_model *model = of->at->model;
    const int m = of->at->n_coupled, nu = model->nu, loads = m - all->n_efforts;
    complex_t *inverse = (complex_t *)of->closure, *matrix = inverse + m * m;
    complex_t *one = matrix + m * m, *work = one + m * m, *changes = work + m * m;
    complex_t *column = (complex_t *)of->vectors;
    memset(column, 0, (size_t)nu * sizeof *column);
    for (int k = 0; k < m; k++) {
        complex_t *answer = (complex_t *)of->answers + (int64_t)k * nu, *unit = NULL;
        if (k < loads)
            unit = mstmm_block(model, with->slope.workspace, all->bodies[k / 6]) + MSTMM_BLOCK_E +
                   k % 6;
        else
            column[all->speeds[k - loads]] = z_plain(1);
        int code = solve_tree_in_lanes(of, with, column, unit, answer);
        if (k >= loads) column[all->speeds[k - loads]] = z_plain(0);
        if (!code) code = coupling_changes(of, with, answer, changes);
        if (code) return code;
        for (int i = 0; i < m; i++) {
            one[i * m + k] = z_plain(i == k);
            matrix[i * m + k] = z_sub(one[i * m + k], changes[i]);
        }
    }
    const int code = mstmm_complex_sweep_tangent_invert(m, matrix, one, inverse, work);
    return code ? mstmm_complex_fail(&with->state, MSTMM_FAILED_TANGENT, -1, code) : 0;
}

static int add_couplings(mstmm_response *of, const mstmm_lanes_at *with, complex_t *x)
{
    const int m = of->at->n_coupled, nu = of->at->model->nu;
    const complex_t *inverse = (complex_t *)of->closure;
    complex_t *changes = (complex_t *)of->closure + 4 * m * m;
    const int code = coupling_changes(of, with, x, changes);
    for (int k = 0; !code && k < m; k++) {
        complex_t amount = z_plain(0);
        for (int i = 0; i < m; i++) amount = z_add(amount, z_mul(inverse[k * m + i], changes[i]));
        const complex_t *answer = (complex_t *)of->answers + (int64_t)k * nu;
        for (int j = 0; j < nu; j++) x[j] = z_add(x[j], z_mul(answer[j], amount));
    }
    return code;
}

/* --- several s --- */

static void set_up_lanes(mstmm_response *of, int count, const real *s, mstmm_lanes_at *with)
{
    mstmm_tangent *at = of->at;
    for (int lane = 0; lane < MSTMM_LANES; lane++) { /* the last once more where there are fewer */
        const int k = lane < count ? lane : count - 1;
        with->s.re[lane] = s[2 * k];
        with->s.im[lane] = s[2 * k + 1];
        with->place[lane] = k;
    }
    with->square = z_mul(with->s, with->s);
    with->slope.workspace = (complex_t *)of->workspace;
    with->tangents =
        (mstmm_complex_tangents){.numbers = (complex_t *)of->numbers, .held = at->numbers};
    with->state = (mstmm_complex_state){.model = at->model,
                                        .workspace = at->workspace,
                                        .memory = at->memory,
                                        .slope = &with->slope,
                                        .tangents = &with->tangents,
                                        .failure = &at->failure};
}

#define MSTMM_BY_LANES_OF(lanes) mstmm_response_by_##lanes
#define MSTMM_BY_LANES(lanes) MSTMM_BY_LANES_OF(lanes)

void MSTMM_BY_LANES(MSTMM_LANES)(mstmm_response *of, int count, const real *s, int64_t n,
                                 const real *columns, real *x, real *growth, int *grown)
{
    const int m = of->at->n_coupled, nu = of->at->model->nu;
    complex_t *column = (complex_t *)of->vectors, *answer = column + nu;
    mstmm_lanes_at with;
    set_up_lanes(of, count, s, &with);
    int code = eliminate(of, &with);
    if (!code && of->pivots) keep_pivots(of, &with, count);
    if (!code && m) code = close_couplings(of, &with);
    for (int64_t k = 0; !code && k < n; k++) {
        for (int j = 0; j < nu; j++) column[j] = z_plain(columns[k * nu + j]);
        code = solve_tree_in_lanes(of, &with, column, NULL, answer);
        if (!code && m) code = add_couplings(of, &with, answer);
        for (int lane = 0; lane < count; lane++) {
            real *to = x + 2 * nu * (lane * n + k);
            for (int j = 0; j < nu; j++) {
                to[2 * j] = answer[j].re[lane];
                to[2 * j + 1] = answer[j].im[lane];
            }
        }
    }
    for (int lane = 0; lane < count; lane++) {
        growth[lane] = code ? INFINITY : with.growth[lane];
        grown[lane] = code ? of->at->failure.element : (int)with.grown[lane];
    }
}

#endif
