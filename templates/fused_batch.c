/* Many states, MSTMM_LANES at a time.  The last group repeats its last state, so that the result of
 * a state depends neither on the number of states nor on its position among them. */
typedef struct {
    lanes_t p[MSTMM_SOME(MSTMM_NP)], t[1], q[MSTMM_SOME(MSTMM_NQ)], u[MSTMM_SOME(MSTMM_NU)];
    lanes_t memory[MSTMM_SOME(MSTMM_N_MEMORY)], efforts[MSTMM_SOME(MSTMM_NU)];
    lanes_t qdot[MSTMM_SOME(MSTMM_NQ)], udot[MSTMM_SOME(MSTMM_NU)];
} mstmm_group;

#if defined __clang__ || __GNUC__ >= 12
#define MSTMM_MIX(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define MSTMM_MIX(a, b, ...) __builtin_shuffle(a, b, (mask_t){__VA_ARGS__})
#endif
#define MSTMM_CROSS(a, b, low, high)                                                               \
    do {                                                                                           \
        const lanes_t kept = MSTMM_MIX(a, b, low);                                                 \
        b = MSTMM_MIX(a, b, high);                                                                 \
        a = kept;                                                                                  \
    } while (0)
#define MSTMM_LIST(...) __VA_ARGS__

/* Transpose a square block in registers. */
MSTMM_INLINE void mstmm_turn(lanes_t *v)
{
#if MSTMM_LANES == 8
#define MSTMM_ONES(i) MSTMM_CROSS(v[i], v[i + 1], MSTMM_LIST(0, 8, 2, 10, 4, 12, 6, 14), \
                                  MSTMM_LIST(1, 9, 3, 11, 5, 13, 7, 15))
#define MSTMM_TWOS(i) MSTMM_CROSS(v[i], v[i + 2], MSTMM_LIST(0, 1, 8, 9, 4, 5, 12, 13), \
                                  MSTMM_LIST(2, 3, 10, 11, 6, 7, 14, 15))
#define MSTMM_FOURS(i) MSTMM_CROSS(v[i], v[i + 4], MSTMM_LIST(0, 1, 2, 3, 8, 9, 10, 11), \
                                   MSTMM_LIST(4, 5, 6, 7, 12, 13, 14, 15))
    MSTMM_ONES(0); MSTMM_ONES(2); MSTMM_ONES(4); MSTMM_ONES(6);
    MSTMM_TWOS(0); MSTMM_TWOS(1); MSTMM_TWOS(4); MSTMM_TWOS(5);
    MSTMM_FOURS(0); MSTMM_FOURS(1); MSTMM_FOURS(2); MSTMM_FOURS(3);
#elif MSTMM_LANES == 4
#define MSTMM_ONES(i) MSTMM_CROSS(v[i], v[i + 1], MSTMM_LIST(0, 4, 2, 6), MSTMM_LIST(1, 5, 3, 7))
#define MSTMM_TWOS(i) MSTMM_CROSS(v[i], v[i + 2], MSTMM_LIST(0, 1, 4, 5), MSTMM_LIST(2, 3, 6, 7))
    MSTMM_ONES(0); MSTMM_ONES(2);
    MSTMM_TWOS(0); MSTMM_TWOS(1);
#else
    MSTMM_CROSS(v[0], v[1], MSTMM_LIST(0, 2), MSTMM_LIST(1, 3));
#endif
}

/* Whether rows can be copied as whole vectors.  A vector longer than a row overlaps the next row,
 * which must exist, and on output must be written later. */
MSTMM_INLINE int mstmm_roomy(int width, long long stride, long long left)
{
    return left >= MSTMM_LANES && (width >= MSTMM_LANES ||
                                   (left - MSTMM_LANES) * stride >= MSTMM_LANES - width);
}

/* First column of the block at i; the last block of a long row overlaps the previous one. */
MSTMM_INLINE int mstmm_block(int i, int width)
{
    return width >= MSTMM_LANES && i + MSTMM_LANES > width ? width - MSTMM_LANES : i;
}

/* Load rows of `width` numbers into lanes; `left` states remain, and lanes without a state repeat
 * the last row. */
