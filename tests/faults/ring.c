// SPDX-License-Identifier: Apache-2.0
// Blocks of the cell of sixteen processors, and of the soak.
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

FUNCTION_BLOCK(until, "Counts: y = 1, 2, 3, ...; reports `enough` at its preset.",
    out         (double, y,      "count"),
    condition_of(double, enough, "y has come to the preset"))
{
    self->y += 1;
    if (self->enough > 0 && self->y >= self->enough) report_value(enough, self->y);
    return OK;
}
