/* Rotations by vectors: exponential, inverse of its tangent operator, quaternion. */
#include <math.h>

#include "parts.h"

/* out = one 1 + two v~ + three v~ v~ */
static void combine_skew(const real *v, real two, real three, real *out)
{
    const real square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[4 * i] = 1 + three * (v[i] * v[i] - square);
        out[3 * i + j] = three * v[i] * v[j] - two * v[k];
        out[3 * i + k] = three * v[i] * v[k] + two * v[j];
    }
}

/* exp(v~); series where the angle is small */
void classical_exponential(const real *v, real *rotation)
{
    const real x = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], angle = sqrt(x);
    if (angle < 1e-2) {
        combine_skew(v, 1 - x / 6 * (1 - x / 20 * (1 - x / 42)),
                     0.5 * (1 - x / 12 * (1 - x / 30 * (1 - x / 56))), rotation);
        return;
    }
    const real half = sin(angle / 2) / angle;
    combine_skew(v, sin(angle) / angle, 2 * half * half, rotation);
}

/* dv = T dphi for R exp(v~) turned by dphi in its own axes: 1 + v~/2 + (1 - x cot x)/(4 x^2) v~ v~
 * with x = |v|/2.  Cf. Geradin, Cardona, Flexible Multibody Dynamics, Wiley 2001, ch. 4. */
void classical_inverse_tangent(const real *v, real *matrix)
{
    const real square = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], x = sqrt(square) / 2;
    const real factor =
        x < 1e-2 ? (1 + square / 60 * (1 + square / 42)) / 12 : (1 - x / tan(x)) / square;
    combine_skew(v, 0.5, factor, matrix);
}

/* Unit quaternion w, x, y, z of a rotation matrix, w not below zero. */
void classical_quaternion(const real *r, real *quaternion)
{
    const real squares[4] = {1 + r[0] + r[4] + r[8], 1 + r[0] - r[4] - r[8], 1 - r[0] + r[4] - r[8],
                             1 - r[0] - r[4] + r[8]};
    const real products[4][4] = {{squares[0], r[7] - r[5], r[2] - r[6], r[3] - r[1]},
                                 {r[7] - r[5], squares[1], r[1] + r[3], r[2] + r[6]},
                                 {r[2] - r[6], r[1] + r[3], squares[2], r[5] + r[7]},
                                 {r[3] - r[1], r[2] + r[6], r[5] + r[7], squares[3]}};
    int best = 0;
    for (int i = 1; i < 4; i++)
        if (squares[i] > squares[best]) best = i;
    const real scale = 0.5 / sqrt(squares[best]) * (products[best][0] < 0 ? -1 : 1);
    for (int i = 0; i < 4; i++) quaternion[i] = scale * products[best][i];
}

/* Angular velocity in the axes before the turn = T dv/dt for exp(v~). */
void classical_tangent(const real *v, real *matrix)
{
    const real x = v[0] * v[0] + v[1] * v[1] + v[2] * v[2], angle = sqrt(x);
    if (angle < 1e-2) {
        combine_skew(v, 0.5 * (1 - x / 12 * (1 - x / 30)), (1 - x / 20 * (1 - x / 42)) / 6, matrix);
        return;
    }
    const real half = sin(angle / 2) / angle;
    combine_skew(v, 2 * half * half, (1 - sin(angle) / angle) / x, matrix);
}
