// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(count, "Counts its invocations: n += 1.",
    out(double, n, "invocations since the start", "V"))
{
    self->n += 1;
    return OK;
}
