// SPDX-License-Identifier: Apache-2.0
// First level, closed loop: what happens every millisecond. Written by the controls engineer.
#include <opengpac.h>

FUNCTION_BLOCK(slide, "A slide that follows a speed: position += speed dt.",
    in_async(double, speed,           "commanded speed",   "m/s"),
    out     (double, position,        "where it is",       "m"),
    param   (double, dt,       0.001, "time of one cycle", "s"))
{
    self->position += self->speed * self->dt;
    return OK;
}

FUNCTION_BLOCK(ramp, "Speed that rises to a limit: speed = min(limit, speed + rise).",
    out  (double, speed,       "commanded speed",     "m/s"),
    param(double, limit, 0.1,  "maximum speed",      "m/s"),
    param(double, rise,  0.01, "rise in one cycle",   "m/s"))
{
    double next = self->speed + self->rise;
    self->speed = next < self->limit ? next : self->limit;
    return OK;
}

FUNCTION_BLOCK(stop_at, "Reports when a position has come to a preset.",
    in_async            (double, position,     "where the slide is", "m"),
    out                 (double, reached,      "the same",           "m"),
    condition_of_default(double, there,  0.05, "it is there",        "m"))
{
    self->reached = self->position;
    if (self->position >= self->there) report_value(there, self->position);
    return OK;
}