MSTMM_INLINE void mstmm_load(lanes_t *lanes, const double *rows, int width, long long stride,
                             long long left)
{
    if (mstmm_roomy(width, stride, left)) {
        for (int i = 0; i < width; i += MSTMM_LANES) {
            const int from = mstmm_block(i, width);
            lanes_t v[MSTMM_LANES];
#pragma GCC unroll 8
            for (int k = 0; k < MSTMM_LANES; k++)
                v[k] = *(const lanes_array_t *)(rows + k * stride + from);
            mstmm_turn(v);
#pragma GCC unroll 8
            for (int k = 0; k < MSTMM_LANES; k++)
                if (from + k < width) lanes[from + k] = v[k];
        }
        return;
    }
    for (int i = 0; i < width; i++)
        for (int k = 0; k < MSTMM_LANES; k++)
            lanes[i][k] = rows[(k < left ? k : left - 1) * stride + i];
}

/* Store the lanes that have a state as rows. */
MSTMM_INLINE void mstmm_keep(double *rows, const lanes_t *lanes, int width, long long left)
{
    if (mstmm_roomy(width, width, left)) {
        for (int i = 0; i < width; i += MSTMM_LANES) {
            const int from = mstmm_block(i, width);
            lanes_t v[MSTMM_LANES];
#pragma GCC unroll 8
            for (int k = 0; k < MSTMM_LANES; k++) v[k] = lanes[from + k < width ? from + k : from];
            mstmm_turn(v);
#pragma GCC unroll 8
            for (int k = 0; k < MSTMM_LANES; k++)
                *(lanes_array_t *)(rows + k * width + from) = v[k];
        }
        return;
    }
    for (int k = 0; k < MSTMM_LANES && k < left; k++)
        for (int i = 0; i < width; i++) rows[k * width + i] = lanes[i][k];
}

static long long mstmm_accelerations_many(const mstmm_batch *batch)
{
    mstmm_group g;
    long long failed = 0;
    mstmm_load(g.p, batch->p, MSTMM_NP, 0, 1);
    mstmm_load(g.t, batch->t, 1, 0, 1);
    if (MSTMM_N_MEMORY) mstmm_load(g.memory, batch->memory, MSTMM_N_MEMORY, 0, 1);
    for (int i = 0; i < MSTMM_NU; i++) g.efforts[i] = lanes_all(0.0);
    if (batch->efforts) mstmm_load(g.efforts, batch->efforts, MSTMM_NU, 0, 1);
    for (long long first = 0; first < batch->n; first += MSTMM_LANES) {
        const long long left = batch->n - first;
        int codes[MSTMM_LANES];
        if (batch->p_stride)
            mstmm_load(g.p, batch->p + first * batch->p_stride, MSTMM_NP, batch->p_stride, left);
        if (batch->t_stride)
            mstmm_load(g.t, batch->t + first * batch->t_stride, 1, batch->t_stride, left);
        if (MSTMM_N_MEMORY && batch->memory_stride)
            mstmm_load(g.memory, batch->memory + first * batch->memory_stride, MSTMM_N_MEMORY,
                       batch->memory_stride, left);
        if (batch->efforts && batch->efforts_stride)
            mstmm_load(g.efforts, batch->efforts + first * batch->efforts_stride, MSTMM_NU,
                       batch->efforts_stride, left);
        mstmm_load(g.q, batch->q + first * MSTMM_NQ, MSTMM_NQ, MSTMM_NQ, left);
        mstmm_load(g.u, batch->u + first * MSTMM_NU, MSTMM_NU, MSTMM_NU, left);
        lanes_accelerations(g.p, g.t, g.q, g.u, g.memory, g.efforts, g.qdot, g.udot, codes);
        if (batch->qdot) mstmm_keep(batch->qdot + first * MSTMM_NQ, g.qdot, MSTMM_NQ, left);
        mstmm_keep(batch->udot + first * MSTMM_NU, g.udot, MSTMM_NU, left);
        for (int k = 0; k < MSTMM_LANES && k < left; k++) {
            batch->codes[first + k] = codes[k];
            failed += codes[k] != 0;
        }
    }
    return failed;
}
