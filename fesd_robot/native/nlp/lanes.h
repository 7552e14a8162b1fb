/* Arithmetic on LANES numbers at once, every one rounded as it would be alone. */
#ifndef FESD_LANES_H
#define FESD_LANES_H

#include <math.h>

#define LANES 4
typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));

#define ALL(c) ((lanes){(c), (c), (c), (c)})

/* What the compiler has no vector operator for goes lane by lane through the C library. */
#define ONE_BY_ONE(name, value)                           \
    __attribute__((unused)) static lanes name(lanes x)    \
    {                                                     \
        for (int lane = 0; lane < LANES; ++lane) {        \
            const double a = x[lane];                     \
            x[lane] = (value);                            \
        }                                                 \
        return x;                                         \
    }
#define TWO_BY_TWO(name, value)                                  \
    __attribute__((unused)) static lanes name(lanes x, lanes y)  \
    {                                                            \
        for (int lane = 0; lane < LANES; ++lane) {               \
            const double a = x[lane], b = y[lane];               \
            x[lane] = (value);                                   \
        }                                                        \
        return x;                                                \
    }

ONE_BY_ONE(lanes_exp, exp(a))
ONE_BY_ONE(lanes_log, log(a))
ONE_BY_ONE(lanes_sqrt, sqrt(a))
ONE_BY_ONE(lanes_sin, sin(a))
ONE_BY_ONE(lanes_cos, cos(a))
ONE_BY_ONE(lanes_tan, tan(a))
ONE_BY_ONE(lanes_asin, asin(a))
ONE_BY_ONE(lanes_acos, acos(a))
ONE_BY_ONE(lanes_atan, atan(a))
ONE_BY_ONE(lanes_sinh, sinh(a))
ONE_BY_ONE(lanes_cosh, cosh(a))
ONE_BY_ONE(lanes_tanh, tanh(a))
ONE_BY_ONE(lanes_asinh, asinh(a))
ONE_BY_ONE(lanes_acosh, acosh(a))
ONE_BY_ONE(lanes_atanh, atanh(a))
ONE_BY_ONE(lanes_log1p, log1p(a))
ONE_BY_ONE(lanes_expm1, expm1(a))
ONE_BY_ONE(lanes_erf, erf(a))
ONE_BY_ONE(lanes_fabs, fabs(a))
ONE_BY_ONE(lanes_floor, floor(a))
ONE_BY_ONE(lanes_ceil, ceil(a))
ONE_BY_ONE(lanes_sign, a < 0 ? -1.0 : a > 0 ? 1.0 : a)
ONE_BY_ONE(lanes_not, !a)
TWO_BY_TWO(lanes_pow, pow(a, b))
TWO_BY_TWO(lanes_lt, a < b)
TWO_BY_TWO(lanes_le, a <= b)
TWO_BY_TWO(lanes_eq, a == b)
TWO_BY_TWO(lanes_ne, a != b)
TWO_BY_TWO(lanes_and, a && b)
TWO_BY_TWO(lanes_or, a || b)
TWO_BY_TWO(lanes_if_else_zero, a ? b : 0.0)
TWO_BY_TWO(lanes_fmin, fmin(a, b))
TWO_BY_TWO(lanes_fmax, fmax(a, b))
TWO_BY_TWO(lanes_fmod, fmod(a, b))
TWO_BY_TWO(lanes_remainder, remainder(a, b))
TWO_BY_TWO(lanes_copysign, copysign(a, b))
TWO_BY_TWO(lanes_atan2, atan2(a, b))
TWO_BY_TWO(lanes_hypot, hypot(a, b))

#endif
