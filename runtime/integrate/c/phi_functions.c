/* Scaling and squaring: X is balanced by powers of two, so that a coordinate and its speed, and
 * stiff and slack parts, are of one size; halved until a short Taylor polynomial has all digits;
 * and its exponential squared back.  With E = exp(tau A) and a_k(tau) = tau^k phi_k(tau A) the phi
 * follow in products with vectors alone:
 *
 *   a_1(2 tau) = E a_1 + a_1,  a_2(2 tau) = E a_2 + a_2 + tau a_1,
 *   a_3(2 tau) = E a_3 + a_3 + tau a_2 + tau^2/2 a_1.
 *
 * E - 1 is stored, squared as 2 (E - 1) + (E - 1)^2: with fast motions the first levels of a slow
 * one are so close to 1 that it would be lost.
 *
 * All levels are kept: w(theta) is a piece of the first level by the polynomial and one product for
 * every bit of what is left.
 *
 * N. J. Higham, Functions of Matrices (2008), sections 10.3 and 10.7; A. H. Al-Mohy, N. J. Higham,
 * SIAM Journal on Scientific Computing 33 (2011) 488-511 (the motion above as one exponential);
 * B. N. Parlett, C. Reinsch, Numerische Mathematik 13 (1969) 293-304 (balancing). */
#include "phi_functions.h"

#include <math.h>
#include <string.h>

#include "four_lanes.h"

enum { MOST_LEVELS = 40, DEGREE = 16, PRODUCTS = 6 };
static const double SMALL = 0.8; /* of a norm: then the rest of the polynomial is below rounding */

/* ---- storage ---- */

static int padded_length(int n) { return (n + WIDE - 1) / WIDE * WIDE; }

int64_t mstmm_phi_size(int n)
{
    const int64_t row = padded_length(n), square = n * row;
    return WIDE + row + square + MOST_LEVELS * square + (MOST_LEVELS + 1) * PRODUCTS * row +
           3 * row + 5 * square;
}

mstmm_phi mstmm_phi_lay(int n, double *numbers)
{
    const int64_t row = padded_length(n), square = n * row;
    mstmm_phi phi = {.n = n, .row = (int)row, .levels = numbers};
    if (!numbers) return phi;
    phi.scale = numbers + WIDE;
    phi.matrix = phi.scale + row;
    phi.powers = phi.matrix + square;
    phi.moved = phi.powers + MOST_LEVELS * square;
    phi.forces = phi.moved + (MOST_LEVELS + 1) * PRODUCTS * row;
    phi.scratch = phi.forces + 3 * row;
    return phi;
}

static int64_t square_of(const mstmm_phi *phi) { return (int64_t)phi->n * phi->row; }

static double *power_of(const mstmm_phi *phi, int level)
{
    return phi->powers + level * square_of(phi);
}

/* Row `product` of a level: a_1 c_0; a_1 c_1, a_2 c_1; a_1 c_2, a_2 c_2, a_3 c_2 */
static double *moved_row(const mstmm_phi *phi, int level, int product)
{
    return phi->moved + ((int64_t)level * PRODUCTS + product) * phi->row;
}

/* ---- products; rows are whole vectors, zeros behind n ---- */

MSTMM_WIDE static void multiply_matrices(const mstmm_phi *phi, const double *a, const double *b,
                                         double *out)
{
    const int n = phi->n, row = phi->row;
    memset(out, 0, (size_t)square_of(phi) * sizeof(double));
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            const double entry = a[i * row + k];
            for (int j = 0; j < row; j += WIDE)
                *(wide *)(out + i * row + j) += entry * *(const wide *)(b + k * row + j);
        }
}

MSTMM_WIDE static void apply_matrix(const mstmm_phi *phi, const double *a, const double *x,
                                    double *out)
{
    for (int i = 0; i < phi->n; i++) {
        wide sum = {0.0};
        for (int j = 0; j < phi->row; j += WIDE)
            sum += *(const wide *)(a + i * phi->row + j) * *(const wide *)(x + j);
        out[i] = mstmm_total(&sum);
    }
}

static void add_vector(const mstmm_phi *phi, double weight, const double *x, double *sum)
{
    for (int i = 0; i < phi->n; i++) sum[i] += weight * x[i];
}

/* ---- balancing ---- */

/* Sizes of row and column i but for the diagonal */
static void sizes(const mstmm_phi *phi, int i, double *of_row, double *of_column)
{
    *of_row = *of_column = 0.0;
    for (int j = 0; j < phi->n; j++) {
        if (j == i) continue;
        *of_row += fabs(phi->matrix[i * phi->row + j]);
        *of_column += fabs(phi->matrix[j * phi->row + i]);
    }
}

