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
static int contains_zero(interval a) { return a.lo <= 0.0 && a.hi >= 0.0; }

static interval hull(interval a, interval b)
{
    return (interval){fmin(a.lo, b.lo), fmax(a.hi, b.hi)};
}

/* 0 times infinity is 0: what is zero everywhere stays so. */
static double scalar_product(double a, double b) { return a == 0.0 || b == 0.0 ? 0.0 : a * b; }

static interval product(interval a, interval b)
{
    const double ll = scalar_product(a.lo, b.lo), lh = scalar_product(a.lo, b.hi);
    const double hl = scalar_product(a.hi, b.lo), hh = scalar_product(a.hi, b.hi);
    return (interval){fmin(fmin(ll, lh), fmin(hl, hh)), fmax(fmax(ll, lh), fmax(hl, hh))};
}

static interval square(interval a)
{
    const double l = a.lo * a.lo, h = a.hi * a.hi;
    return (interval){contains_zero(a) ? 0.0 : fmin(l, h), fmax(l, h)};
}

static interval inverse(interval a)
{
    if (a.lo < 0.0 && a.hi > 0.0) return ANYTHING;
    if (a.lo == 0.0 && a.hi == 0.0) return ANYTHING;
    if (a.lo == 0.0) return (interval){1.0 / a.hi, INFINITY};
    if (a.hi == 0.0) return (interval){-INFINITY, 1.0 / a.lo};
    return (interval){1.0 / a.hi, 1.0 / a.lo};
}

static interval map_increasing(double (*f)(double), interval a)
{
    return (interval){f(a.lo), f(a.hi)};
}
static interval magnitude(interval a)
{
    const double l = fabs(a.lo), h = fabs(a.hi);
    return (interval){contains_zero(a) ? 0.0 : fmin(l, h), fmax(l, h)};
}

/* True if a contains a point first + 2 pi k. */
static int contains_turn(interval a, double first)
{
    return floor((a.hi - first) / (2.0 * PI)) != floor((a.lo - first) / (2.0 * PI));
}

static interval cosine(interval a)
{
    if (!(a.hi - a.lo < 2.0 * PI)) return (interval){-1.0, 1.0};
    const double l = cos(a.lo), h = cos(a.hi);
    return (interval){contains_turn(a, PI) ? -1.0 : fmin(l, h),
                      contains_turn(a, 0.0) ? 1.0 : fmax(l, h)};
}

static interval sine(interval a) { return cosine((interval){a.lo - 0.5 * PI, a.hi - 0.5 * PI}); }

static interval clip(interval a, double lo, double hi)
{
    return (interval){fmin(fmax(a.lo, lo), hi), fmax(fmin(a.hi, hi), lo)};
}

static interval interval_exponential(interval a) { return map_increasing(exp, a); }
static interval interval_logarithm(interval a)
{
    return map_increasing(log, (interval){fmax(a.lo, 0.0), fmax(a.hi, 0.0)});
}
static interval root(interval a)
{
    return map_increasing(sqrt, (interval){fmax(a.lo, 0.0), fmax(a.hi, 0.0)});
}

/* ---- operations: value from values, slope from both ---- */

typedef struct bounded {
    interval value, slope;
} bounded;

static bounded to_bounded(mstmm_bounds b)
{
    return (bounded){{b.lo, b.hi}, {b.slope_lo, b.slope_hi}};
}

static bounded chain_rule(interval value, interval derivative, bounded a)
{
    return (bounded){value, product(derivative, a.slope)};
}

static bounded multiply_bounded(bounded a, bounded b, int same)
{
    if (same) return chain_rule(square(a.value), product(point(2.0), a.value), a);
    return (bounded){product(a.value, b.value),
                     sum(product(a.slope, b.value), product(a.value, b.slope))};
}

static bounded divide_bounded(bounded a, bounded b)
{
    const interval by = inverse(b.value), value = product(a.value, by);
    const interval change = sum(a.slope, negative(product(value, b.slope)));
    return (bounded){value, product(change, by)};
}

static bounded power(bounded a, bounded b)
{
    const double n = b.value.lo;
    if (n == b.value.hi && n == floor(n) && fabs(n) < 1e9) { /* of a whole number any base */
        const interval s = magnitude(a.value);
        const int even = fmod(n, 2.0) == 0.0;
        if (contains_zero(a.value) && n < 0.0) return (bounded){ANYTHING, ANYTHING};
        const interval up = even ? (interval){pow(s.lo, n), pow(s.hi, n)}
                                 : (interval){pow(a.value.lo, n), pow(a.value.hi, n)};
        const interval less = {pow(s.lo, n - 1.0), pow(s.hi, n - 1.0)};
        const interval value = up.lo <= up.hi ? up : (interval){up.hi, up.lo};
        interval slope = hull(point(less.lo), point(less.hi));
        if (even && a.value.hi <= 0.0)
            slope = negative(slope);
        else if (even && a.value.lo < 0.0)
            slope = hull(slope, negative(slope));
        return chain_rule(value, product(point(n), slope), a);
    }
    const interval l = interval_logarithm(a.value),
                   value = interval_exponential(product(b.value, l));
    const interval part = product(b.value, product(a.slope, inverse(a.value)));
    const interval rate = sum(product(b.slope, l), part);
    return (bounded){value, product(value, rate)};
}

