// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(refuses, "Returns fault 7 from invocation `at` on.",
    out  (double, y, "number of the invocation"),
    param(double, at, 3, "first invocation that fails"))
{
    self->y = (double)invocation->number;
    return self->y >= self->at ? FAULT(7) : OK;
}

FUNCTION_BLOCK(not_a_number, "Gives NaN at invocation `at`, and counts in its state the invocations that were good.",
    out  (double, y, "good invocations, or NaN"),
    param(double, at, 3, "invocation that fails"),
    state(double, good, 0, "good invocations"))
{
    volatile double zero = 0;
    self->good += 1;
    self->y = (double)invocation->number == self->at ? zero / zero : self->good;
    return OK;
}

FUNCTION_BLOCK(divides, "Divides an integer by zero from invocation `at` on.",
    out  (double, y, "number of the invocation"),
    param(double, at, 3, "first invocation that fails"))
{
    volatile int dividend = 12, divisor = (double)invocation->number >= self->at ? 0 : 12;
    self->y = (double)(dividend / divisor) * (double)invocation->number;
    return OK;
}

FUNCTION_BLOCK(null_pointer, "Reads through a null pointer from invocation `at` on.",
    out  (double, y, "number of the invocation"),
    param(double, at, 3, "first invocation that fails"))
{
    static double here = 1;
    volatile double *volatile p = (double)invocation->number >= self->at ? (double *)0 : &here;
    self->y = *p * (double)invocation->number;
    return OK;
}

FUNCTION_BLOCK(endless, "Never returns from invocation `at` on.",
    out  (double, y, "number of the invocation"),
    param(double, at, 3, "first invocation that fails"))
{
    volatile int on = (double)invocation->number >= self->at;
    while (on) {}
    self->y = (double)invocation->number;
    return OK;
}
