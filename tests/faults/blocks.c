// SPDX-License-Identifier: Apache-2.0
// Blocks that fail on command, each in its own way, in the invocation whose number is `at`.
#include <opengpac.h>
#include <stdlib.h>

FUNCTION_BLOCK(segfaults, "Reads through a null pointer.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    static int64_t here = 1;
    volatile int64_t *volatile p = self->k >= self->at ? (int64_t *)0 : &here;
    self->k += *p;
    return OK;
}

FUNCTION_BLOCK(divides, "Divides by zero.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    volatile int one = 1, divisor = self->k >= self->at ? 0 : 1;
    self->k += one / divisor;
    return OK;
}

FUNCTION_BLOCK(illegal, "Executes what is no instruction.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    if (self->k >= self->at) __builtin_trap();
    self->k++;
    return OK;
}

FUNCTION_BLOCK(runs_away, "Never returns.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    volatile int on = self->k >= self->at;
    while (on) {}
    self->k++;
    return OK;
}

FUNCTION_BLOCK(aborts, "Calls abort().", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    if (self->k >= self->at) abort();
    self->k++;
    return OK;
}

FUNCTION_BLOCK(counts, "Counts, and does not fail.", out(int64_t, k, "invocations"))
{
    self->k++;
    return OK;
}
