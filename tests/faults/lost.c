// SPDX-License-Identifier: Apache-2.0
// Blocks after which nothing comes from the thread that they run on.
#define _GNU_SOURCE
#include <linux/seccomp.h>
#include <opengpac.h>
#include <signal.h>
#include <sys/prctl.h>

FUNCTION_BLOCK(gives_up_rights, "From its tenth invocation on its thread may read, write and end alone.", out(double, y, "1"))
{
    if (invocation->number == 10)
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT);
    self->y = 1;
    return OK;
}

FUNCTION_BLOCK(masks_signals, "In its tenth invocation it masks every signal, and does not return.", out(double, y, "1"))
{
    if (invocation->number == 10) {
        sigset_t all;
        sigfillset(&all);
        sigprocmask(SIG_SETMASK, &all, NULL);
        for (volatile int on = 1; on;) {}
    }
    self->y = 1;
    return OK;
}
