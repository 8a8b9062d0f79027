// SPDX-License-Identifier: Apache-2.0
// What takes place at once is seen to: these blocks look at each other behind OpenGPAC's back, through memory of their module, as no
// block of an application does. They are for processors that are threads of one process.
#define _GNU_SOURCE
#include <opengpac.h>
#include <stdatomic.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static int64_t clock_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * 1000000000LL + now.tv_nsec;
}

// ---- two programs, each of which looks for the other: only with an instruction stream each do they ever meet ----

static atomic_int is_inside[2];

// Whether the other program was in the middle of an invocation too, some time within 20 ms.
static int meets(int mine)
{
    int met = 0;
    atomic_store(&is_inside[mine], 1);
    for (int64_t end = clock_ns() + 20000000; !met && clock_ns() < end;) met = atomic_load(&is_inside[!mine]);
    atomic_store(&is_inside[mine], 0);
    return met;
}

FUNCTION_BLOCK(up, "Counts up, and the invocations in which it met `down`.",
    out(double,  y,   "1, 2, 3, …"),
    out(int64_t, met, "how often so far"))
{
    self->y += 1;
    self->met += meets(0);
    return OK;
}

FUNCTION_BLOCK(down, "Counts down, and the invocations in which it met `up`.",
    out(double,  y,   "-1, -2, -3, …"),
    out(int64_t, met, "how often so far"))
{
    self->y -= 1;
    self->met += meets(1);
    return OK;
}

// ---- an invocation that lasts until somebody lets it return ----

static atomic_long inside_of;
static atomic_int may_return;

FUNCTION_BLOCK(held, "Computes at once (a = n, b = -n), and returns when `opens` has run.",
    out(double, a, "n"),
    out(double, b, "-n"))
{
    self->a += 1;
    self->b = -self->a;
    atomic_store(&may_return, 0);
    atomic_store(&inside_of, (long)self->a);
    for (int64_t end = clock_ns() + 20000000000; !atomic_load(&may_return) && clock_ns() < end;) {
    }
    atomic_store(&inside_of, 0);
    return OK;
}

FUNCTION_BLOCK(opens, "Lets `held` return.", out(int64_t, n, "how often so far"))
{
    atomic_store(&may_return, 1);
    self->n += 1;
    return OK;
}

FUNCTION_BLOCK(looks, "What is to be seen of `held` while it is in the middle of an invocation.",
    in_async(double,  a,      "n"),
    in_async(double,  b,      "-n"),
    out     (int64_t, inside, "the invocation that it is in now, 0: none"),
    out     (int64_t, looked, "looks while it was inside"),
    out     (int64_t, early,  "how many of them saw what it had not returned with yet"),
    out     (int64_t, torn,   "looks at any time that saw halves of two invocations"))
{
    self->inside = atomic_load(&inside_of);
    // What is read now was latched before: a value of the invocation that is still going on has come too early.
    if (self->inside != 0) {
        self->looked += 1;
        self->early += self->a >= (double)self->inside;
    }
    self->torn += self->a + self->b != 0;
    return OK;
}

// ---- a subroutine that works longer than its period ----

static atomic_int working;

FUNCTION_BLOCK(works, "Works for 3 ms, and watches what is around it.",
    in_async(double,  u,       "what others write meanwhile"),
    out     (int64_t, n,       "invocations so far"),
    out     (int64_t, others,  "how many of them found another one of this block at work"),
    out     (int64_t, changed, "how often its input changed while it ran"),
    out     (double,  newest,  "what it was"))
{
    const volatile double *u = &self->u;
    double first = *u;
    int found = atomic_fetch_add(&working, 1) != 0;
    for (int64_t end = clock_ns() + 3000000; clock_ns() < end;) {
        self->changed += *u != first;
        found |= atomic_load(&working) != 1;
    }
    atomic_fetch_sub(&working, 1);
    self->n += 1;
    self->others += found;
    self->newest = first;
    return OK;
}

FUNCTION_BLOCK(where, "On which thread it runs, and how often that changed.",
    out  (int64_t, thread,   "the one of this invocation"),
    out  (int64_t, moved,    "how often it was another than the one before"),
    out  (int64_t, n,        "invocations so far"))
{
    int64_t now = syscall(SYS_gettid);
    self->moved += self->n > 0 && now != self->thread;
    self->thread = now;
    self->n += 1;
    return OK;
}

FUNCTION_BLOCK(clocked, "The machine's own clock at each invocation, in ns.", out(int64_t, ns, "time since it was switched on"))
{
    self->ns = clock_ns();
    return OK;
}
