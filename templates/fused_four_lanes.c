/* Four sines and cosines at a time, for the kernel of one state. */
typedef double four_t __attribute__((vector_size(32)));
typedef long long four_bits_t __attribute__((vector_size(32)));

/* Whether every element is within the range of the polynomials; false for NaN. */
MSTMM_INLINE int four_sincos_near(four_t x)
{
    const four_bits_t near = (x >= -MSTMM_SINCOS_RANGE) & (x <= MSTMM_SINCOS_RANGE);
#ifdef __AVX__
    return __builtin_ia32_movmskpd256((four_t)near) == 15;
#else
    return (near[0] & near[1] & near[2] & near[3]) != 0;
#endif
}
MSTMM_SINCOS(four_t, four_bits_t, 4, four_sincos)
