// SPDX-License-Identifier: Apache-2.0
// A tool that gives way to a force like a mass on a spring with a damper, of an arm that is position-controlled.
#include <opengpac.h>

FUNCTION_BLOCK(admittance, "Gives way to a force along a line: mass along'' = force . direction - damping along' - stiffness along.",
    in_async (double[3], force,     "force on the tool, in the frame of the direction", "N"),
    out      (double, along,        "how far it has given way", "m"),
    out      (double, pushed,       "the force along the direction, beyond that at the start", "N"),
    param    (double[3], direction, (1, 0, 0), "direction in which it gives way"),
    param    (double, stiffness, 1000.0, "force for each metre; 0: it stays where it is pushed to", "N/m"),
    param    (double, damping, 200.0, "force for each metre a second", "N.s/m"),
    param    (double, mass, 5.0,    "inertia that is felt", "kg"),
    state    (double, rate, 0.0,    "its speed", "m/s"),
    state    (double, weight, 0.0,  "the force at the start: the tool's own weight", "N"),
    state    (int64_t, before, 0,   "running time of the invocation before, ns"))
{
    double felt = 0.0;
    for (int k = 0; k < 3; k++) felt += self->force[k] * self->direction[k];
    if (invocation->number == 0) {
        if (!(self->mass > 0.0)) return FAULT(1);
        self->weight = felt;
    } else {
        double dt = (double)(invocation->time_ns - self->before) * 1e-9;
        // The speed is taken at the end of the step: the damper is then stable for any step.
        self->rate = (self->rate + dt * (self->pushed - self->stiffness * self->along) / self->mass) / (1.0 + dt * self->damping / self->mass);
        self->along += self->rate * dt;
    }
    self->pushed = felt - self->weight;
    self->before = invocation->time_ns;
    return OK;
}