/* Row i divided and column i multiplied by a power of two; returns whether that helped. */
static int balance_one(const mstmm_phi *phi, int i)
{
    double of_row, of_column, factor = 1.0;
    sizes(phi, i, &of_row, &of_column);
    if (!(of_row > 0.0) || !(of_column > 0.0)) return 0;
    const double before = of_row + of_column;
    for (; of_column < 0.5 * of_row; of_column *= 2.0, of_row *= 0.5) factor *= 2.0;
    for (; of_column >= 2.0 * of_row; of_column *= 0.5, of_row *= 2.0) factor *= 0.5;
    if (!(of_row + of_column < 0.95 * before)) return 0;
    phi->scale[i] *= factor;
    for (int j = 0; j < phi->n; j++) phi->matrix[i * phi->row + j] /= factor;
    for (int j = 0; j < phi->n; j++) phi->matrix[j * phi->row + i] *= factor;
    return 1;
}

static void balance(const mstmm_phi *phi)
{
    for (int again = 1; again;) {
        again = 0;
        for (int i = 0; i < phi->n; i++) again |= balance_one(phi, i);
    }
}

/* The smaller of the largest sums along rows and along columns */
static double matrix_norm(const mstmm_phi *phi)
{
    double rows = 0.0, columns = 0.0;
    for (int i = 0; i < phi->n; i++) {
        double of_row, of_column;
        sizes(phi, i, &of_row, &of_column);
        const double own = fabs(phi->matrix[i * phi->row + i]);
        rows = fmax(rows, of_row + own);
        columns = fmax(columns, of_column + own);
    }
    return fmin(rows, columns);
}

/* ---- the exponentials ---- */

/* to += w[0] + w[1] A + w[2] A^2 + w[3] A^3, the second and third power behind each other */
static void add_part(const mstmm_phi *phi, const double *w, const double *second, double *to)
{
    const int64_t square = square_of(phi);
    for (int64_t i = 0; i < square; i++)
        to[i] += w[1] * phi->matrix[i] + w[2] * second[i] + w[3] * second[square + i];
    for (int i = 0; i < phi->n; i++) to[i * phi->row + i] += w[0];
}

/* exp(A) - 1, by the polynomial in A^4 whose coefficients are cubics in A */
static void matrix_exponential(const mstmm_phi *phi, double *out)
{
    const int64_t square = square_of(phi);
    double *second = phi->scratch, *third = second + square, *fourth = third + square;
    double *sum = fourth + square, *next = sum + square, weights[DEGREE + 1] = {1.0};
    for (int i = 1; i <= DEGREE; i++) weights[i] = weights[i - 1] / i;
    weights[0] = 0.0;
    multiply_matrices(phi, phi->matrix, phi->matrix, second);
    multiply_matrices(phi, second, phi->matrix, third);
    multiply_matrices(phi, second, second, fourth);
    for (int64_t i = 0; i < square; i++) sum[i] = weights[DEGREE] * fourth[i];
    for (int k = DEGREE - 4;; k -= 4) {
        add_part(phi, weights + k, second, sum);
        if (k == 0) break;
        multiply_matrices(phi, fourth, sum, next);
        memcpy(sum, next, (size_t)square * sizeof(double));
    }
    memcpy(out, sum, (size_t)square * sizeof(double));
}

/* From E - 1 to E^2 - 1 */
static void square_up(const mstmm_phi *phi, const double *from, double *to)
{
    multiply_matrices(phi, from, from, to);
    for (int64_t i = 0; i < square_of(phi); i++) to[i] += 2.0 * from[i];
}

/* True if all of h J is finite and so small that sums of it are. */
static int set_matrix(const mstmm_phi *phi, double h, const double *J)
{
    double size = 0.0;
    memset(phi->matrix, 0, (size_t)square_of(phi) * sizeof(double));
    for (int i = 0; i < phi->n; i++) {
        phi->scale[i] = 1.0;
        for (int j = 0; j < phi->n; j++) {
            phi->matrix[i * phi->row + j] = h * J[i * phi->n + j];
            size += fabs(phi->matrix[i * phi->row + j]);
        }
    }
    return isfinite(size);
}

int mstmm_phi_prepare(const mstmm_phi *phi, double h, const double *J)
{
    if (!set_matrix(phi, h, J)) return 1;
    balance(phi);
    double size = matrix_norm(phi);
    int levels = 0;
    for (; size > SMALL; size *= 0.5) levels++;
    if (levels > MOST_LEVELS) return 1;
    *phi->levels = levels;
    for (int64_t i = 0; i < square_of(phi); i++) phi->matrix[i] = ldexp(phi->matrix[i], -levels);
    if (levels) matrix_exponential(phi, phi->powers);
    for (int j = 1; j < levels; j++) square_up(phi, power_of(phi, j - 1), power_of(phi, j));
    return 0;
}

/* ---- vectors ---- */

