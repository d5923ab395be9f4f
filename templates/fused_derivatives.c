/* Derivatives of states along directions, MSTMM_LANES directions of one state at a time.  The last
 * group repeats its last direction. */
typedef struct {
    double p[MSTMM_SOME(MSTMM_NP) * MSTMM_LANES], t[MSTMM_LANES];
    double q[MSTMM_SOME(MSTMM_NQ) * MSTMM_LANES], u[MSTMM_SOME(MSTMM_NU) * MSTMM_LANES];
    double memory[MSTMM_SOME(MSTMM_N_MEMORY) * MSTMM_LANES];
    double efforts[MSTMM_SOME(MSTMM_NU) * MSTMM_LANES];
} __attribute__((aligned(64))) mstmm_shared;

/* Copy a row to every lane. */
MSTMM_INLINE void mstmm_spread(double *lanes, const double *row, int width)
{
    for (int i = 0; i < width; i++)
        for (int k = 0; k < MSTMM_LANES; k++) lanes[i * MSTMM_LANES + k] = row[i];
}

MSTMM_INLINE void mstmm_share(mstmm_shared *to, const mstmm_columns_call *call, long long state)
{
    const double *row[6];
    for (int i = 0; i < 6; i++) row[i] = call->inputs[i] + state * call->strides[i];
    mstmm_spread(to->p, row[0], MSTMM_NP);
    mstmm_spread(to->t, row[1], 1);
    mstmm_spread(to->q, row[2], MSTMM_NQ);
    mstmm_spread(to->u, row[3], MSTMM_NU);
    mstmm_spread(to->memory, row[4], MSTMM_N_MEMORY);
    mstmm_spread(to->efforts, row[5], MSTMM_NU);
}

#define MSTMM_ARRAY(member) ((const lanes_array_t *)shared.member)

#define MSTMM_COLUMNS(name, IN, OUT)                                                               \
    static void one_##name(const mstmm_columns_call *call, long long state)                        \
    {                                                                                              \
        mstmm_shared shared;                                                                       \
        double in[MSTMM_SOME(IN) * MSTMM_LANES], out[MSTMM_SOME(OUT) * MSTMM_LANES];               \
        int codes[MSTMM_LANES];                                                                    \
        const long long n = call->n;                                                               \
        const double *directions = call->directions + state * call->direction_stride;              \
        double *result = call->result + state * n * (OUT);                                         \
        mstmm_share(&shared, call, state);                                                         \
        for (long long first = 0; first < n; first += MSTMM_LANES) {                               \
            const int count = n - first < MSTMM_LANES ? (int)(n - first) : MSTMM_LANES;            \
            for (int k = 0; k < MSTMM_LANES; k++)                                                  \
                for (int i = 0; i < (IN); i++)                                                     \
                    in[i * MSTMM_LANES + k] =                                                      \
                        directions[(first + (k < count ? k : count - 1)) * (IN) + i];              \
            lanes_##name(MSTMM_ARRAY(p), MSTMM_ARRAY(t), MSTMM_ARRAY(q), MSTMM_ARRAY(u),           \
                         MSTMM_ARRAY(memory), MSTMM_ARRAY(efforts), (const lanes_array_t *)in,     \
                         (lanes_array_t *)out, codes);                                             \
            for (int k = 0; k < count; k++)                                                        \
                for (int i = 0; i < (OUT); i++)                                                    \
                    result[(first + k) * (OUT) + i] = out[i * MSTMM_LANES + k];                    \
        }                                                                                          \
    }                                                                                              \
    static void columns_##name(const mstmm_columns_call *call)                                     \
    {                                                                                              \
        for (long long state = 0; state < call->states; state++) one_##name(call, state);          \
    }
