// SPDX-License-Identifier: Apache-2.0
// Moves the tool of an arm of six turning joints along a line, the way a control engineer writes it: forward kinematics by the
// transforms of Denavit and Hartenberg, the geometric Jacobian, and one Newton step an invocation.
#include <math.h>
#include <opengpac.h>
#include <string.h>

typedef struct { double x[3], y[3], z[3], p[3]; } frame;

static void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

// Appends Rz(q) Tz(d) Tx(a) Rx(alpha).
static void append(frame *f, double q, double d, double a, double alpha)
{
    double cq = cos(q), sq = sin(q), ca = cos(alpha), sa = sin(alpha);
    frame g = *f;
    for (int k = 0; k < 3; k++) {
        double across = -sq * f->x[k] + cq * f->y[k];
        g.x[k] = cq * f->x[k] + sq * f->y[k];
        g.y[k] = ca * across + sa * f->z[k];
        g.z[k] = -sa * across + ca * f->z[k];
        g.p[k] = f->p[k] + d * f->z[k] + a * g.x[k];
    }
    *f = g;
}

// Where the tool is, and how it moves with each joint: rows 0 to 2 of the Jacobian its speed, 3 to 5 its turning.
static frame forward(const double q[6], const double d[6], const double a[6], const double alpha[6], double jacobian[6][6])
{
    frame f = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}, at[6];
    for (int i = 0; i < 6; i++) {
        at[i] = f;
        append(&f, q[i], d[i], a[i], alpha[i]);
    }
    for (int i = 0; i < 6; i++) {
        double arm[3] = {f.p[0] - at[i].p[0], f.p[1] - at[i].p[1], f.p[2] - at[i].p[2]}, speed[3];
        cross(at[i].z, arm, speed);
        for (int k = 0; k < 3; k++) {
            jacobian[k][i] = speed[k];
            jacobian[3 + k][i] = at[i].z[k];
        }
    }
    return f;
}

// Solves A x = b in place by elimination with pivots; 0 where A is singular.
static int solve(double a[6][6], double b[6])
{
    for (int c = 0; c < 6; c++) {
        int best = c;
        for (int r = c + 1; r < 6; r++)
            if (fabs(a[r][c]) > fabs(a[best][c])) best = r;
        if (fabs(a[best][c]) < 1e-4) return 0;
        for (int k = 0; k < 6; k++) {
            double t = a[c][k];
            a[c][k] = a[best][k];
            a[best][k] = t;
        }
        double t = b[c];
        b[c] = b[best];
        b[best] = t;
        for (int r = c + 1; r < 6; r++) {
            double factor = a[r][c] / a[c][c];
            for (int k = c; k < 6; k++) a[r][k] -= factor * a[c][k];
            b[r] -= factor * b[c];
        }
    }
    for (int r = 5; r >= 0; r--) {
        for (int k = r + 1; k < 6; k++) b[r] -= a[r][k] * b[k];
        b[r] /= a[r][r];
    }
    return 1;
}

FUNCTION_BLOCK(tool_line, "Set-points that hold the tool's orientation and put it `along` on a line from where it was: q += J^-1(q) e.",
    in_async(double[6], start,     "where the joints are commanded to be, read once", "rad"),
    in      (double, along,        "how far along the line", "m"),
    out     (double[6], setpoint,  "where the joints are to be", "rad"),
    param   (double[3], direction, (1, 0, 0), "direction of the line, in the tool's frame at the start"),
    param   (double, step_max, 0.02, "maximum step of a joint in one invocation: fault 2 beyond", "rad"),
    param   (double[6], d,         (0.1625, 0, 0, 0.1333, 0.0997, 0.0996), "offsets of Denavit and Hartenberg, of a UR5e", "m"),
    param   (double[6], a,         (0, -0.425, -0.3922, 0, 0, 0), "lengths of Denavit and Hartenberg, of a UR5e", "m"),
    param   (double[6], alpha,     (1.5707963267948966, 0, 0, 1.5707963267948966, -1.5707963267948966, 0), "twists, of a UR5e", "rad"),
    state   (double[6], q,         (0, 0, 0, 0, 0, 0), "the set-points", "rad"),
    state   (double[12], home,     (0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0), "where the tool was: three axes, position"))
{
    double jacobian[6][6], error[6] = {0};
    if (invocation->number == 0) {
        memcpy(self->q, self->start, sizeof self->q);
        frame home = forward(self->q, self->d, self->a, self->alpha, jacobian);
        memcpy(self->home, &home, sizeof home);
    }
    frame home, now = forward(self->q, self->d, self->a, self->alpha, jacobian);
    memcpy(&home, self->home, sizeof home);
    const double *was[3] = {home.x, home.y, home.z}, *is[3] = {now.x, now.y, now.z};
    for (int k = 0; k < 3; k++) {
        double turn[3];
        cross(is[k], was[k], turn);
        for (int i = 0; i < 3; i++) {
            error[i] += self->along * self->direction[k] * was[k][i];
            error[3 + i] += 0.5 * turn[i];
        }
    }
    for (int i = 0; i < 3; i++) error[i] += home.p[i] - now.p[i];
    if (!solve(jacobian, error)) return FAULT(1);
    for (int i = 0; i < 6; i++) {
        if (fabs(error[i]) > self->step_max) return FAULT(2);
        self->q[i] += error[i];
        self->setpoint[i] = self->q[i];
    }
    return OK;
}
