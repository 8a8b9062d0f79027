// SPDX-License-Identifier: Apache-2.0
// Blocks that are ended in code that is not theirs, and blocks that end themselves.
#define _GNU_SOURCE
#include <opengpac.h>
#include <assert.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LOOPS(NAME, WHAT) FUNCTION_BLOCK(NAME, WHAT, out(double, y, "never stored"))

LOOPS(allocates, "Allocates and frees without end.")
{
    for (;;) {
        void *volatile memory[8];
        for (int i = 0; i < 8; i++) memory[i] = malloc((size_t)16 << i * 2);
        for (int i = 0; i < 8; i++) free(memory[i]);
    }
}

LOOPS(allocates_much, "Allocates and frees what lies in arenas and maps, without end.")
{
    for (;;) {
        char *volatile memory = malloc(100000);
        memory = realloc(memory, 3000);
        memory[0] = 1;
        free(memory);
    }
}

LOOPS(prints, "Prints without end.")
{
    static FILE *file;
    if (!file) file = fopen("/dev/null", "w");
    for (int i = 0;; i++) fprintf(file, "%d %f %s\n", i, i * 0.5, "line");
}

LOOPS(prints_unbuffered, "Writes without end: nearly all of the time is the system's.")
{
    static FILE *file;
    if (!file) setvbuf(file = fopen("/dev/null", "w"), NULL, _IONBF, 0);
    for (;;) fputs("a line\n", file);
}

LOOPS(formats, "Formats without end.")
{
    char text[200];
    for (int i = 0;; i++) snprintf(text, sizeof text, "%d %g", i, i * 0.1);
}

LOOPS(waits, "Waits for what never comes.")
{
    for (;;) pause();
}

LOOPS(is_stuck, "Reads from a pipe into which nobody writes.")
{
    int ends[2];
    char byte;
    if (pipe(ends) == 0 && read(ends[0], &byte, 1) == 1) self->y = byte;
    return OK;
}

LOOPS(measures_nothing, "The length of no text.")
{
    const char *volatile text = NULL;
    self->y = (double)strlen(text);
    return OK;
}

LOOPS(copies_to_nothing, "Copies to nowhere.")
{
    char *volatile to = NULL;
    char from[500];
    memset(from, (int)invocation->number, sizeof from);
    memcpy(to, from, 400 + invocation->number % 2);
    return OK;
}

LOOPS(calls_nothing, "Calls a function that is not there.")
{
    void (*volatile function)(void) = NULL;
    function();
    return OK;
}

LOOPS(prints_nothing, "Prints a text that is not there, into a file that is locked meanwhile.")
{
    static FILE *file;
    if (!file) file = fopen("/dev/null", "w");
    const char *volatile text = (const char *)8;
    fprintf(file, "%s %d\n", text, 1);
    return OK;
}

LOOPS(frees_twice, "Frees what is free: the heap notices, and aborts with its lock held.")
{
    char *volatile memory = malloc(3000), *volatile again = memory;
    free(memory);
    free(again);
    return OK;
}

LOOPS(aborts, "Calls abort().")
{
    abort();
}

LOOPS(asserts, "Asserts what is not so.")
{
    assert(self->y > 1);
    return OK;
}

LOOPS(traps, "A breakpoint of a debugger that is not there.")
{
#if defined(__x86_64__)
    __asm__ volatile("int3");
#else
    raise(SIGTRAP);
#endif
    return OK;
}

LOOPS(raises, "Raises a signal itself.")
{
    raise(SIGSEGV);
    return OK;
}

LOOPS(is_deaf, "Masks every signal, and does not return.")
{
    sigset_t all;
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, NULL);
    for (volatile int on = 1; on;) {}
    return OK;
}

LOOPS(exits, "Calls exit().")
{
    exit(3);
}
