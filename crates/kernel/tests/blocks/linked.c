// SPDX-License-Identifier: Apache-2.0
// A block of which several in a row are fused, and whose stores take a good part of its time.
#include <opengpac.h>

FUNCTION_BLOCK(linked, "Hands the number of the invocation on, where it comes from before: y = number.",
    in (double[60], u, "that of the one before"),
    out(double[60], y, "the number"))
{
    for (int i = 0; i < 60; i++) self->y[i] = self->u[i] * 0.0 + (double)invocation->number;
    return OK;
}
