// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(memory, "Two counters: one forgets at each start of its verb, one does not.",
    out        (double, forgets, "invocations since the start"),
    out        (double, keeps,   "invocations since the instance was made"),
    state      (double, a, 0,    "invocations since the start"),
    state_keep (double, b, 0,    "invocations since the instance was made"))
{
    self->forgets = self->a += 1;
    self->keeps = self->b += 1;
    return OK;
}
