// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

TYPE(pose, "Position and heading.", field(double[3], p), field(double, yaw));

FUNCTION_BLOCK(turn, "Turns a pose: yaw += angle.",
    in_async(pose,   before, "pose"),
    param   (double, angle, 0.5, "angle", "rad"),
    out     (pose,   after, "turned pose"))
{
    self->after = self->before;
    self->after.yaw += self->angle;
    return OK;
}

FUNCTION_BLOCK(scale, "y = k u, of three elements, and their count of rounds.",
    in_async(float[3], u, "vector", "m"),
    param   (float, k, 2, "factor"),
    out     (float[3], y, "scaled vector", "m"))
{
    for (int i = 0; i < 3; i++) self->y[i] = self->k * self->u[i];
    return OK;
}

FUNCTION_BLOCK(triple, "y = 3 u, of three elements.",
    in_async(double[3], u, "vector"),
    out     (double[3], y, "three times that"))
{
    for (int i = 0; i < 3; i++) self->y[i] = 3 * self->u[i];
    return OK;
}

FUNCTION_BLOCK(triple_sync, "y = 3 u, of three elements, once all are new.",
    in (double[3], u, "vector"),
    out(double[3], y, "three times that"))
{
    for (int i = 0; i < 3; i++) self->y[i] = 3 * self->u[i];
    return OK;
}
