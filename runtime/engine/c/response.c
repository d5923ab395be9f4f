/* Amplitudes under harmonic pushes; see response.h. */
#include "response.h"

#include <string.h>

/* Steps so long that coordinates follow nothing: their share is lost beside any other. */
#define MSTMM_STILL 1e300

int mstmm_response_begin(mstmm_response *of)
{
    mstmm_tangent *at = of->at;
    const size_t n = (size_t)of->n_numbers;
    real *by_rate = of->brought, *by_square = by_rate + n;
    int code = mstmm_tangent_brought(at, 0, 0, MSTMM_STILL);
    if (code) return code;
    memcpy(by_square, at->numbers, n * sizeof(real));
    code = mstmm_tangent_brought(at, 1, 0, MSTMM_STILL);
    for (size_t k = 0; k < n; k++) by_rate[k] = at->numbers[k] - by_square[k];
    if (!code) code = mstmm_tangent_brought(at, 0, 1, MSTMM_STILL);
    for (size_t k = 0; k < n; k++) by_square[k] = at->numbers[k] - by_square[k];
    return code ? code : mstmm_tangent_brought(at, 0, 0, 1);
}

/* --- one s --- */

typedef struct {
    mstmm_complex_state state;
    mstmm_complex_slope slope;
    mstmm_complex_tangents tangents;
    mstmm_complex s;
} mstmm_sweep_at;

static void take(mstmm_response *of, mstmm_complex s, mstmm_sweep_at *to)
{
    mstmm_tangent *at = of->at;
    to->slope.workspace = (mstmm_complex *)of->workspace;
    to->tangents = (mstmm_complex_tangents){.numbers = (mstmm_complex *)of->numbers,
                                            .held = at->numbers};
    to->s = s;
    to->state = (mstmm_complex_state){
        .model = at->model, .workspace = at->workspace, .memory = at->memory,
        .slope = &to->slope, .tangents = &to->tangents, .failure = &at->failure};
}

/* Inertia in S: angular accelerations to moments, accelerations to forces. */
static void inertia(const mstmm_complex *S, double *sizes)
{
    sizes[0] = sizes[1] = 0;
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++) {
            sizes[0] += mstmm_complex_size(S[6 * (3 + row) + 3 + column]);
            sizes[1] += mstmm_complex_size(S[6 * (6 + row) + column]);
        }
}

static int eliminate(mstmm_response *of, mstmm_sweep_at *with)
{
    const mstmm_model *model = of->at->model;
    const real *by_rate = of->brought, *by_square = by_rate + of->n_numbers;
    mstmm_complex *numbers = with->tangents.numbers;
    const mstmm_complex s = with->s, square = s * s;
    for (int64_t k = 0; k < of->n_numbers; k++)
        numbers[k] = with->tangents.held[k] + s * by_rate[k] + square * by_square[k];
    of->growth = 1;
    of->grown = -1;
    for (int i = model->n_bodies - 1; i >= 0; i--) {
        const mstmm_complex *S = numbers + model->bodies[i].tangent;
        double before[2], after[2];
        inertia(S, before);
        const int code = mstmm_complex_at_tangent_eliminated(&with->state, i);
        if (code) return code;
        inertia(S, after);
        for (int k = 0; k < 2; k++)
            if (before[k] > 0 && after[k] > of->growth * before[k]) {
                of->growth = after[k] / before[k];
                of->grown = i;
            }
    }
    return 0;
}

static int solve_alone(mstmm_sweep_at *with, const mstmm_complex *column, mstmm_complex *unit,
                       mstmm_complex *x)
{
    mstmm_complex_state *state = &with->state;
    const int n = state->model->n_bodies;
    int code = 0;
    memset(with->slope.workspace, 0, MSTMM_BLOCK_FIXED * sizeof(mstmm_complex)); /* the ground's */
    state->column = column;
    state->answer = x;
    for (int i = 0; !code && i < n; i++) code = mstmm_complex_at_tangent_column(state, i);
    if (unit) *unit = 1;
    for (int i = n - 1; !code && i >= 0; i--) code = mstmm_complex_at_tangent_carried(state, i);
    for (int i = 0; !code && i < n; i++) code = mstmm_complex_at_tangent_answered(state, i);
    return code;
}

/* --- across the tree --- */

/* Change of every coupling along x, its part `half` (0: real, 1: imaginary). */
static int coupled_half(mstmm_response *of, mstmm_complex s, const mstmm_complex *x, int half,
                        real *changes)
{
    const int nu = of->at->model->nu;
    real *moved = of->scratch, *d_u = moved + nu, *d_a = d_u + nu;
    const mstmm_complex square = s * s;
    for (int j = 0; j < nu; j++) {
        const mstmm_complex du = s * x[j], da = square * x[j];
        moved[j] = half ? __imag__ x[j] : __real__ x[j];
        d_u[j] = half ? __imag__ du : __real__ du;
        d_a[j] = half ? __imag__ da : __real__ da;
    }
    return mstmm_coupled_along(of->at, moved, d_u, d_a, changes);
}

