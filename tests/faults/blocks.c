// SPDX-License-Identifier: Apache-2.0
// Blocks that fail on command, each in its own way, in the invocation whose number is `at`.
#include <opengpac.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

/* Leaves the instant of the fault, CLOCK_MONOTONIC in ns, in the file that the campaign names: nothing else could tell it afterwards. */
static void leave_the_instant(void)
{
    const char *path = getenv("OPENGPAC_FAULT_INSTANT");
    int file = path ? open(path, O_CREAT | O_WRONLY | O_TRUNC, 0600) : -1;
    if (file < 0) return;
    struct timespec now;
    char text[32];
    clock_gettime(CLOCK_MONOTONIC, &now);
    int len = snprintf(text, sizeof text, "%lld", now.tv_sec * 1000000000LL + now.tv_nsec);
    if (write(file, text, (size_t)len) == len) close(file);
}

FUNCTION_BLOCK(segfaults, "Reads through a null pointer.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    static int64_t here = 1;
    if (self->k >= self->at) leave_the_instant();
    volatile int64_t *volatile p = self->k >= self->at ? (int64_t *)0 : &here;
    self->k += *p;
    return OK;
}

FUNCTION_BLOCK(divides, "Divides by zero.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    if (self->k >= self->at) leave_the_instant();
    volatile int one = 1, divisor = self->k >= self->at ? 0 : 1;
    self->k += one / divisor;
    return OK;
}

FUNCTION_BLOCK(illegal, "Executes what is no instruction.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    if (self->k >= self->at) {
        leave_the_instant();
        __builtin_trap();
    }
    self->k++;
    return OK;
}

FUNCTION_BLOCK(runs_away, "Never returns.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    volatile int on = self->k >= self->at;
    if (on) leave_the_instant();
    while (on) {}
    self->k++;
    return OK;
}

FUNCTION_BLOCK(aborts, "Calls abort().", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    if (self->k >= self->at) {
        leave_the_instant();
        abort();
    }
    self->k++;
    return OK;
}

FUNCTION_BLOCK(ends_its_process, "Ends its process with SIGABRT, whatever guards it.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    if (self->k >= self->at) {
        leave_the_instant();
        signal(SIGABRT, SIG_DFL);
        abort();
    }
    self->k++;
    return OK;
}

FUNCTION_BLOCK(allocates, "Allocates and frees without end.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    if (self->k >= self->at) leave_the_instant();
    while (self->k >= self->at) {
        char *volatile memory = malloc((size_t)(self->k % 1000) + 1);
        free(memory);
    }
    self->k++;
    return OK;
}

FUNCTION_BLOCK(prints, "Prints without end.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    static FILE *file;
    if (self->k >= self->at) leave_the_instant();
    while (self->k >= self->at) {
        if (!file) file = fopen("/dev/null", "w");
        fprintf(file, "%lld %g\n", (long long)self->k, (double)self->k);
    }
    self->k++;
    return OK;
}

FUNCTION_BLOCK(waits, "Reads from a pipe into which nobody writes.", param(int64_t, at, 10, "invocation that fails"), out(int64_t, k, "invocations"))
{
    int ends[2];
    char byte;
    if (self->k >= self->at) {
        leave_the_instant();
        if (pipe(ends) == 0 && read(ends[0], &byte, 1) == 1) self->k += byte;
    }
    self->k++;
    return OK;
}

FUNCTION_BLOCK(counts, "Counts, and does not fail.", out(int64_t, k, "invocations"))
{
    self->k++;
    return OK;
}
