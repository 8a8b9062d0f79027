// SPDX-License-Identifier: Apache-2.0
// Blocks that change what belongs to the whole process, or end their thread.
#define _GNU_SOURCE
#include <opengpac.h>
#include <pthread.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>

static void returns(int number) { (void)number; }

FUNCTION_BLOCK(takes_a_handler, "Replaces the handler of SIGSEGV once.", out(double, y, "1"))
{
    if (!self->y)
        signal(SIGSEGV, returns);
    self->y = 1;
    return OK;
}

FUNCTION_BLOCK(drops_handlers, "Sets the handlers of SIGFPE and of spent time to their defaults once.", out(double, y, "1"))
{
    if (!self->y)
        signal(SIGFPE, SIG_DFL), signal(SIGXCPU, SIG_IGN);
    self->y = 1;
    return OK;
}

FUNCTION_BLOCK(crashes, "Reads through a null pointer.", out(double, y, "never stored"))
{
    static double *volatile nowhere;
    self->y = *nowhere;
    return OK;
}

FUNCTION_BLOCK(ends_its_thread, "Ends the thread that it runs on.", out(double, y, "never stored"))
{
    pthread_exit(0);
}

FUNCTION_BLOCK(gives_up_rights, "From its tenth invocation on its thread may read, write and end alone.", out(double, y, "1"))
{
    if (invocation->number == 10)
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT);
    self->y = 1;
    return OK;
}