static int coupled_along(mstmm_response *of, mstmm_complex s, const mstmm_complex *x,
                         mstmm_complex *changes)
{
    const int m = of->at->n_coupled;
    real *plain = of->scratch + 3 * of->at->model->nu, *imaginary = plain + m;
    int code = coupled_half(of, s, x, 0, plain);
    if (!code) code = coupled_half(of, s, x, 1, imaginary);
    for (int k = 0; k < m; k++) {
        __real__ changes[k] = plain[k];
        __imag__ changes[k] = imaginary[k];
    }
    return code;
}

/* Answers Y to one of each coupling, and the inverse of 1 - G Y where they are c = G x. */
static int close_couplings(mstmm_response *of, mstmm_sweep_at *with)
{
    const mstmm_couplings *all = of->at->couplings;
    const mstmm_model *model = of->at->model;
    const int m = of->at->n_coupled, nu = model->nu, loads = m - all->n_efforts;
    mstmm_complex *inverse = (mstmm_complex *)of->closure, *matrix = inverse + m * m;
    mstmm_complex *one = matrix + m * m, *work = one + m * m, *changes = work + m * m;
    mstmm_complex *column = (mstmm_complex *)of->column;
    memset(column, 0, (size_t)nu * sizeof *column);
    for (int k = 0; k < m; k++) {
        mstmm_complex *answer = (mstmm_complex *)of->answers + (int64_t)k * nu, *unit = NULL;
        if (k < loads)
            unit = mstmm_block(model, with->slope.workspace, all->bodies[k / 6])
                   + MSTMM_BLOCK_E + k % 6;
        else
            column[all->speeds[k - loads]] = 1;
        int code = solve_alone(with, column, unit, answer);
        if (k >= loads) column[all->speeds[k - loads]] = 0;
        if (!code) code = coupled_along(of, with->s, answer, changes);
        if (code) return code;
        for (int i = 0; i < m; i++) {
            matrix[i * m + k] = (i == k) - changes[i];
            one[i * m + k] = i == k;
        }
    }
    const int code = mstmm_complex_judged(
        &with->state, mstmm_complex_sweep_tangent_invert(m, matrix, one, inverse, work));
    return code ? mstmm_complex_fail(&with->state, MSTMM_FAILED_TANGENT, -1, code) : 0;
}

static int add_couplings(mstmm_response *of, mstmm_complex s, mstmm_complex *x)
{
    const int m = of->at->n_coupled, nu = of->at->model->nu;
    const mstmm_complex *inverse = (mstmm_complex *)of->closure;
    mstmm_complex *changes = (mstmm_complex *)of->closure + 4 * m * m;
    const int code = coupled_along(of, s, x, changes);
    for (int k = 0; !code && k < m; k++) {
        mstmm_complex amount = 0;
        for (int i = 0; i < m; i++) amount += inverse[k * m + i] * changes[i];
        const mstmm_complex *answer = (mstmm_complex *)of->answers + (int64_t)k * nu;
        for (int j = 0; j < nu; j++) x[j] += answer[j] * amount;
    }
    return code;
}

static int response_at(mstmm_response *of, mstmm_complex s, int64_t n, const real *columns,
                       mstmm_complex *x)
{
    const int m = of->at->n_coupled, nu = of->at->model->nu;
    mstmm_complex *column = (mstmm_complex *)of->column;
    mstmm_sweep_at with;
    take(of, s, &with);
    int code = eliminate(of, &with);
    if (!code && m) code = close_couplings(of, &with);
    for (int64_t k = 0; !code && k < n; k++) {
        mstmm_complex *answer = x + k * nu;
        for (int j = 0; j < nu; j++) column[j] = columns[k * nu + j];
        code = solve_alone(&with, column, NULL, answer);
        if (!code && m) code = add_couplings(of, s, answer);
    }
    return code;
}

void mstmm_response_many(mstmm_response *of, int64_t count, const real *s, int64_t n,
                         const real *columns, real *x, real *growth, int *grown)
{
    const mstmm_complex *at = (const mstmm_complex *)s;
    const int64_t size = n * of->at->model->nu;
    for (int64_t k = 0; k < count; k++) {
        mstmm_complex *to = (mstmm_complex *)x + k * size;
        const int code = response_at(of, at[k], n, columns, to);
        growth[k] = code ? INFINITY : of->growth;
        grown[k] = code ? of->at->failure.element : of->grown;
        if (code) memset(to, 0, (size_t)size * sizeof *to);
    }
}
