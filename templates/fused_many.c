/* Many states, MSTMM_LANES at a time.  The last group is filled up with its last state, so that a
 * state's numbers depend neither on how many there are nor on where it stands among them. */
typedef struct {
    double p[MSTMM_SOME(MSTMM_NP) * MSTMM_LANES], t[MSTMM_LANES];
    double q[MSTMM_SOME(MSTMM_NQ) * MSTMM_LANES], u[MSTMM_SOME(MSTMM_NU) * MSTMM_LANES];
    double memory[MSTMM_SOME(MSTMM_N_MEMORY) * MSTMM_LANES];
    double efforts[MSTMM_SOME(MSTMM_NU) * MSTMM_LANES];
    double qdot[MSTMM_SOME(MSTMM_NQ) * MSTMM_LANES], udot[MSTMM_SOME(MSTMM_NU) * MSTMM_LANES];
} __attribute__((aligned(64))) mstmm_group;

/* Rows of `width` numbers -> lanes; lanes behind `count` repeat the last row.  The vector is put
 * together in a register: eight numbers stored one by one and loaded as one would have to wait. */
MSTMM_INLINE void mstmm_load(double *lanes, const double *rows, int width, long long stride,
                             int count)
{
    const double *row[MSTMM_LANES];
    for (int k = 0; k < MSTMM_LANES; k++) row[k] = rows + (k < count ? k : count - 1) * stride;
    for (int i = 0; i < width; i++)
#if MSTMM_LANES == 8
        ((lanes_array_t *)lanes)[i] = (lanes_t){row[0][i], row[1][i], row[2][i], row[3][i],
                                                row[4][i], row[5][i], row[6][i], row[7][i]};
#elif MSTMM_LANES == 4
        ((lanes_array_t *)lanes)[i] = (lanes_t){row[0][i], row[1][i], row[2][i], row[3][i]};
#else
        ((lanes_array_t *)lanes)[i] = (lanes_t){row[0][i], row[1][i]};
#endif
}

/* Lanes -> rows; the numbers of lanes behind `count` are left out. */
MSTMM_INLINE void mstmm_keep(double *rows, const double *lanes, int width, int count)
{
    for (int k = 0; k < count; k++)
        for (int i = 0; i < width; i++) rows[k * width + i] = lanes[i * MSTMM_LANES + k];
}

static long long mstmm_accelerations_many(const mstmm_batch *batch)
{
    mstmm_group g;
    long long failed = 0;
    mstmm_load(g.p, batch->p, MSTMM_NP, 0, 1);
    mstmm_load(g.t, batch->t, 1, 0, 1);
    if (MSTMM_N_MEMORY) mstmm_load(g.memory, batch->memory, MSTMM_N_MEMORY, 0, 1);
    for (int i = 0; i < MSTMM_NU * MSTMM_LANES; i++) g.efforts[i] = 0.0;
    if (batch->efforts) mstmm_load(g.efforts, batch->efforts, MSTMM_NU, 0, 1);
    for (long long first = 0; first < batch->n; first += MSTMM_LANES) {
        const long long left = batch->n - first;
        const int count = left < MSTMM_LANES ? (int)left : MSTMM_LANES;
        int codes[MSTMM_LANES];
        if (batch->p_stride)
            mstmm_load(g.p, batch->p + first * batch->p_stride, MSTMM_NP, batch->p_stride, count);
        if (batch->t_stride)
            mstmm_load(g.t, batch->t + first * batch->t_stride, 1, batch->t_stride, count);
        if (MSTMM_N_MEMORY && batch->memory_stride)
            mstmm_load(g.memory, batch->memory + first * batch->memory_stride, MSTMM_N_MEMORY,
                       batch->memory_stride, count);
        if (batch->efforts && batch->efforts_stride)
            mstmm_load(g.efforts, batch->efforts + first * batch->efforts_stride, MSTMM_NU,
                       batch->efforts_stride, count);
        mstmm_load(g.q, batch->q + first * MSTMM_NQ, MSTMM_NQ, MSTMM_NQ, count);
        mstmm_load(g.u, batch->u + first * MSTMM_NU, MSTMM_NU, MSTMM_NU, count);
        mstmm_accelerations_lanes(g.p, g.t, g.q, g.u, g.memory, g.efforts, g.qdot, g.udot, codes);
        if (batch->qdot) mstmm_keep(batch->qdot + first * MSTMM_NQ, g.qdot, MSTMM_NQ, count);
        mstmm_keep(batch->udot + first * MSTMM_NU, g.udot, MSTMM_NU, count);
        for (int k = 0; k < count; k++) {
            batch->codes[first + k] = codes[k];
            failed += codes[k] != 0;
        }
    }
    return failed;
}
