// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(ramp, "Ramp: y grows by v, and v grows to 3, or falls to 0 while `holding`; then it reports `held`.",
    in_async_default(bool,   holding, false, "come to rest"),
    out             (double, y,              "how far it is"),
    out             (double, v,              "how fast it is"),
    condition       (held,                   "it rests"))
{
    if (self->holding) self->v = self->v > 1 ? self->v - 1 : 0;
    else self->v = self->v < 2 ? self->v + 1 : 3;
    self->y += self->v;
    if (self->holding && self->v == 0) report(held);
    return OK;
}
