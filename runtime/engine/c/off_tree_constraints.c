/* Rows and own accelerations of closing hinges along a direction; see across.h. */
#include "across.h"

static int64_t place_of_row(const mstmm_model *model, const mstmm_coupled_row *one)
{
    if (one->frame < 0) return model->loops + MSTMM_ROW * (int64_t)one->row + MSTMM_ROW_KNOWN;
    const mstmm_closure *closure = model->looped[one->frame].closure;
    return model->loops + closure->numbers + MSTMM_CLOSURE_L + one->direction;
}

void mstmm_set_own_apart(const mstmm_tangent *at, real *a, real *own)
{
    memcpy(own, a, (size_t)at->model->nu * sizeof(real));
    for (int k = 0; k < at->couplings->n_rows; k++)
        if (at->couplings->rows[k].speed >= 0) a[at->couplings->rows[k].speed] = 0;
}

/* Residual; for a rotor its inertia times its acceleration minus the multiplier. */
void mstmm_rows_along(const mstmm_tangent *at, real *workspace, const real *own, real *rows)
{
    const mstmm_model *model = at->model;
    for (int k = 0; k < at->couplings->n_rows; k++) {
        const mstmm_coupled_row *one = &at->couplings->rows[k];
        const real softness = one->row < 0 ? 0 : model->rows[one->row].softness;
        if (softness > 0)
            rows[k] = own[model->bodies[one->frame].u + one->direction]
                      - softness * mstmm_row_numbers(model, workspace, one->row)[MSTMM_ROW_X];
        else
            rows[k] = workspace[place_of_row(model, one)]
                      - (one->speed < 0 ? 0 : own[one->speed]);
    }
}

void mstmm_keep_multipliers(const mstmm_model *model, real *workspace)
{
    for (int r = 0; r < model->n_rows; r++) mstmm_row_numbers(model, workspace, r)[MSTMM_ROW_X] = 0;
}

void mstmm_lacking(const mstmm_tangent *at, const real *workspace, const real *own,
                   real *required)
{
    for (int k = 0; at->model->looped && k < at->couplings->n_rows; k++) {
        const mstmm_coupled_row *one = &at->couplings->rows[k];
        if (one->speed >= 0)
            required[one->speed] = own[one->speed] - workspace[place_of_row(at->model, one)];
    }
}
