// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

TYPE(sample, "A sample.", field(double[2], p), field(int32_t, k));

FUNCTION_BLOCK(last_four, "seen = the last four values of u, oldest first.",
    in_history(double, u, 4, "values"),
    out       (double[4], seen, "the same"))
{
    for (int i = 0; i < 4; i++) self->seen[i] = self->u[i];
    return OK;
}

FUNCTION_BLOCK(slope, "y = (u[n-1] - u[0]) / (n - 1).",
    in_history(double, u, 3, "values"),
    out       (double, y, "mean difference of two values"))
{
    self->y = (self->u[2] - self->u[0]) / 2.0;
    return OK;
}

FUNCTION_BLOCK(sampling, "s = the number of the invocation, in a struct and in an array.",
    out(sample, s, "sample"),
    out(double[2], a, "array"))
{
    double n = (double)invocation->number;
    self->s.p[0] = n;
    self->s.p[1] = -n;
    self->s.k = (int32_t)invocation->number;
    self->a[0] = n;
    self->a[1] = -n;
    return OK;
}

FUNCTION_BLOCK(last_samples, "The last three samples and arrays.",
    in_history(sample, s, 3, "samples"),
    in_history(double[2], a, 2, "arrays"),
    out       (int32_t[3], seen, "the samples' numbers"),
    out       (double[4], arrays, "the arrays, one after the other"))
{
    for (int i = 0; i < 3; i++) self->seen[i] = self->s[i].k;
    for (int i = 0; i < 4; i++) self->arrays[i] = self->a[i / 2][i % 2];
    return OK;
}
