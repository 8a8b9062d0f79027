// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(pair, "Two outputs that belong together: a = n, b = -n.",
    out(double, a, "n"),
    out(double, b, "-n"))
{
    self->a = (double)invocation->number + 1;
    self->b = -self->a;
    return OK;
}

FUNCTION_BLOCK(pair_check, "Counts the invocations that saw two halves of different pairs: a + b != 0.",
    in_async(double, a, "n"),
    in_async(double, b, "-n"),
    out     (double, torn, "how many so far"),
    out     (double, seen, "newest n"),
    state   (double, count, 0, "how many so far"))
{
    if (self->a + self->b != 0) self->count += 1;
    self->torn = self->count;
    self->seen = self->a;
    return OK;
}
