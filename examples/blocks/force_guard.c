// SPDX-License-Identifier: Apache-2.0
// A condition with a value, a size and a state: what a guard of n joints looks like.
#include <math.h>
#include <opengpac.h>

FUNCTION_BLOCK(force_guard, "Reports when the norm of n efforts exceeds its preset for `patience` invocations in a row.",
    size (n, 1, 16),
    in   (double[n], effort,        "efforts of the joints", "N.m"),
    out  (double, norm,             "Euclidean norm of the efforts", "N.m"),
    param(int32_t, patience, 3,     "invocations in a row"),
    state(int32_t, beyond, 0,       "invocations beyond the preset so far"),
    condition_of_default(double, exceeded, 50.0, "the norm that was met", "N.m"))
{
    double sum = 0.0;
    for (uint32_t i = 0; i < n; i++) sum += self->effort[i] * self->effort[i];
    self->norm = sqrt(sum);
    self->beyond = self->norm > self->exceeded ? self->beyond + 1 : 0;
    if (self->beyond >= self->patience) report_value(exceeded, self->norm);
    return OK;
}
