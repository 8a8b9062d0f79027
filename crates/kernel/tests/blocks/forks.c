// SPDX-License-Identifier: Apache-2.0
// Blocks that make processes; `child` is the last one's number.
#define _GNU_SOURCE
#include <opengpac.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <unistd.h>

FUNCTION_BLOCK(calls_fork, "Calls fork() once.", out(int64_t, child, "its process"))
{
    if (!self->child)
        self->child = fork();
    return OK;
}

FUNCTION_BLOCK(forks_unseen, "Forks once without the C library, which calls no handler.", out(int64_t, child, "its process"))
{
    if (!self->child)
        self->child = syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0);
    return OK;
}

FUNCTION_BLOCK(forks_in_a_loop, "Forks once, and the copy does not come back.", out(int64_t, child, "its process"))
{
    if (!self->child) {
        self->child = fork();
        while (!self->child) {
        }
    }
    return OK;
}

FUNCTION_BLOCK(spawns, "Starts a program once.", out(int64_t, child, "its process"))
{
    if (!self->child) {
        char *arguments[] = {"true", 0}, *environment[] = {0};
        pid_t started = -1;
        posix_spawnp(&started, "true", 0, 0, arguments, environment);
        self->child = started;
    }
    return OK;
}
