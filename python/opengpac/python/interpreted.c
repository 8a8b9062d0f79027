// SPDX-License-Identifier: Apache-2.0
// A block whose body is a function of Python. The interpreter is that of the process; nothing is linked with it.
#define _GNU_SOURCE
#define opengpac_module opengpac_module_of_header
#include <opengpac.h>
#undef opengpac_module
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

// As `Slot` of interpreting.py has it. `call` returns 0, or 1 and leaves the reason in `what`.
static struct {
    int32_t (*call)(void **items, uint64_t number, int64_t time_ns, int64_t now_ns);
    const char *payload;
    char what[201];
} opengpac_python;

static int opengpac_is_apart;

// Calls Python with `at`, the address of the slot.
static void opengpac_make(void) {
    int (*ensure)(void) = (int (*)(void))dlsym(RTLD_DEFAULT, "PyGILState_Ensure");
    void (*release)(int) = (void (*)(int))dlsym(RTLD_DEFAULT, "PyGILState_Release");
    int (*run)(const char *) = (int (*)(const char *))dlsym(RTLD_DEFAULT, "PyRun_SimpleString");
    opengpac_python.payload = OPENGPAC_PAYLOAD;
    strcpy(opengpac_python.what, "there is no Python in its process");
    if (!ensure || !release || !run) return;
    char text[200];
    snprintf(text, sizeof text, "exec(__import__('ctypes').string_at(%lu).decode(), {'at': %lu})\n",
             (unsigned long)(uintptr_t)OPENGPAC_BOOTSTRAP, (unsigned long)(uintptr_t)&opengpac_python);
    int state = ensure();
    run(text);
    release(state);
}

// Whether this process was started for processors: there the function is made when the code comes, on a thread that may wait.
static int opengpac_apart(void) {
    char line[4096];
    int file = open("/proc/self/cmdline", O_RDONLY | O_CLOEXEC);
    if (file < 0) return 0;
    ssize_t length = read(file, line, sizeof line);
    close(file);
    return length > 0 && (memmem(line, (size_t)length, "\0run_processor", 15) || memmem(line, (size_t)length, "\0join", 6));
}

__attribute__((visibility("default"))) const opengpac_module_table *opengpac_module(void) {
    if (!opengpac_is_apart && opengpac_apart()) {
        opengpac_is_apart = 1;
        opengpac_make();
    }
    return opengpac_module_of_header();
}

// Why it failed, or nothing.
static const char *opengpac_call_python(const Invocation *invocation, void **items, double *took) {
    if (!opengpac_is_apart) {
        // Here the virtual clock or a trial calls, on a thread of Python. A real-time thread must not wait for Python.
        void *(*known)(void) = (void *(*)(void))dlsym(RTLD_DEFAULT, "PyGILState_GetThisThreadState");
        if (!known || !known()) return "it is Python, for which no other block may wait: place it on a processor with process=True";
        if (!opengpac_python.call) opengpac_make();
    }
    if (!opengpac_python.call) return opengpac_python.what;
    struct timespec begun, ended;
    clock_gettime(CLOCK_MONOTONIC, &begun);
    int32_t status = opengpac_python.call(items, invocation->number, invocation->time_ns, invocation->now_ns);
    clock_gettime(CLOCK_MONOTONIC, &ended);
    if (opengpac_is_apart) *took = (double)(ended.tv_sec - begun.tv_sec) + 1e-9 * (double)(ended.tv_nsec - begun.tv_nsec);
    return status ? opengpac_python.what : NULL;
}
