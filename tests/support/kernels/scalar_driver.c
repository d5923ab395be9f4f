/* Behind the text of a kernel in any real type: calls with doubles, and reference motions.
 *
 * Outputs come back as two doubles, high + low, which together hold all of a quadruple.  CALL is
 * the kernel with arrays of `real`; N_IN, N_OUT count its ports, IN_LENGTHS and OUT_LENGTHS say how
 * long they are, LENGTH is the longest. */
static const int in_lengths[] = {IN_LENGTHS}, out_lengths[] = {OUT_LENGTHS};

int scalar_call(const double *const *inputs, double *const *high, double *const *low);
int scalar_motion(const double *const *inputs, double t_end, int steps, int columns, double *high,
                  double *low);

static void split(const real *values, int length, double *high, double *low)
{
    for (int i = 0; i < length; i++) {
        high[i] = (double)values[i];
        low[i] = (double)(values[i] - (real)high[i]);
    }
}

int scalar_call(const double *const *inputs, double *const *high, double *const *low)
{
    static real in[N_IN][LENGTH], out[N_OUT][LENGTH];
    for (int k = 0; k < N_IN; k++)
        for (int i = 0; i < in_lengths[k]; i++) in[k][i] = (real)inputs[k][i];
    const int code = CALL(in, out);
    for (int k = 0; k < N_OUT; k++) split(out[k], out_lengths[k], high[k], low[k]);
    return code;
}

#if N_IN == 6 && N_OUT == 2 /* p, t, q, u, memory, efforts -> qdot, udot */
#define NQ (out_lengths[0])
#define NU (out_lengths[1])

static real state[N_IN][LENGTH];

static int rates(real t, const real *y, real *dy)
{
    static real out[N_OUT][LENGTH];
    state[1][0] = t;
    for (int i = 0; i < NQ; i++) state[2][i] = y[i];
    for (int i = 0; i < NU; i++) state[3][i] = y[NQ + i];
    const int code = CALL(state, out);
    for (int i = 0; i < NQ; i++) dy[i] = out[0][i];
    for (int i = 0; i < NU; i++) dy[NQ + i] = out[1][i];
    return code;
}

/* Gragg's midpoint rule with n substeps of one step of length `step`. */
static int midpoint(real t, const real *y, real step, int n, int length, real *result)
{
    static real before[2 * LENGTH], now[2 * LENGTH], dy[2 * LENGTH];
    const real h = step / n;
    int code = rates(t, y, dy);
    for (int i = 0; i < length; i++) before[i] = y[i], now[i] = y[i] + h * dy[i];
    for (int k = 1; k < n && !code; k++) {
        code = rates(t + k * h, now, dy);
        for (int i = 0; i < length; i++) {
            const real next = before[i] + 2 * h * dy[i];
            before[i] = now[i], now[i] = next;
        }
    }
    for (int i = 0; i < length; i++) result[i] = now[i];
    return code;
}

/* Extrapolation in h^2 over 2, 4, ..., 2 columns substeps (Bulirsch and Stoer): order 2 columns. */
int scalar_motion(const double *const *inputs, double t_end, int steps, int columns, double *high,
                  double *low)
{
    static real y[2 * LENGTH], table[16][2 * LENGTH];
    const int length = NQ + NU;
    int code = columns > 16 ? -1 : 0;
    for (int k = 0; k < N_IN; k++)
        for (int i = 0; i < in_lengths[k]; i++) state[k][i] = (real)inputs[k][i];
    for (int i = 0; i < NQ; i++) y[i] = state[2][i];
    for (int i = 0; i < NU; i++) y[NQ + i] = state[3][i];
    const real start = state[1][0], step = ((real)t_end - start) / steps;
    for (int n = 0; n < steps && !code; n++) {
        for (int j = 0; j < columns && !code; j++) {
            code = midpoint(start + n * step, y, step, 2 * (j + 1), length, table[j]);
            for (int m = j - 1; m >= 0; m--) {
                const real ratio = (real)(j + 1) / (m + 1);
                for (int i = 0; i < length; i++)
                    table[m][i] =
                        table[m + 1][i] + (table[m + 1][i] - table[m][i]) / (ratio * ratio - 1);
            }
        }
        for (int i = 0; i < length; i++) y[i] = table[0][i];
    }
    split(y, length, high, low);
    return code;
}
#endif
