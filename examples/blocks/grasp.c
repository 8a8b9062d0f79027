// SPDX-License-Identifier: Apache-2.0
// What centering grasp is made of: fingers that move together, a sense of touch, an arm that gives way. Finger 0 closes towards
// +x of the hand, finger 1 towards -x.
#include <math.h>
#include <opengpac.h>

FUNCTION_BLOCK(fingers, "Moves the set-points of two fingers together: setpoint += speed dt, from where they were commanded, within limits.",
    in_async (double[2], start,   "where the fingers are commanded to be, read once", "m"),
    out      (double[2], setpoint, "where they are to be", "m"),
    out      (double[2], force_max, "the most that they may exert", "N"),
    param    (double, speed, -0.02, "below 0: they close", "m/s"),
    param    (double, force, 0.5,  "the most that they may exert", "N"),
    param    (double, least, 0.0,  "least set-point", "m"),
    param    (double, most, 0.05,  "greatest set-point", "m"),
    state    (int64_t, before, 0,  "running time of the invocation before, ns"),
    condition(at_limit,            "both set-points are at a limit"))
{
    double dt = invocation->number == 0 ? 0.0 : (double)(invocation->time_ns - self->before) * 1e-9;
    int still = 0;
    self->before = invocation->time_ns;
    for (int i = 0; i < 2; i++) {
        double from = invocation->number == 0 ? self->start[i] : self->setpoint[i];
        double to = fmin(fmax(from + self->speed * dt, fmin(self->least, from)), fmax(self->most, from));
        still += dt > 0.0 && to == from;
        self->setpoint[i] = to;
        self->force_max[i] = self->force;
    }
    if (still == 2) report(at_limit);
    return OK;
}

FUNCTION_BLOCK(touch, "Tells by which fingers something is touched: one, or both with equal force.",
    in_async            (double[2], force, "what the fingers feel", "N"),
    in_async            (double[2], position, "where the fingers are", "m"),
    out                 (double, width,    "distance between the pads: the sum of the positions", "m"),
    out                 (double, difference, "force 0 less force 1", "N"),
    param               (double, balance, 0.05, "maximum difference of forces that counts as equal", "N"),
    param               (int32_t, patience, 20, "invocations in a row that both must feel it"),
    state               (int32_t, felt, 0,   "invocations in a row so far"),
    condition_of_default(double, one, 0.1,   "a finger feels more than the preset; the value is the difference of the forces", "N"),
    condition_of_default(double, both, 0.1,  "both feel more than the preset, equally, and long enough; the value is the lesser force", "N"))
{
    double least = fmin(self->force[0], self->force[1]);
    self->width = self->position[0] + self->position[1];
    self->difference = self->force[0] - self->force[1];
    if (fmax(self->force[0], self->force[1]) > self->one) report_value(one, self->difference);
    self->felt = least > self->both && fabs(self->difference) <= self->balance ? self->felt + 1 : 0;
    if (self->felt >= self->patience) report_value(both, least);
    return OK;
}

FUNCTION_BLOCK(yielding, "Gives way to the finger that feels more: along' = gain (force 1 - force 0), within ± speed_max.",
    in_async(double[2], force,      "what the fingers feel", "N"),
    out     (double, along,         "how far it has given way, along x of the hand", "m"),
    param   (double, gain, 0.1,     "speed for each newton", "m/s/N"),
    param   (double, speed_max, 0.05, "maximum speed", "m/s"),
    state   (int64_t, before, 0,    "running time of the invocation before, ns"))
{
    double dt = invocation->number == 0 ? 0.0 : (double)(invocation->time_ns - self->before) * 1e-9;
    double speed = self->gain * (self->force[1] - self->force[0]);
    self->before = invocation->time_ns;
    self->along += fmin(fmax(speed, -self->speed_max), self->speed_max) * dt;
    return OK;
}
