// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(lowpass, "First-order low-pass filter: y += alpha (u - y).",
    in   (double, u,          "raw signal"),
    out  (double, y,          "filtered signal"),
    param(double, alpha, 0.1, "smoothing factor, 0 to 1"))
{
    self->y += self->alpha * (self->u - self->y);
    return OK;
}
