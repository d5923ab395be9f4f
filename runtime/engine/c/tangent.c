/* Memory of the tangent, and its coordinates, rates and pivots; see tangent.h. */
#include "tangent_workspace.h"

#include "cache_tiling.h"
#include "derivative_direction.h"
#include "sweep_steps.h"

int64_t mstmm_bend_numbers(int n);
int64_t mstmm_port_numbers(int n);

/* Places of S from `place` on, where memory stays at hand: as tiles go from the tips to the root, a
 * place is taken again once all of its tile are eliminated.  Meanwhile bodies with places that are
 * free tell the next such body in `place`. */
static int64_t lay_carried(mstmm_model *model, int64_t place)
{
    int64_t unused = -1;
    for (int end = model->n_bodies, begun = end; end > 0; end -= MSTMM_TILE) {
        const int first = end > MSTMM_TILE ? end - MSTMM_TILE : 0;
        const int least = mstmm_least_parent(model, first, end);
        for (; begun > least; begun--) {
            mstmm_body *body = &model->bodies[begun - 1];
            body->carried = (int)(unused < 0 ? place : model->bodies[unused].carried);
            if (unused < 0)
                place += MSTMM_TANGENT_B(0, 0);
            else
                unused = model->bodies[unused].place;
        }
        for (int i = first; i < end; i++) {
            model->bodies[i].place = unused;
            unused = i;
        }
    }
    return place;
}

int64_t mstmm_tangent_lay(mstmm_model *model)
{
    /* The ground has an S that nobody reads, and a place that does not change. */
    int64_t place = MSTMM_TANGENT_B(0, 0) + MSTMM_PLACE_NUMBERS(0, 0);
    place = lay_carried(model, place);
    for (int i = 0; i < model->n_bodies; i++) {
        mstmm_body *body = &model->bodies[i];
        const int known = body->kernels->slope_tape || body->kernels->hinge_slope;
        if (!known || !body->kernels->bias_load_slope || !body->kernels->load_by_motion)
            return -1 - i;
        body->tangent = place;
        place += MSTMM_TANGENT_NUMBERS(body->nu, body->nq);
        body->place = 0;
        if (body->placed) {
            body->place = place;
            place += MSTMM_PLACE_NUMBERS(body->nu, body->nq);
        }
        if (body->modal) {
            body->modal->tangent = place;
            place += mstmm_bend_numbers(body->modal->n);
        }
        if (body->section && !body->section->inward) {
            body->section->tangent = place;
            place += mstmm_port_numbers(body->section->modal->n);
        }
    }
    for (int k = 0; k < model->n_forces; k++)
        if (!model->forces[k].wrench_slope) return -1 - model->n_bodies - k;
    return place;
}

int64_t mstmm_tangent_work(const mstmm_model *model, int64_t slots)
{
    return cut_tangent_work(model, slots, NULL).used;
}

int64_t mstmm_residual_work(const mstmm_model *model)
{
    return cut_tangent_work(model, 0, NULL).used_by_residual;
}

/* Prescribed speeds have no equations. */
void mstmm_tangent_free(const mstmm_tangent *at, real *entries)
{
    const mstmm_model *model = at->model;
    for (int i = 0; model->n_imposed && i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (!mstmm_imposed_count(body, at->memory)) continue;
        for (int j = 0; j < body->nu; j++)
            if (body->imposed_mask[j]) entries[body->u + j] = 0;
    }
}

int64_t mstmm_tangent_pivots(const mstmm_tangent *at, int *sizes, real *pivots)
{
    int64_t place = 0;
    for (int i = 0; i < at->model->n_bodies; i++) {
        const mstmm_body *one = &at->model->bodies[i];
        const mstmm_modal *modal = mstmm_modal_of(one);
        int columns[6];
        const int shapes = one->idle || !one->modal ? 0 : mstmm_modes_of(modal);
        const int speeds =
            one->idle || one->section ? 0 : mstmm_free_speeds(at->memory, one, columns);
        const int64_t from[] = {shapes ? modal->tangent + MSTMM_BEND_D(shapes) : 0,
                                one->tangent + MSTMM_TANGENT_INVERSE(one->nu, one->nq)};
        sizes[2 * i] = shapes;
        sizes[2 * i + 1] = speeds;
        for (int part = 0; part < 2; part++) {
            const int count = sizes[2 * i + part] * sizes[2 * i + part];
            if (pivots)
                memcpy(pivots + place, at->numbers + from[part], sizeof(real) * (size_t)count);
            place += count;
        }
    }
    return place;
}

