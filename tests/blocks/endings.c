// SPDX-License-Identifier: Apache-2.0
// Blocks that end their process, or stay in one invocation until somebody else ends it.
#include <opengpac.h>
#include <signal.h>
#include <stdlib.h>

FUNCTION_BLOCK(aborts, "Ends its process with SIGABRT at invocation `at`, whatever guards it.",
    out  (double, y,     "number of the invocation"),
    param(double, at, 3, "invocation that ends the process"))
{
    self->y = (double)invocation->number;
    if (self->y >= self->at) {
        signal(SIGABRT, SIG_DFL);
        abort();
    }
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
