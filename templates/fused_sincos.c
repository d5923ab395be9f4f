/* Sine and cosine of a vector of arguments.
 *
 * x = k pi/2 + r: k pi/2 is subtracted in two parts; the first has 42 bits, so that its
 * product with k is exact up to |k| = 2047 with or without fused multiply-add.  On |r| <= pi/4
 * the polynomials are Chebyshev fits of (sin r / r - 1) / r^2 and (cos r - 1 + r^2 / 2) / r^4 in
 * r^2, of relative error below 1e-18.  The quadrant is read from the last bits of
 * x 2/pi + 1.5 2^52.  Beyond MSTMM_SINCOS_RANGE, and for NaN, the C library is called element by
 * element.  Do not compile with -ffast-math. */
#define MSTMM_SINCOS_RANGE 1200.0

#define MSTMM_SINCOS(vector_t, bits_t, width, name)                                                \
    typedef struct {                                                                               \
        vector_t sine, cosine;                                                                     \
    } name##_t;                                                                                    \
    MSTMM_RARE void name##_far(const vector_t *x, name##_t *pair)                                  \
    {                                                                                              \
        for (int i = 0; i < width; i++) {                                                          \
            const double one = (*x)[i];                                                            \
            if (one >= -MSTMM_SINCOS_RANGE && one <= MSTMM_SINCOS_RANGE) continue;                 \
            pair->sine[i] = sin(one);                                                              \
            pair->cosine[i] = cos(one);                                                            \
        }                                                                                          \
    }                                                                                              \
    MSTMM_INLINE name##_t name(vector_t x)                                                         \
    {                                                                                              \
        const vector_t shifted = x * 0x1.45f306dc9c883p-1 + 0x1.8p52;                              \
        const bits_t quadrant = (bits_t)shifted;                                                   \
        const vector_t k = shifted - 0x1.8p52;                                                     \
        const vector_t r = (x - k * 0x1.921fb54442800p+0) - k * 0x1.4611a62633146p-42;             \
        const vector_t z = r * r, zz = z * z;                                                      \
        const vector_t odd =                                                                       \
            (-0.16666666666666666 + z * 0.008333333333330936) +                                    \
            zz * ((-0.00019841269836740527 + z * 2.7557316093196066e-06) +                         \
                  zz * (-2.5051129895962807e-08 + z * 1.5917988944318716e-10));                    \
        const vector_t even =                                                                      \
            (0.041666666666666664 + z * -0.0013888888888887389) +                                  \
            zz * ((2.48015872987544e-05 + z * -2.7557317265876615e-07) +                           \
                  zz * (2.087614504910828e-09 + z * -1.1382544623404291e-11));                     \
        const bits_t sine = (bits_t)(r + (r * z) * odd);                                           \
        const bits_t cosine = (bits_t)(1.0 - z * (0.5 - z * even));                                \
        const bits_t swapped = -(quadrant & 1);                                                    \
        const bits_t minus_sine = (quadrant & 2) << 62;                                            \
        const bits_t minus_cosine = ((quadrant + 1) & 2) << 62;                                    \
        name##_t pair;                                                                             \
        pair.sine = (vector_t)(((swapped & cosine) | (~swapped & sine)) ^ minus_sine);             \
        pair.cosine = (vector_t)(((swapped & sine) | (~swapped & cosine)) ^ minus_cosine);         \
        if (!MSTMM_LIKELY(name##_near(x))) {                                                       \
            const vector_t far = x;                                                                \
            name##_t other = pair;                                                                 \
            name##_far(&far, &other);                                                              \
            pair = other;                                                                          \
        }                                                                                          \
        return pair;                                                                               \
    }
