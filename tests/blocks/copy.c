// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(copy, "Copy: y = u, once for each value of u; n counts them.",
    in   (double, u,    "value"),
    out  (double, y,    "the same"),
    out  (int64_t, n,   "how many so far"),
    state(int64_t, m, 0, "how many so far"))
{
    self->y = self->u;
    self->n = ++self->m;
    return OK;
}

FUNCTION_BLOCK(sample, "Sample: y = the newest u, whenever it was written.",
    in_async(double, u, "value"),
    out     (double, y, "the same"))
{
    self->y = self->u;
    return OK;
}

FUNCTION_BLOCK(add, "Adder: y = a + b.",
    in (double, a, "first"),
    in (double, b, "second"),
    out(double, y, "sum"))
{
    self->y = self->a + self->b;
    return OK;
}

FUNCTION_BLOCK(join, "Joiner: y = (a, b), once both are new.",
    in (double, a, "first"),
    in (double, b, "second"),
    out(double[2], y, "both"))
{
    self->y[0] = self->a;
    self->y[1] = self->b;
    return OK;
}
