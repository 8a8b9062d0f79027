// SPDX-License-Identifier: Apache-2.0
// Blocks in C for the tests under the real-time sanitizer.
#include <opengpac.h>
#include <stdlib.h>

FUNCTION_BLOCK(gain, "Gain: y = k u.",
    in   (double, u,      "input"),
    out  (double, y,      "output"),
    param(double, k, 2.0, "factor"))
{
    self->y = self->k * self->u + 1;
    return OK;
}

FUNCTION_BLOCK(allocating, "Allocates, as no block may: y = u.",
    in   (double, u,      "input"),
    out  (double, y,      "output"))
{
    double *volatile memory = malloc(sizeof *memory);
    *memory = self->u;
    self->y = *memory;
    free(memory);
    return OK;
}
