/* Points by the code of a scene; see fused_kinematics.h. */
#include "fused_kinematics.h"

#include <string.h>

#include "is_finite.h"

enum { END_NUMBERS = 12 };

/* Arguments of a kernel for probe i; its time is not read. */
#define GIVEN(points, q, u, i)                                                                     \
    (points)->p, (points)->none, q, u, (points)->memory, (points)->ends + END_NUMBERS *(i)

static int has_finite_state(const mstmm_compiled_points *points, const real *q, const real *u)
{
    const mstmm_fused *code = points->codes[0];
    return mstmm_finite(code->nq, q) && mstmm_finite(code->nu, u);
}

int mstmm_compiled_points_places(const void *record, real none, const real *const *rows,
                                 real *const *answers)
{
    const mstmm_compiled_points *points = record;
    const real *q = rows[0], *still = points->none;
    real axes[9];
    int failed = !has_finite_state(points, q, still);
    (void)none;
    for (int i = 0; !failed && i < points->n_probes; i++)
        failed = points->codes[i]->pose(GIVEN(points, q, still, i), answers[0] + 3 * i, axes);
    return failed;
}

int mstmm_compiled_points_poses(const void *record, real none, const real *const *rows,
                                real *const *answers)
{
    const mstmm_compiled_points *points = record;
    const real *q = rows[0], *still = points->none;
    real place[3], axes[9];
    int failed = !has_finite_state(points, q, still);
    (void)none;
    for (int i = 0; !failed && i < points->n_probes; i++) {
        real *pose = answers[0] + 16 * i;
        failed = points->codes[i]->pose(GIVEN(points, q, still, i), place, axes);
        for (int row = 0; row < 3; row++) {
            memcpy(pose + 4 * row, axes + 3 * row, 3 * sizeof(real));
            pose[4 * row + 3] = place[row];
            pose[12 + row] = 0;
        }
        pose[15] = 1;
    }
    return failed;
}

/* A kernel with one result. */
typedef int kernel(const double *p, const double *t, const double *q, const double *u,
                   const double *memory, const double *end, double *answer);
typedef kernel *chosen(const mstmm_fused *code);

static kernel *motion_kernel(const mstmm_fused *code) { return code->velocities; }
static kernel *jacobian_kernel(const mstmm_fused *code) { return code->jacobian; }
static kernel *jacobian_rate_kernel(const mstmm_fused *code) { return code->jacobian_rate; }

/* `width` numbers of every probe. */
static int evaluate_probes(const mstmm_compiled_points *points, chosen *of, const real *q,
                           const real *u, int64_t width, real *answer)
{
    int failed = !has_finite_state(points, q, u);
    for (int i = 0; !failed && i < points->n_probes; i++)
        failed = of(points->codes[i])(GIVEN(points, q, u, i), answer + width * i);
    return failed || !mstmm_finite(width * points->n_probes, answer);
}

int mstmm_compiled_points_velocities(const void *record, real none, const real *const *rows,
                                     real *const *answers)
{
    (void)none;
    return evaluate_probes(record, motion_kernel, rows[0], rows[1], 6, answers[0]);
}

int mstmm_compiled_points_jacobian(const void *record, real none, const real *const *rows,
                                   real *const *answers)
{
    const mstmm_compiled_points *points = record;
    const int64_t width = 6 * (int64_t)points->codes[0]->nu;
    (void)none;
    return evaluate_probes(points, jacobian_kernel, rows[0], points->none, width, answers[0]);
}

int mstmm_compiled_points_jacobian_rate(const void *record, real none, const real *const *rows,
                                        real *const *answers)
{
    const mstmm_compiled_points *points = record;
    const int64_t width = 6 * (int64_t)points->codes[0]->nu;
    (void)none;
    return evaluate_probes(points, jacobian_rate_kernel, rows[0], rows[1], width, answers[0]);
}
