// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(pid, "PID with a filtered derivative, limits and anti-windup, beside the same in Python.",
    in(double, setpoint, "where it is to be", "rad"), in(double, measured, "where it is", "rad"), out(double, effort, "effort", "N.m"),
    state(double, integral, 0, "integral"), state(double, filtered, 0, "filtered derivative"), state(double, before, 0, "measured before"),
    param(double, kp, 60, "gain"), param(double, ki, 5, "gain of the integral"), param(double, kd, 1, "gain of the derivative"),
    param(double, alpha, 0.2, "smoothing factor"), param(double, limit, 100, "limit", "N.m"), param(double, dt, 0.001, "period", "s"))
{
    double error = self->setpoint - self->measured;
    self->filtered += self->alpha * ((self->before - self->measured) / self->dt - self->filtered);
    self->before = self->measured;
    double raw = self->kp * error + self->integral + self->kd * self->filtered;
    double low = raw < self->limit ? raw : self->limit;
    self->effort = low > -self->limit ? low : -self->limit;
    if (self->effort == raw || (raw > self->effort) != (error > 0)) self->integral += self->ki * error * self->dt;
    return OK;
}
