// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

// Counts what took place: a release that a busy machine skips takes a number with it, which no test is to depend on.
FUNCTION_BLOCK(count, "Counter: y = invocations before this one; reports `enough` from its preset on.",
    out         (double, y,      "invocations before this one"),
    condition_of(double, enough, "y has come to the preset"),
    state       (int64_t, k, 0,  "invocations so far"))
{
    self->y = (double)self->k++;
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
