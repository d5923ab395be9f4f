/* Several states at a time, one per lane of the widest vector.  Functions without vector
 * instructions call the C library lane by lane. */
#if defined __AVX512F__ && defined __AVX512DQ__
#define MSTMM_LANES 8
#elif defined __AVX__
#define MSTMM_LANES 4
#else
#define MSTMM_LANES 2
#endif
typedef double lanes_t __attribute__((vector_size(8 * MSTMM_LANES)));
typedef double lanes_array_t __attribute__((vector_size(8 * MSTMM_LANES), aligned(8), may_alias));
typedef long long mask_t __attribute__((vector_size(8 * MSTMM_LANES)));

#define lanes_all(number) ((number) - (lanes_t){0.0})

MSTMM_INLINE lanes_t lanes_select(mask_t truth, lanes_t a, lanes_t b)
{
    return (lanes_t)((truth & (mask_t)a) | (~truth & (mask_t)b));
}
MSTMM_INLINE lanes_t lanes_abs(lanes_t a) { return (lanes_t)((mask_t)a & 0x7fffffffffffffffLL); }
MSTMM_INLINE mask_t lanes_true(lanes_t a) { return lanes_abs(a) > lanes_all(0.0); }
MSTMM_INLINE mask_t lanes_not(mask_t truth) { return ~truth; }
MSTMM_INLINE lanes_t lanes_number(mask_t truth)
{
    return (lanes_t)(truth & (mask_t)lanes_all(1.0));
}
MSTMM_INLINE lanes_t lanes_min(lanes_t a, lanes_t b)
{
    return lanes_select((a < b) | (a != a), a, b);
}
MSTMM_INLINE lanes_t lanes_max(lanes_t a, lanes_t b)
{
    return lanes_select((a < b) | (b != b), b, a);
}
MSTMM_INLINE lanes_t lanes_sign(lanes_t a)
{
    const lanes_t minus = lanes_select(a < lanes_all(0.0), lanes_all(-1.0), a);
    return lanes_select(a > lanes_all(0.0), lanes_all(1.0), minus);
}
MSTMM_INLINE int lanes_every(mask_t truth)
{
    long long all = -1;
    for (int i = 0; i < MSTMM_LANES; i++) all &= truth[i];
    return all != 0;
}
MSTMM_INLINE lanes_t lanes_sqrt(lanes_t a)
{
    lanes_t root;
#if MSTMM_LANES == 8
    __asm__("vsqrtpd %1, %0" : "=v"(root) : "v"(a));
#elif MSTMM_LANES == 4
    __asm__("vsqrtpd %1, %0" : "=x"(root) : "x"(a));
#elif defined __SSE2__
    __asm__("sqrtpd %1, %0" : "=x"(root) : "x"(a));
#else
    for (int i = 0; i < MSTMM_LANES; i++) root[i] = sqrt(a[i]);
#endif
    return root;
}
/* Record the first failure of each lane. */
MSTMM_INLINE void lanes_fail(int *codes, mask_t truth, int code)
{
    for (int i = 0; i < MSTMM_LANES; i++)
        if (!truth[i] && codes[i] == 0) codes[i] = code;
}

/* Not inlined: the calls per lane dominate the cost. */
#define MSTMM_LANES_ONE(name)                                                                      \
    MSTMM_RARE void lanes_each_##name(lanes_t *a)                                                  \
    {                                                                                              \
        for (int i = 0; i < MSTMM_LANES; i++) (*a)[i] = name((*a)[i]);                             \
    }                                                                                              \
    MSTMM_INLINE lanes_t lanes_##name(lanes_t a)                                                   \
    {                                                                                              \
        lanes_each_##name(&a);                                                                     \
        return a;                                                                                  \
    }
#define MSTMM_LANES_TWO(name)                                                                      \
    MSTMM_RARE void lanes_each_##name(lanes_t *a, const lanes_t *b)                                \
    {                                                                                              \
        for (int i = 0; i < MSTMM_LANES; i++) (*a)[i] = name((*a)[i], (*b)[i]);                    \
    }                                                                                              \
    MSTMM_INLINE lanes_t lanes_##name(lanes_t a, lanes_t b)                                        \
    {                                                                                              \
        lanes_each_##name(&a, &b);                                                                 \
        return a;                                                                                  \
    }
MSTMM_LANES_ONE(floor) MSTMM_LANES_ONE(tan)
MSTMM_LANES_ONE(asin) MSTMM_LANES_ONE(acos) MSTMM_LANES_ONE(atan)
MSTMM_LANES_ONE(sinh) MSTMM_LANES_ONE(cosh) MSTMM_LANES_ONE(tanh)
MSTMM_LANES_ONE(exp) MSTMM_LANES_ONE(log)
MSTMM_LANES_TWO(pow) MSTMM_LANES_TWO(atan2)

MSTMM_INLINE int lanes_sincos_near(lanes_t x)
{
    return lanes_every((x >= lanes_all(-MSTMM_SINCOS_RANGE)) &
                       (x <= lanes_all(MSTMM_SINCOS_RANGE)));
}
MSTMM_SINCOS(lanes_t, mask_t, MSTMM_LANES, lanes_sincos)