/* to_j += a_j(tau) d for j = 1 .. count, tau at most 1, by the series; d is destroyed */
static void add_series(const mstmm_phi *phi, double tau, int count, double *d, double *const *to)
{
    double *next = phi->scratch, power = 1.0;
    memset(next, 0, (size_t)phi->row * sizeof(double));
    for (int i = 0; i <= DEGREE; i++) { /* power = tau^i / i! */
        double weight = power;
        for (int j = 1; j <= count; j++) {
            weight *= tau / (i + j);
            add_vector(phi, weight, d, to[j - 1]);
        }
        apply_matrix(phi, phi->matrix, d, next);
        memcpy(d, next, (size_t)phi->row * sizeof(double));
        power *= tau / (i + 1);
    }
}

/* out = E x */
static void apply_exponential(const mstmm_phi *phi, int level, const double *x, double *out)
{
    memset(out, 0, (size_t)phi->row * sizeof(double));
    apply_matrix(phi, power_of(phi, level), x, out);
    add_vector(phi, 1.0, x, out);
}

/* From a level to the next: the first `count` of the a_j of one force */
static void double_up(const mstmm_phi *phi, int level, int first, int count)
{
    const double tau = ldexp(1.0, level);
    for (int j = 0; j < count; j++) {
        double *to = moved_row(phi, level + 1, first + j), weight = 1.0;
        apply_exponential(phi, level, moved_row(phi, level, first + j), to);
        for (int l = j; l >= 0; l--) {
            add_vector(phi, weight, moved_row(phi, level, first + l), to);
            weight *= tau / (j - l + 1);
        }
    }
}

void mstmm_phi_force(const mstmm_phi *phi, int k, const double *c)
{
    const int levels = (int)*phi->levels, first = k * (k + 1) / 2, count = k + 1;
    double *force = phi->forces + k * phi->row, *d = phi->scratch + phi->row, *to[3];
    memset(force, 0, (size_t)phi->row * sizeof(double));
    for (int i = 0; i < phi->n; i++) force[i] = ldexp(c[i] / phi->scale[i], -(k + 1) * levels);
    memcpy(d, force, (size_t)phi->row * sizeof(double));
    for (int j = 0; j < count; j++) {
        to[j] = moved_row(phi, 0, first + j);
        memset(to[j], 0, (size_t)phi->row * sizeof(double));
    }
    add_series(phi, 1.0, count, d, to);
    for (int level = 0; level < levels; level++) double_up(phi, level, first, count);
}

void mstmm_phi_part(const mstmm_phi *phi, int k, double *part)
{
    const double *found = moved_row(phi, (int)*phi->levels, k * (k + 1) / 2 + k);
    for (int i = 0; i < phi->n; i++) part[i] = phi->scale[i] * found[i];
}

/* w at `tau` from the start of the motion, by the series: each force by its own last a */
static void begin_motion(const mstmm_phi *phi, double tau, double *w)
{
    double *d = phi->scratch + phi->row, *unused = d + phi->row, *to[3];
    memset(w, 0, (size_t)phi->row * sizeof(double));
    for (int k = 0; k < 3; k++) {
        memcpy(d, phi->forces + k * phi->row, (size_t)phi->row * sizeof(double));
        for (int j = 0; j < 3; j++) to[j] = j == k ? w : unused;
        memset(unused, 0, (size_t)phi->row * sizeof(double));
        add_series(phi, tau, k + 1, d, to);
    }
}

/* w moves on by the length of a level from `tau`, where the forces have gone on to be others. */
static void continue_motion(const mstmm_phi *phi, int level, double tau, double *w)
{
    double *moved = phi->scratch;
    apply_exponential(phi, level, w, moved);
    const double weights[PRODUCTS] = {1.0, tau, 1.0, 0.5 * tau * tau, tau, 1.0};
    for (int i = 0; i < PRODUCTS; i++) add_vector(phi, weights[i], moved_row(phi, level, i), moved);
    memcpy(w, moved, (size_t)phi->row * sizeof(double));
}

void mstmm_phi_at(const mstmm_phi *phi, double theta, double *w)
{
    const int levels = (int)*phi->levels;
    const double whole = ldexp(1.0, levels), place = fmin(fmax(theta, 0.0), 1.0) * whole;
    const double steps = fmin(floor(place), whole - 1.0);
    const int64_t bits = (int64_t)steps;
    double *at = phi->scratch + 3 * phi->row, tau = place - steps;
    begin_motion(phi, tau, at);
    for (int level = 0; level < levels; level++) {
        if (!(bits >> level & 1)) continue;
        continue_motion(phi, level, tau, at);
        tau += ldexp(1.0, level);
    }
    for (int i = 0; i < phi->n; i++) w[i] = phi->scale[i] * at[i];
}
