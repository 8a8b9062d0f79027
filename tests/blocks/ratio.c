// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(every_fifth, "Decimation: y = number of the invocation, stored on every fifth.",
    out_ratio(double, y, 5, "number of the invocation"))
{
    self->y = (double)invocation->number;
    return OK;
}

FUNCTION_BLOCK(slow_input, "y = u, which its writer updates once in ten invocations of this block.",
    in_ratio (double, u, 10, "slow value"),
    out      (double, y, "the same"),
    out      (double, n, "number of the invocation"))
{
    self->y = self->u;
    self->n = (double)invocation->number;
    return OK;
}
