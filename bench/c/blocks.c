// SPDX-License-Identifier: Apache-2.0
// The function blocks in C that the dispatch rows run.
#include "law.h"
#include <opengpac.h>

FUNCTION_BLOCK(gain, "Gain: y = k u.",
    in   (double, u,      "input"),
    out  (double, y,      "k times the input"),
    param(double, k, 1.0, "factor"))
{
    self->y = self->k * self->u;
    return OK;
}

FUNCTION_BLOCK(pid, "PID: y = kp e + sum of ki e + kd times the change of e, with e = setpoint - u.",
    in   (double, u,              "where it is"),
    out  (double, y,              "effort"),
    param(double, setpoint, 0.5,  "where it is to be"),
    param(double, kp, 0.7,        "proportional gain"),
    param(double, ki, 0.01,       "integral gain, an invocation"),
    param(double, kd, 0.1,        "derivative gain, invocations"),
    param(double, limit, 10.0,    "greatest effort either way"),
    state(double, integral, 0.0,  "sum of ki e"),
    state(double, before, 0.0,    "e of the invocation before"))
{
    self->y = pid_law(self->setpoint - self->u, self->kp, self->ki, self->kd, self->limit, &self->integral, &self->before);
    return OK;
}

FUNCTION_BLOCK(lowpass, "First-order low-pass filter: y += k (u - y).",
    in   (double, u,      "raw signal"),
    out  (double, y,      "filtered signal"),
    param(double, k, 0.5, "smoothing factor, 0 to 1"))
{
    self->y += self->k * (self->u - self->y);
    return OK;
}

FUNCTION_BLOCK(limit, "Limit: y = u within -k to k.",
    in   (double, u,      "input"),
    out  (double, y,      "limited"),
    param(double, k, 2.0, "greatest value either way"))
{
    self->y = clamp(self->u, self->k);
    return OK;
}

FUNCTION_BLOCK(at_once, "Reports `done` on every invocation.",
    out      (double, y,  "number of the invocation"),
    condition(done,       "it ran"))
{
    self->y = (double)invocation->number;
    report(done);
    return OK;
}
