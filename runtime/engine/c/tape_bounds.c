/* Interval arithmetic on values and slopes.  R. E. Moore, Interval Analysis, Prentice-Hall (1966). */
#include "tape_bounds.h"

#include <math.h>

typedef struct interval {
    double lo, hi;
} interval;

static const double PI = 3.14159265358979323846;
static const interval ANYTHING = {-INFINITY, INFINITY}, NOTHING = {0.0, 0.0};

/* ---- intervals ---- */

static interval point(double x) { return (interval){x, x}; }
static interval negative(interval a) { return (interval){-a.hi, -a.lo}; }
static interval sum(interval a, interval b) { return (interval){a.lo + b.lo, a.hi + b.hi}; }
static int holds_zero(interval a) { return a.lo <= 0.0 && a.hi >= 0.0; }

static interval hull(interval a, interval b)
{
    return (interval){fmin(a.lo, b.lo), fmax(a.hi, b.hi)};
}

/* 0 times infinity is 0: what is zero everywhere stays so. */
static double times(double a, double b) { return a == 0.0 || b == 0.0 ? 0.0 : a * b; }

static interval product(interval a, interval b)
{
    const double ll = times(a.lo, b.lo), lh = times(a.lo, b.hi);
    const double hl = times(a.hi, b.lo), hh = times(a.hi, b.hi);
    return (interval){fmin(fmin(ll, lh), fmin(hl, hh)), fmax(fmax(ll, lh), fmax(hl, hh))};
}

static interval square(interval a)
{
    const double l = a.lo * a.lo, h = a.hi * a.hi;
    return (interval){holds_zero(a) ? 0.0 : fmin(l, h), fmax(l, h)};
}

static interval inverse(interval a)
{
    if (a.lo < 0.0 && a.hi > 0.0) return ANYTHING;
    if (a.lo == 0.0 && a.hi == 0.0) return ANYTHING;
    if (a.lo == 0.0) return (interval){1.0 / a.hi, INFINITY};
    if (a.hi == 0.0) return (interval){-INFINITY, 1.0 / a.lo};
    return (interval){1.0 / a.hi, 1.0 / a.lo};
}

static interval rising(double (*f)(double), interval a) { return (interval){f(a.lo), f(a.hi)}; }
static interval size_of(interval a)
{
    const double l = fabs(a.lo), h = fabs(a.hi);
    return (interval){holds_zero(a) ? 0.0 : fmin(l, h), fmax(l, h)};
}

/* True if a contains a point first + 2 pi k. */
static int turns(interval a, double first)
{
    return floor((a.hi - first) / (2.0 * PI)) != floor((a.lo - first) / (2.0 * PI));
}

static interval cosine(interval a)
{
    if (!(a.hi - a.lo < 2.0 * PI)) return (interval){-1.0, 1.0};
    const double l = cos(a.lo), h = cos(a.hi);
    return (interval){turns(a, PI) ? -1.0 : fmin(l, h), turns(a, 0.0) ? 1.0 : fmax(l, h)};
}

static interval sine(interval a)
{
    return cosine((interval){a.lo - 0.5 * PI, a.hi - 0.5 * PI});
}

static interval within(interval a, double lo, double hi)
{
    return (interval){fmin(fmax(a.lo, lo), hi), fmax(fmin(a.hi, hi), lo)};
}

static interval exponential(interval a) { return rising(exp, a); }
static interval logarithm(interval a)
{
    return rising(log, (interval){fmax(a.lo, 0.0), fmax(a.hi, 0.0)});
}
static interval root(interval a)
{
    return rising(sqrt, (interval){fmax(a.lo, 0.0), fmax(a.hi, 0.0)});
}

/* ---- operations: value from values, slope from both ---- */

typedef struct bounded {
    interval value, slope;
} bounded;

static bounded of(mstmm_bounds b)
{
    return (bounded){{b.lo, b.hi}, {b.slope_lo, b.slope_hi}};
}

static bounded chained(interval value, interval derivative, bounded a)
{
    return (bounded){value, product(derivative, a.slope)};
}

