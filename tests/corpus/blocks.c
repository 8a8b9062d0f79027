// SPDX-License-Identifier: Apache-2.0
// Blocks with the types, units, modes and conditions that the programs of this corpus bind wrongly.
#include <opengpac.h>

TYPE(point, "A point.", field(double, x), field(double, y));
TYPE(small_point, "A point in single precision.", field(float, x), field(float, y));

FUNCTION_BLOCK(angle, "A source of angles.",
    out(double, y, "angle", "rad"))
{
    return OK;
}

FUNCTION_BLOCK(force_sink, "Takes a force.",
    in(double, u, "force", "N"))
{
    return OK;
}

FUNCTION_BLOCK(float_gain, "y = k u in single precision.",
    in   (float, u, "input"),
    out  (float, y, "k times the input"),
    param(float, k, 1.0f, "factor"))
{
    self->y = self->k * self->u;
    return OK;
}

FUNCTION_BLOCK(small, "A small whole number.",
    out  (double, y, "the number"),
    param(uint8_t, level, 1, "level"),
    param(double[3], limits, (1, 2, 3), "three limits"))
{
    self->y = self->level;
    return OK;
}

FUNCTION_BLOCK(averager, "Every fifth value of u is one of v.",
    in_ratio(double, u, 5, "slow input"),
    out(double, y, "the same"))
{
    self->y = self->u;
    return OK;
}

FUNCTION_BLOCK(pair, "Two numbers.",
    out(double[2], y, "the numbers"))
{
    return OK;
}

FUNCTION_BLOCK(point_source, "A source of points.",
    out(point, p, "point"))
{
    return OK;
}

FUNCTION_BLOCK(small_point_sink, "Takes small points.",
    in(small_point, p, "point"))
{
    return OK;
}

FUNCTION_BLOCK(touch, "Reports a touch.",
    in       (double, force, "force", "N"),
    condition(touched, "the force is above the limit"),
    param    (double, limit, 5.0, "limit", "N"))
{
    if (self->force > self->limit) report(touched);
    return OK;
}

FUNCTION_BLOCK(slope, "Difference of the newest and the oldest of eight values.",
    in_history(double, u, 8, "values"),
    out       (double, y, "their difference"))
{
    self->y = self->u[7] - self->u[0];
    return OK;
}
