// SPDX-License-Identifier: Apache-2.0
// The hand-written loops beside which dispatch is measured: the same arithmetic on the same values, through function pointers,
// through function pointers with a look at the outputs, and inlined. Each cycle reads the clock at its start and its end, as any
// periodic loop does and as a firing does.
#include "law.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <time.h>

enum { GAIN, PID, LOWPASS, LIMIT };

typedef struct {
    const double *u;
    double *y;
    double k;
} single; // gain, lowpass, limit

typedef struct {
    const double *u;
    double *y;
    double setpoint, kp, ki, kd, limit, integral, before;
} pid;

static void gain_run(void *self) { single *s = self; *s->y = s->k * *s->u; }
static void pid_run(void *self) { pid *p = self; *p->y = pid_law(p->setpoint - *p->u, p->kp, p->ki, p->kd, p->limit, &p->integral, &p->before); }
static void lowpass_run(void *self) { single *s = self; *s->y += s->k * (*s->u - *s->y); }
static void limit_run(void *self) { single *s = self; *s->y = clamp(*s->u, s->k); }
static int gain_checked(void *self) { single *s = self; double y = s->k * *s->u; if (!isfinite(y)) return 1; *s->y = y; return 0; }
static int lowpass_checked(void *self) { single *s = self; double y = *s->y + s->k * (*s->u - *s->y); if (!isfinite(y)) return 1; *s->y = y; return 0; }
static int limit_checked(void *self) { single *s = self; double y = clamp(*s->u, s->k); if (!isfinite(y)) return 1; *s->y = y; return 0; }
static int pid_checked(void *self)
{
    pid *p = self;
    double integral = p->integral, before = p->before;
    double y = pid_law(p->setpoint - *p->u, p->kp, p->ki, p->kd, p->limit, &integral, &before);
    if (!isfinite(y))
        return 1;
    *p->y = y;
    p->integral = integral;
    p->before = before;
    return 0;
}

typedef struct {
    void (*run)(void *);
    void *self;
} call;

typedef struct {
    int (*run)(void *);
    void *self;
} checked_call;

typedef struct {
    long n;
    const unsigned char *kinds;
    double *values;
    char *memory;
    call *calls;
    checked_call *checked;
} peer;

// `n` blocks of `kinds`; block i reads values[reads[i]] and writes values[writes[i]]; `values_len` values, all 1.
peer *peer_new(long n, const unsigned char *kinds, const uint32_t *reads, const uint32_t *writes, long values_len)
{
    static void (*const runs[])(void *) = {gain_run, pid_run, lowpass_run, limit_run};
    static int (*const checked[])(void *) = {gain_checked, pid_checked, lowpass_checked, limit_checked};
    static const double factors[] = {1.0, 0.0, 0.5, 2.0};
    peer *p = malloc(sizeof *p);
    *p = (peer){n, kinds, malloc(values_len * sizeof(double)), malloc(n * sizeof(pid)), malloc(n * sizeof(call)), malloc(n * sizeof(checked_call))};
    for (long i = 0; i < values_len; i++)
        p->values[i] = 1.0;
    char *at = p->memory;
    for (long i = 0; i < n; i++) {
        const double *u = p->values + reads[i];
        double *y = p->values + writes[i];
        p->calls[i] = (call){runs[kinds[i]], at};
        p->checked[i] = (checked_call){checked[kinds[i]], at};
        if (kinds[i] == PID) {
            *(pid *)at = (pid){u, y, 0.5, 0.7, 0.01, 0.1, 10.0, 0.0, 0.0};
            at += sizeof(pid);
        } else {
            *(single *)at = (single){u, y, factors[kinds[i]]};
            at += sizeof(single);
        }
    }
    return p;
}

void peer_free(peer *p)
{
    free(p->values), free(p->memory), free(p->calls), free(p->checked), free(p);
}

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static volatile int64_t cycle_started, cycle_ended;

// Each returns the ns that `cycles` cycles took.
int64_t peer_calls(peer *p, long cycles)
{
    int64_t started = now_ns();
    for (long c = 0; c < cycles; c++) {
        cycle_started = now_ns();
        for (long i = 0; i < p->n; i++)
            p->calls[i].run(p->calls[i].self);
        cycle_ended = now_ns();
    }
    return now_ns() - started;
}

int64_t peer_checked(peer *p, long cycles)
{
    static volatile long faults;
    int64_t started = now_ns();
    for (long c = 0; c < cycles; c++) {
        cycle_started = now_ns();
        for (long i = 0; i < p->n; i++)
            if (p->checked[i].run(p->checked[i].self))
                faults++;
        cycle_ended = now_ns();
    }
    return now_ns() - started;
}

// The kinds written out in the loop; where all are of one kind the compiler sees the one.
static inline __attribute__((always_inline)) void inlined(peer *p, int only)
{
    char *at = p->memory;
    for (long i = 0; i < p->n; i++) {
        single *s = (single *)at;
        int kind = only < 0 ? p->kinds[i] : only;
        switch (kind) {
        case GAIN: *s->y = s->k * *s->u; break;
        case LOWPASS: *s->y += s->k * (*s->u - *s->y); break;
        case LIMIT: *s->y = clamp(*s->u, s->k); break;
        default: pid_run(at);
        }
        at += kind == PID ? sizeof(pid) : sizeof(single);
    }
}

int64_t peer_inlined(peer *p, long cycles)
{
    int only = p->n ? p->kinds[0] : -1;
    for (long i = 1; i < p->n; i++)
        if (p->kinds[i] != only)
            only = -1;
    int64_t started = now_ns();
    for (long c = 0; c < cycles; c++) {
        cycle_started = now_ns();
        if (only == GAIN)
            inlined(p, GAIN);
        else if (only == PID)
            inlined(p, PID);
        else
            inlined(p, -1);
        cycle_ended = now_ns();
    }
    return now_ns() - started;
}

// 100 gains behind each other, written out in one function: each output is looked at and kept, as those of blocks are.
enum { WRITTEN_OUT = 100 };
static struct {
    double k[WRITTEN_OUT], y[WRITTEN_OUT];
} written_out;

static __attribute__((noinline)) int written_out_cycle(double u)
{
#pragma GCC unroll 100
    for (int i = 0; i < WRITTEN_OUT; i++) {
        u = written_out.k[i] * u;
        if (!isfinite(u))
            return 1;
        written_out.y[i] = u;
    }
    return 0;
}

int64_t peer_written_out(peer *p, long cycles)
{
    static volatile long faults;
    (void)p;
    for (int i = 0; i < WRITTEN_OUT; i++)
        written_out.k[i] = 1.0;
    int64_t started = now_ns();
    for (long c = 0; c < cycles; c++) {
        cycle_started = now_ns();
        if (written_out_cycle(1.0))
            faults++;
        cycle_ended = now_ns();
    }
    return now_ns() - started;
}
