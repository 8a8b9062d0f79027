// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(count, "Counter: y = number of the invocation, from 0; reports `enough` from its preset on.",
    out         (double, y,      "number of the invocation"),
    condition_of(double, enough, "y has come to the preset"))
{
    self->y = (double)invocation->number;
    if (self->enough > 0 && self->y >= self->enough) report_value(enough, self->y);
    return OK;
}

FUNCTION_BLOCK(clock_now, "Clock: what an invocation is told of time.",
    out(int64_t, time_ns, "running time"),
    out(int64_t, now_ns,  "release time"))
{
    self->time_ns = invocation->time_ns;
    self->now_ns = invocation->now_ns;
    return OK;
}