static bounded multiplied(bounded a, bounded b, int same)
{
    if (same) return chained(square(a.value), product(point(2.0), a.value), a);
    return (bounded){product(a.value, b.value),
                     sum(product(a.slope, b.value), product(a.value, b.slope))};
}

static bounded divided(bounded a, bounded b)
{
    const interval by = inverse(b.value), value = product(a.value, by);
    const interval change = sum(a.slope, negative(product(value, b.slope)));
    return (bounded){value, product(change, by)};
}

static bounded power(bounded a, bounded b)
{
    const double n = b.value.lo;
    if (n == b.value.hi && n == floor(n) && fabs(n) < 1e9) { /* of a whole number any base */
        const interval s = size_of(a.value);
        const int even = fmod(n, 2.0) == 0.0;
        if (holds_zero(a.value) && n < 0.0) return (bounded){ANYTHING, ANYTHING};
        const interval up = even ? (interval){pow(s.lo, n), pow(s.hi, n)}
                                 : (interval){pow(a.value.lo, n), pow(a.value.hi, n)};
        const interval less = {pow(s.lo, n - 1.0), pow(s.hi, n - 1.0)};
        const interval value = up.lo <= up.hi ? up : (interval){up.hi, up.lo};
        interval slope = hull(point(less.lo), point(less.hi));
        if (even && a.value.hi <= 0.0) slope = negative(slope);
        else if (even && a.value.lo < 0.0) slope = hull(slope, negative(slope));
        return chained(value, product(point(n), slope), a);
    }
    const interval l = logarithm(a.value), value = exponential(product(b.value, l));
    const interval part = product(b.value, product(a.slope, inverse(a.value)));
    const interval rate = sum(product(b.slope, l), part);
    return (bounded){value, product(value, rate)};
}

static bounded angle(bounded y, bounded x)
{
    const interval r = sum(square(x.value), square(y.value));
    const interval turn = sum(product(x.value, y.slope), negative(product(y.value, x.slope)));
    if (holds_zero(y.value) && x.value.lo <= 0.0) return (bounded){{-PI, PI}, ANYTHING};
    const double a = atan2(y.value.lo, x.value.lo), b = atan2(y.value.lo, x.value.hi);
    const double c = atan2(y.value.hi, x.value.lo), d = atan2(y.value.hi, x.value.hi);
    const interval value = {fmin(fmin(a, b), fmin(c, d)), fmax(fmax(a, b), fmax(c, d))};
    return (bounded){value, product(turn, inverse(r))};
}

static bounded stepped(double (*f)(double), interval a)
{
    const interval value = rising(f, a);
    return (bounded){value, value.lo == value.hi ? NOTHING : ANYTHING};
}

static double sign_of(double x) { return (x > 0.0) - (x < 0.0); }

static bounded least(bounded a, bounded b)
{
    if (a.value.hi <= b.value.lo) return a;
    if (b.value.hi <= a.value.lo) return b;
    return (bounded){{fmin(a.value.lo, b.value.lo), fmin(a.value.hi, b.value.hi)},
                     hull(a.slope, b.slope)};
}

static bounded opposite(bounded a)
{
    return (bounded){negative(a.value), negative(a.slope)};
}

/* certainly 1, certainly 0, or undetermined */
static bounded truth(int surely, int never)
{
    const interval value = {surely ? 1.0 : 0.0, never ? 0.0 : 1.0};
    return (bounded){value, surely || never ? NOTHING : ANYTHING};
}

static bounded chosen(interval condition, bounded a, bounded b)
{
    if (!holds_zero(condition)) return a;
    if (condition.lo == 0.0 && condition.hi == 0.0) return b;
    return (bounded){hull(a.value, b.value), ANYTHING};
}

