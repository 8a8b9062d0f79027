// SPDX-License-Identifier: Apache-2.0
// Blocks of many types, for fused.rs; those of told.c stand beside them.
#include <opengpac.h>

TYPE(point, "A place.", field(double, x), field(float[2], rest));

FUNCTION_BLOCK(mix, "y = a - b / 2.",
    in (double, a, "the first"),
    in (double, b, "the second"),
    out(double, y, "their difference"))
{
    self->y = self->a - 0.5 * self->b;
    return OK;
}

FUNCTION_BLOCK(spread, "y[i] = (i + 1) u.",
    in (double, u, "value"),
    out(double[3], y, "its multiples"))
{
    for (int i = 0; i < 3; i++) self->y[i] = (i + 1) * self->u;
    return OK;
}

FUNCTION_BLOCK(fold, "The sum of three; and of all that there were, every second time.",
    in       (double[3], u, "three"),
    out      (double, y, "their sum"),
    out_ratio(double, slow, 2, "the sum of sums"),
    state    (double, sum, 0.0, "the sum of sums"))
{
    self->y = self->u[0] + self->u[1] + self->u[2];
    self->slow = self->sum += self->y;
    return OK;
}

FUNCTION_BLOCK(narrow, "A value in single precision, and whether it is above 0.",
    in (double, u, "value"),
    out(float, y, "value"),
    out(bool, above, "above 0"))
{
    self->y = (float)self->u;
    self->above = self->u > 0;
    return OK;
}

FUNCTION_BLOCK(choose, "y = above ? u : -2 before.",
    in      (bool, above, "which"),
    in      (float, u, "one"),
    in_async(double, before, "the other"),
    out     (double, y, "the chosen one"))
{
    self->y = self->above ? self->u : -2.0 * self->before;
    return OK;
}

FUNCTION_BLOCK(place, "A point of two values.",
    in (double, x, "the first"),
    in (float, r, "the rest"),
    out(point, y, "the point"))
{
    self->y.x = self->x;
    self->y.rest[0] = self->y.rest[1] = self->r;
    return OK;
}

FUNCTION_BLOCK(smooth, "y += (u.x - y) / 4.",
    in           (point, u, "where it goes"),
    out_nonfinite(double, y, "where it is"))
{
    self->y += 0.25 * (self->u.x - self->y) + (double)self->u.rest[1];
    return OK;
}
