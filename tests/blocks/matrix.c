// SPDX-License-Identifier: Apache-2.0
#include <opengpac.h>

FUNCTION_BLOCK(efforts, "Joint efforts of a force and a torque at the tool: tau = J^T f.",
    size    (n, 1, 8),
    in_async(double[n][6], jacobian, "motion of the tool for each joint's"),
    in_async(double[6],    wrench,   "force and torque at the tool"),
    out     (double[n],    effort,   "joint efforts"))
{
    for (uint32_t i = 0; i < n; i++) {
        self->effort[i] = 0;
        for (int k = 0; k < 6; k++) self->effort[i] += self->jacobian[i][k] * self->wrench[k];
    }
    return OK;
}

FUNCTION_BLOCK(scaled, "Scales the rows of a matrix, and sums what came so far.",
    size    (rows, 1, 4),
    in      (double[rows][2], a,                  "matrix"),
    param   (double[2][2], w, (1, 2, 3, 4),    "y = a w + so far"),
    out     (double[rows][2], y,                  "scaled matrix"),
    state   (double[rows][2], sum, 0,             "so far"))
{
    for (uint32_t i = 0; i < rows; i++)
        for (int j = 0; j < 2; j++) {
            self->y[i][j] = self->a[i][0] * self->w[0][j] + self->a[i][1] * self->w[1][j] + self->sum[i][j];
            self->sum[i][j] = self->y[i][j];
        }
    return OK;
}
