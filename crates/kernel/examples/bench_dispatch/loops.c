// SPDX-License-Identifier: Apache-2.0
// What the kernel's dispatch is measured against: the same work as hand-written C loops. And the same blocks in C.
#include <math.h>
#include <opengpac.h>

FUNCTION_BLOCK(gain, "Gain: y = k u.",
    in   (double, u,        "input"),
    out  (double, y,        "output"),
    param(double, k, 0.999, "factor"))
{
    self->y = self->k * self->u;
    return OK;
}

FUNCTION_BLOCK(offset, "Offset: y = u + b.",
    in   (double, u,        "input"),
    out  (double, y,        "output"),
    param(double, b, 0.001, "offset"))
{
    self->y = self->u + self->b;
    return OK;
}

FUNCTION_BLOCK(limit, "Limit: y = max(-b, min(b, u)).",
    in   (double, u,      "input"),
    out  (double, y,      "output"),
    param(double, b, 1e3, "bound"))
{
    self->y = self->u > self->b ? self->b : self->u < -self->b ? -self->b : self->u;
    return OK;
}

FUNCTION_BLOCK(pid, "PID: y = kp e + ki sum(e) + kd (e - e'), e = -u.",
    in   (double, u,          "measured value"),
    out  (double, y,          "effort"),
    param(double, kp,  0.5,   "proportional gain"),
    param(double, ki,  0.001, "integral gain"),
    param(double, kd,  0.1,   "derivative gain"),
    state(double, sum,  0,    "sum of errors"),
    state(double, last, 0,    "error before"))
{
    double e = -self->u;
    self->sum = 0.999 * self->sum + e;
    self->y = self->kp * e + self->ki * self->sum + self->kd * (e - self->last);
    self->last = e;
    return OK;
}

// One of the four, by hand.
typedef struct {
    const double *u;
    double *y;
    double p[3], s[2];
} work;
typedef void (*body)(work *);
typedef struct {
    body run;
    work *instance;
} call;

static inline void do_gain(work *w) { *w->y = w->p[0] * *w->u; }
static inline void do_offset(work *w) { *w->y = *w->u + w->p[0]; }
static inline void do_limit(work *w) { double u = *w->u, b = w->p[0]; *w->y = u > b ? b : u < -b ? -b : u; }
static inline void do_pid(work *w)
{
    double e = -*w->u;
    w->s[0] = 0.999 * w->s[0] + e;
    *w->y = w->p[0] * e + w->p[1] * w->s[0] + w->p[2] * (e - w->s[1]);
    w->s[1] = e;
}
#define NOINLINE(name) __attribute__((noinline)) static void call_##name(work *w) { do_##name(w); }
NOINLINE(gain) NOINLINE(offset) NOINLINE(limit) NOINLINE(pid)
static const body bodies[] = {call_gain, call_offset, call_limit, call_pid};

__attribute__((visibility("default"))) body loop_body(int kind) { return bodies[kind]; }

// Through function pointers.
__attribute__((visibility("default"))) long loop_calls(const call *calls, long n, long rounds)
{
    for (long r = 0; r < rounds; r++)
        for (long i = 0; i < n; i++)
            calls[i].run(calls[i].instance);
    return 0;
}

// The same, and each output is checked for a finite value.
__attribute__((visibility("default"))) long loop_checked(const call *calls, long n, long rounds)
{
    long faults = 0;
    for (long r = 0; r < rounds; r++)
        for (long i = 0; i < n; i++) {
            calls[i].run(calls[i].instance);
            if (__builtin_expect(!isfinite(*calls[i].instance->y), 0))
                faults++;
        }
    return faults;
}

// Inlined: one kind.
__attribute__((visibility("default"))) long loop_inlined(const call *calls, long n, long rounds, int kind)
{
    for (long r = 0; r < rounds; r++)
        for (long i = 0; i < n; i++)
            switch (kind) {
            case 0: do_gain(calls[i].instance); break;
            case 1: do_offset(calls[i].instance); break;
            case 2: do_limit(calls[i].instance); break;
            default: do_pid(calls[i].instance); break;
            }
    return 0;
}
