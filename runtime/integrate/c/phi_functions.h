/* The exponential of a matrix X and its relatives phi_1, phi_2, phi_3, applied to vectors: motion
 *
 *   w' = X w + c_0 + c_1 theta + c_2 theta^2 / 2,  w(0) = 0,
 *   w(theta) = theta phi_1(theta X) c_0 + theta^2 phi_2(theta X) c_1 + theta^3 phi_3(theta X) c_2,
 *
 * at any theta from 0 to 1, for a dense X of few rows. */
#ifndef MSTMM_PHI_FUNCTIONS_H
#define MSTMM_PHI_FUNCTIONS_H

#include <stdint.h>

/* The caller owns all memory: mstmm_phi_lay places it in mstmm_phi_size doubles. */
typedef struct mstmm_phi {
    int n, row;      /* rows of X, and doubles from one row of a matrix or vector to the next */
    double *levels;  /* 1: X / 2^levels is small */
    double *scale;   /* a row: powers of two that balance X */
    double *matrix;  /* n rows: X / 2^levels, balanced */
    double *powers;  /* n rows a level: the exponential of 2^j times that, less 1 */
    double *moved;   /* 6 rows a level, and one more: the phi times the c, see phi_functions.c */
    double *forces;  /* 3 rows: the c, balanced, in the units of a first step */
    double *scratch; /* 5 n rows */
} mstmm_phi;

int64_t mstmm_phi_size(int n);
mstmm_phi mstmm_phi_lay(int n, double *numbers);
/* Takes X = h J, J (n x n).  1 where that is not finite, or so large that nothing but rounding
 * would be left. */
int mstmm_phi_prepare(const mstmm_phi *phi, double h, const double *J);
/* Takes c_k (n), k = 0, 1, 2, for the X at hand. */
void mstmm_phi_force(const mstmm_phi *phi, int k, const double *c);
/* phi_(k+1)(X) c_k (n), once c_k has been taken */
void mstmm_phi_part(const mstmm_phi *phi, int k, double *part);
/* w(theta) (n), once all three have been */
void mstmm_phi_at(const mstmm_phi *phi, double theta, double *w);

#endif