/* Prescribed coordinates and speeds do not change and have no rates. */
static void clear_imposed_coordinates(const mstmm_model *model, const real *memory, real *dq)
{
    for (int i = 0; model->n_imposed && i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (!mstmm_imposed_count(body, memory)) continue;
        if (body->n_imposed == body->nu)
            memset(dq + body->q, 0, (size_t)body->nq * sizeof(real));
        else /* rates are speeds where some of them alone are driven */
            for (int j = 0; j < body->nu; j++)
                if (body->imposed_mask[j]) dq[body->q + j] = 0;
    }
}

void mstmm_rates_slope(const mstmm_tangent *at, real *d_rates)
{
    memcpy(d_rates, tangent_parts(at).d_qdot, (size_t)at->model->nq * sizeof(real));
    clear_imposed_coordinates(at->model, at->memory, d_rates);
}

int mstmm_tangent_rates(mstmm_tangent *at, const real *q, const real *u, real *dq)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = tangent_parts(at);
    mstmm_state state = tangent_state(at, &parts);
    state.q = q;
    state.u = u;
    state.qdot = dq;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (body->straight) {
            memcpy(dq + body->q, u + body->u, (size_t)body->nu * sizeof(real));
        } else {
            const int code = mstmm_at_hinge_motion(&state, i);
            if (code) return code;
        }
        if (body->modal)
            memcpy(dq + body->modal->q, u + body->modal->u, (size_t)body->modal->n * sizeof(real));
    }
    clear_imposed_coordinates(model, at->memory, dq);
    return 0;
}

/* dq of a hinge whose rates go by its coordinates, with laws alone: what it changes the rates by is
 * taken from itself once. */
static int iterate_coordinates(mstmm_state *state, const mstmm_tangent *at, const mstmm_body *body,
                               int i)
{
    real *d_q = mstmm_writable(state->slope->q) + body->q, *dq = state->tangents->change + body->q;
    int code = 0;
    for (int round = 0; !code && round < (at->kappa > 0 ? 2 : 1); round++) {
        code = mstmm_at_rates_change(state, i);
        for (int j = 0; j < body->nq; j++) d_q[j] = dq[j] /= at->sq;
    }
    memset(d_q, 0, (size_t)body->nq * sizeof(real));
    return code;
}

int mstmm_tangent_coordinates(mstmm_tangent *at, const real *du, const real *rho, real *dq)
{
    const mstmm_model *model = at->model;
    const mstmm_parts parts = tangent_parts(at);
    mstmm_tangents step = tangent_steps(at);
    step.rho = rho ? rho : parts.still;
    step.change = dq;
    mstmm_state state = known_state(at, &parts), slope = tangent_slope(at, &parts, parts.answer);
    state.slope = &slope;
    state.tangents = &step;
    memset(parts.d_q, 0, (size_t)model->nq * sizeof(real));
    slope.u = du;
    for (int i = 0; i < model->n_bodies; i++) {
        const mstmm_body *body = &model->bodies[i];
        if (body->straight) {
            for (int j = 0; j < body->nu; j++)
                dq[body->q + j] = (du[body->u + j] + step.rho[body->q + j]) / at->sq;
        } else {
            const int code = at->approximate ? iterate_coordinates(&state, at, body, i)
                                             : mstmm_at_coordinate_increment(&state, i);
            if (code) return code;
        }
        if (!body->modal) continue;
        for (int j = 0; j < body->modal->n; j++) {
            const int place = body->modal->q + j;
            dq[place] = (du[body->modal->u + j] + step.rho[place]) / at->sq;
        }
    }
    clear_imposed_coordinates(model, at->memory, dq);
    return 0;
}
