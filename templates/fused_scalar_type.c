/* Scalar arithmetic.  No headers are included, so that the text compiles quickly. */
#define MSTMM_PI MSTMM_LITERAL(3.14159265358979323846264338327950288419717)
#define MSTMM_INLINE static inline __attribute__((always_inline, unused))
#define MSTMM_RARE static __attribute__((noinline, cold, unused))
#define MSTMM_LIKELY(x) __builtin_expect(!!(x), 1)

#define MSTMM_ONE(name)                                                                            \
    real MSTMM_FUNCTION(name)(real);                                                               \
    MSTMM_INLINE real real_##name(real a) { return MSTMM_FUNCTION(name)(a); }
#define MSTMM_TWO(name)                                                                            \
    real MSTMM_FUNCTION(name)(real, real);                                                         \
    MSTMM_INLINE real real_##name(real a, real b) { return MSTMM_FUNCTION(name)(a, b); }

MSTMM_ONE(fabs) MSTMM_ONE(sqrt) MSTMM_ONE(floor)
MSTMM_ONE(sin) MSTMM_ONE(cos) MSTMM_ONE(tan)
MSTMM_ONE(asin) MSTMM_ONE(acos) MSTMM_ONE(atan)
MSTMM_ONE(sinh) MSTMM_ONE(cosh) MSTMM_ONE(tanh)
MSTMM_ONE(exp) MSTMM_ONE(log)
MSTMM_TWO(pow) MSTMM_TWO(atan2)

/* Minimum, maximum and sign propagate NaN; as a truth value NaN is neither true nor false. */
MSTMM_INLINE real real_abs(real a) { return real_fabs(a); }
MSTMM_INLINE real real_sign(real a) { return a > 0 ? 1 : (a < 0 ? -1 : a); }
MSTMM_INLINE real real_min(real a, real b) { return a < b || a != a ? a : b; }
MSTMM_INLINE real real_max(real a, real b) { return a < b || b != b ? b : a; }
MSTMM_INLINE int real_true(real a) { return real_fabs(a) > 0; }
MSTMM_INLINE int real_not(int truth) { return !truth; }
MSTMM_INLINE real real_number(int truth) { return (real)truth; }
MSTMM_INLINE real real_select(int truth, real a, real b) { return truth ? a : b; }
