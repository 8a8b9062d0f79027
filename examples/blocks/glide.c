// SPDX-License-Identifier: Apache-2.0
// Motion along a line: going somewhere, and slowing down from whatever was going on.
#include <math.h>
#include <opengpac.h>

FUNCTION_BLOCK(glide, "Goes to a distance and stops there: along'' within ± acceleration, |along'| within speed.",
    out      (double, along,       "how far it has come", "m"),
    out      (double, rate,        "its speed", "m/s"),
    param    (double, distance, 0.0, "how far it goes", "m"),
    param    (double, speed, 0.05, "maximum speed", "m/s"),
    param    (double, acceleration, 0.2, "maximum acceleration", "m/s^2"),
    state    (int64_t, before, 0,  "running time of the invocation before, ns"),
    condition(there,               "it is where it goes to"))
{
    double dt = invocation->number == 0 ? 0.0 : (double)(invocation->time_ns - self->before) * 1e-9;
    double left = self->distance - self->along;
    // The speed from which it can still stop, less what it covers in this invocation.
    double reach = self->acceleration * dt, most = sqrt(2.0 * self->acceleration * fabs(left) + 0.25 * reach * reach) - 0.5 * reach;
    if (dt > 0.0) most = fmin(most, fabs(left) / dt);
    double wanted = copysign(fmin(most, self->speed), left);
    self->before = invocation->time_ns;
    self->rate += fmin(fmax(wanted - self->rate, -reach), reach);
    self->along += self->rate * dt;
    if (fabs(self->distance - self->along) < 1e-9) self->along = self->distance;
    if (left == 0.0 && fabs(self->rate) < 1e-9) report(there);
    return OK;
}

FUNCTION_BLOCK(brake, "Slows down from a motion that another block was making: along'' = -deceleration until it stands.",
    in_async (double, was_along,   "where that motion was, read once", "m"),
    in_async (double, was_rate,    "how fast it was, read once", "m/s"),
    out      (double, along,       "how far it has come", "m"),
    out      (double, began,       "where it began to slow down", "m"),
    param    (double, deceleration, 1.0, "by which it slows down", "m/s^2"),
    state    (int64_t, before, 0,  "running time of the invocation before, ns"),
    state    (double, rate, 0.0,   "its speed", "m/s"),
    condition(stopped,             "it stands"))
{
    if (invocation->number == 0) {
        self->along = self->began = self->was_along;
        self->rate = self->was_rate;
    } else {
        double dt = (double)(invocation->time_ns - self->before) * 1e-9;
        self->rate = copysign(fmax(fabs(self->rate) - self->deceleration * dt, 0.0), self->rate);
        self->along += self->rate * dt;
    }
    self->before = invocation->time_ns;
    if (self->rate == 0.0) report(stopped);
    return OK;
}
