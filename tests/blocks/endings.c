// SPDX-License-Identifier: Apache-2.0
// Blocks that end their process, or stay in one invocation until somebody else ends it.
#include <opengpac.h>
#include <stdlib.h>

FUNCTION_BLOCK(aborts, "Calls abort() at invocation `at`.",
    out  (double, y,     "number of the invocation"),
    param(double, at, 3, "invocation that ends the process"))
{
    self->y = (double)invocation->number;
    if (self->y >= self->at) abort();
    return OK;
}

FUNCTION_BLOCK(stays, "Never returns from invocation 3.",
    out  (double, y, "number of the invocation"))
{
    volatile int on = invocation->number >= 3;
    while (on) {}
    self->y = (double)invocation->number;
    return OK;
}
