// SPDX-License-Identifier: Apache-2.0
// The arithmetic that a function block and the hand-written loop beside it share: the same work on both sides of a ratio.
#ifndef LAW_H
#define LAW_H

static inline double clamp(double x, double limit)
{
    double low = x < limit ? x : limit;
    return low > -limit ? low : -limit;
}

// PID with differences, integral within the limit.
static inline double pid_law(double error, double kp, double ki, double kd, double limit, double *integral, double *before)
{
    double sum = clamp(*integral + ki * error, limit);
    double effort = clamp(kp * error + sum + kd * (error - *before), limit);
    *integral = sum;
    *before = error;
    return effort;
}

#endif
