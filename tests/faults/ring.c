// SPDX-License-Identifier: Apache-2.0
// Blocks of the cell of sixteen processors.
#include <opengpac.h>

FUNCTION_BLOCK(number, "Numbers: y = 1, 2, 3, ...", out(double, y, "number"))
{
    self->y += 1;
    return OK;
}

FUNCTION_BLOCK(along, "Passes on: y = u.", in(double, u, "value"), out(double, y, "the same"))
{
    self->y = self->u;
    return OK;
}

FUNCTION_BLOCK(expects, "Counts the numbers that did not come: each is one more than the last.",
    in   (double,  u,       "number"),
    out  (int64_t, seen,    "how many have come"),
    out  (int64_t, lost,    "how many have not"),
    state(double,  last, 0, "the last one"))
{
    self->seen += 1;
    if (self->u > self->last + 1) self->lost += (int64_t)(self->u - self->last) - 1;
    self->last = self->u;
    return OK;
}
