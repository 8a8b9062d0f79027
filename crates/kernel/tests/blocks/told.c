// SPDX-License-Identifier: Apache-2.0
// `Told` of banks.rs in C: adds what it reads to a sum, and does what it is told on one invocation.
#include <math.h>
#include <opengpac.h>

enum { REPORT = 1, RETURN = 2, OTHER_RETURN = 3, IS_NONFINITE = 4, NULL_POINTER = 5, DIVIDE = 6, LOOP = 7 };

FUNCTION_BLOCK(told, "y = sum + the number of the invocation.",
    in          (double, u, "what is added"),
    out         (double, y, "sum"),
    condition_of(double, high, "the sum is so high"),
    param       (uint64_t, when, 0, "on this invocation"),
    param       (uint32_t, act, 0, "what it does then"),
    state       (double, sum, 0.0, "sum of what was read"))
{
    self->sum += self->u;
    self->y = self->sum + (double)invocation->number;
    switch (invocation->number == self->when ? self->act : 0) {
    case REPORT: report_value(high, self->sum); break;
    case RETURN: return FAULT(7);
    case OTHER_RETURN: return FAULT(8);
    case IS_NONFINITE: self->y = NAN; break;
    case NULL_POINTER: {
        const volatile double *volatile nowhere = (const volatile double *)8;
        self->y = *nowhere;
        break;
    }
    case DIVIDE: {
        volatile int of = 7, by = 0;
        self->y = of / by;
        break;
    }
    case LOOP:
        while (*(volatile uint32_t *)&self->act == LOOP) {}
        break;
    default: break;
    }
    return OK;
}

FUNCTION_BLOCK(large, "A block that spends its time in its body.",
    out  (double[200], y, "zeros"))
{
    self->y[0] = 0;
    return OK;
}