static bounded angle(bounded y, bounded x)
{
    const interval r = sum(square(x.value), square(y.value));
    const interval turn = sum(product(x.value, y.slope), negative(product(y.value, x.slope)));
    if (contains_zero(y.value) && x.value.lo <= 0.0) return (bounded){{-PI, PI}, ANYTHING};
    const double a = atan2(y.value.lo, x.value.lo), b = atan2(y.value.lo, x.value.hi);
    const double c = atan2(y.value.hi, x.value.lo), d = atan2(y.value.hi, x.value.hi);
    const interval value = {fmin(fmin(a, b), fmin(c, d)), fmax(fmax(a, b), fmax(c, d))};
    return (bounded){value, product(turn, inverse(r))};
}

static bounded stepped(double (*f)(double), interval a)
{
    const interval value = map_increasing(f, a);
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

static bounded opposite(bounded a) { return (bounded){negative(a.value), negative(a.slope)}; }

/* certainly 1, certainly 0, or undetermined */
static bounded truth(int surely, int never)
{
    const interval value = {surely ? 1.0 : 0.0, never ? 0.0 : 1.0};
    return (bounded){value, surely || never ? NOTHING : ANYTHING};
}

static bounded select_branch(interval condition, bounded a, bounded b)
{
    if (!contains_zero(condition)) return a;
    if (condition.lo == 0.0 && condition.hi == 0.0) return b;
    return (bounded){hull(a.value, b.value), ANYTHING};
}

static bounded apply_operation(int op, bounded a, bounded b, bounded c, int same)
{
    const interval one = point(1.0), x = a.value, y = b.value;
    interval v;
    switch (op) {
    case MSTMM_OP_NEG: return opposite(a);
    case MSTMM_OP_ADD: return (bounded){sum(x, y), sum(a.slope, b.slope)};
    case MSTMM_OP_SUB: return (bounded){sum(x, negative(y)), sum(a.slope, negative(b.slope))};
    case MSTMM_OP_MUL: return multiply_bounded(a, b, same);
    case MSTMM_OP_DIV: return divide_bounded(a, b);
    case MSTMM_OP_POW: return power(a, b);
    case MSTMM_OP_SQRT: return v = root(x), chain_rule(v, inverse(product(point(2.0), v)), a);
    case MSTMM_OP_SIN: return chain_rule(sine(x), cosine(x), a);
    case MSTMM_OP_COS: return chain_rule(cosine(x), negative(sine(x)), a);
    case MSTMM_OP_TAN:
        v = cosine(x);
        if (contains_zero(v) || !(x.hi - x.lo < PI)) return (bounded){ANYTHING, ANYTHING};
        return chain_rule(map_increasing(tan, x), inverse(square(v)), a);
    case MSTMM_OP_ASIN:
        v = clip(x, -1.0, 1.0);
        return chain_rule(map_increasing(asin, v), inverse(root(sum(one, negative(square(v))))), a);
    case MSTMM_OP_ACOS:
        v = clip(x, -1.0, 1.0);
        return opposite(chain_rule(sum(map_increasing(asin, v), point(-0.5 * PI)),
                                   inverse(root(sum(one, negative(square(v))))), a));
    case MSTMM_OP_ATAN: return chain_rule(map_increasing(atan, x), inverse(sum(one, square(x))), a);
    case MSTMM_OP_ATAN2: return angle(a, b);
    case MSTMM_OP_SINH:
        return chain_rule(map_increasing(sinh, x), map_increasing(cosh, magnitude(x)), a);
    case MSTMM_OP_COSH:
        return chain_rule(map_increasing(cosh, magnitude(x)), map_increasing(sinh, x), a);
    case MSTMM_OP_TANH:
        v = map_increasing(tanh, x);
        return chain_rule(v, sum(one, negative(square(v))), a);
    case MSTMM_OP_EXP: return v = interval_exponential(x), chain_rule(v, v, a);
    case MSTMM_OP_LOG: return chain_rule(interval_logarithm(x), inverse(clip(x, 0.0, INFINITY)), a);
    case MSTMM_OP_ABS:
        v = x.lo >= 0.0 ? one : x.hi <= 0.0 ? point(-1.0) : (interval){-1.0, 1.0};
        return chain_rule(magnitude(x), v, a);
    case MSTMM_OP_SIGN: return stepped(sign_of, x);
    case MSTMM_OP_FLOOR: return stepped(floor, x);
    case MSTMM_OP_MIN: return least(a, b);
    case MSTMM_OP_MAX: return opposite(least(opposite(a), opposite(b)));
    case MSTMM_OP_LT: return truth(x.hi < y.lo, x.lo >= y.hi);
    case MSTMM_OP_LE: return truth(x.hi <= y.lo, x.lo > y.hi);
    case MSTMM_OP_SELECT: return select_branch(x, b, c);
    default: return (bounded){ANYTHING, ANYTHING};
    }
}

/* nan becomes unbounded. */
static mstmm_bounds to_bounds(bounded b)
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
        slots[step[1]] = to_bounds(apply_operation(step[0], to_bounded(slots[step[2]]),
                                                   to_bounded(slots[step[3]]),
                                                   to_bounded(slots[step[4]]), step[2] == step[3]));
    const int *place = tape->outputs;
    for (int i = 0; i < tape->n_outputs; i++, place += MSTMM_TAPE_OUTPUT_WIDTH)
        outputs[place[1]] = slots[place[2]];
}