static bounded result(int op, bounded a, bounded b, bounded c, int same)
{
    const interval one = point(1.0), x = a.value, y = b.value;
    interval v;
    switch (op) {
    case MSTMM_OP_NEG: return opposite(a);
    case MSTMM_OP_ADD: return (bounded){sum(x, y), sum(a.slope, b.slope)};
    case MSTMM_OP_SUB: return (bounded){sum(x, negative(y)), sum(a.slope, negative(b.slope))};
    case MSTMM_OP_MUL: return multiplied(a, b, same);
    case MSTMM_OP_DIV: return divided(a, b);
    case MSTMM_OP_POW: return power(a, b);
    case MSTMM_OP_SQRT: return v = root(x), chained(v, inverse(product(point(2.0), v)), a);
    case MSTMM_OP_SIN: return chained(sine(x), cosine(x), a);
    case MSTMM_OP_COS: return chained(cosine(x), negative(sine(x)), a);
    case MSTMM_OP_TAN:
        v = cosine(x);
        if (holds_zero(v) || !(x.hi - x.lo < PI)) return (bounded){ANYTHING, ANYTHING};
        return chained(rising(tan, x), inverse(square(v)), a);
    case MSTMM_OP_ASIN:
        v = within(x, -1.0, 1.0);
        return chained(rising(asin, v), inverse(root(sum(one, negative(square(v))))), a);
    case MSTMM_OP_ACOS:
        v = within(x, -1.0, 1.0);
        return opposite(chained(sum(rising(asin, v), point(-0.5 * PI)),
                                inverse(root(sum(one, negative(square(v))))), a));
    case MSTMM_OP_ATAN: return chained(rising(atan, x), inverse(sum(one, square(x))), a);
    case MSTMM_OP_ATAN2: return angle(a, b);
    case MSTMM_OP_SINH: return chained(rising(sinh, x), rising(cosh, size_of(x)), a);
    case MSTMM_OP_COSH: return chained(rising(cosh, size_of(x)), rising(sinh, x), a);
    case MSTMM_OP_TANH:
        v = rising(tanh, x);
        return chained(v, sum(one, negative(square(v))), a);
    case MSTMM_OP_EXP: return v = exponential(x), chained(v, v, a);
    case MSTMM_OP_LOG: return chained(logarithm(x), inverse(within(x, 0.0, INFINITY)), a);
    case MSTMM_OP_ABS:
        v = x.lo >= 0.0 ? one : x.hi <= 0.0 ? point(-1.0) : (interval){-1.0, 1.0};
        return chained(size_of(x), v, a);
    case MSTMM_OP_SIGN: return stepped(sign_of, x);
    case MSTMM_OP_FLOOR: return stepped(floor, x);
    case MSTMM_OP_MIN: return least(a, b);
    case MSTMM_OP_MAX: return opposite(least(opposite(a), opposite(b)));
    case MSTMM_OP_LT: return truth(x.hi < y.lo, x.lo >= y.hi);
    case MSTMM_OP_LE: return truth(x.hi <= y.lo, x.lo > y.hi);
    case MSTMM_OP_SELECT: return chosen(x, b, c);
    default: return (bounded){ANYTHING, ANYTHING};
    }
}

/* nan becomes unbounded. */
static mstmm_bounds written(bounded b)
{
    if (isnan(b.value.lo) || isnan(b.value.hi)) b.value = ANYTHING;
    if (isnan(b.slope.lo) || isnan(b.slope.hi)) b.slope = ANYTHING;
    return (mstmm_bounds){b.value.lo, b.value.hi, b.slope.lo, b.slope.hi};
}

void mstmm_tape_bounds(const mstmm_tape *tape, mstmm_bounds *slots, mstmm_bounds *outputs)
{
    int slot = 0;
    for (int i = 0; i < tape->n_inputs; i++) slot += tape->input_lengths[i];
    for (int i = 0; i < tape->n_constants; i++, slot++)
        slots[slot] = (mstmm_bounds){tape->constants[i], tape->constants[i], 0.0, 0.0};
    const int *step = tape->instructions;
    for (int i = 0; i < tape->n_instructions; i++, step += MSTMM_TAPE_WIDTH)
        slots[step[1]] = written(result(step[0], of(slots[step[2]]), of(slots[step[3]]),
                                        of(slots[step[4]]), step[2] == step[3]));
    const int *place = tape->outputs;
    for (int i = 0; i < tape->n_outputs; i++, place += MSTMM_TAPE_OUTPUT_WIDTH)
        outputs[place[1]] = slots[place[2]];
}
