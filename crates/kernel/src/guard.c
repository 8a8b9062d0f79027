// SPDX-License-Identifier: Apache-2.0
// The guard: runs a step loop so that a signal inside block code ends the loop, not the process.
//
// One `sigsetjmp` a firing (5 ns; no signal mask is saved, since the handlers are installed with SA_NODEFER and an empty mask). The
// kernel writes `step` before each call of a block; it is GUARD_OUTSIDE while no block runs. Guards of one thread nest where the
// virtual clock preempts: `outer` is the one below.
#include <setjmp.h>
#include <signal.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#define GUARD_OUTSIDE UINT32_MAX

typedef struct opengpac_guard {
    volatile uint32_t step;
    volatile uint32_t armed;
    volatile int64_t started_ns; // 0: no loop runs
    volatile int64_t budget_ns;
    struct opengpac_guard *outer;
    sigjmp_buf place;
} opengpac_guard;

static _Thread_local opengpac_guard *volatile current __attribute__((tls_model("initial-exec")));
static struct sigaction earlier[NSIG];
static volatile sig_atomic_t passed_on[NSIG];
static int budget_signal;

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

size_t opengpac_guard_size(void)
{
    return sizeof(opengpac_guard);
}

// Runs `body(argument)`. 0 when it returned, else the signal that ended it.
int opengpac_guard_run(opengpac_guard *guard, void (*body)(void *), void *argument, int64_t started_ns)
{
    guard->outer = current;
    guard->step = GUARD_OUTSIDE;
    guard->started_ns = started_ns;
    int ended_by = sigsetjmp(guard->place, 0);
    if (ended_by == 0) {
        guard->armed = 1;
        current = guard;
        body(argument);
    }
    guard->armed = 0;
    guard->started_ns = 0;
    current = guard->outer;
    return ended_by;
}

// What is not ours goes to whoever was there before.
static void pass_on(int number, siginfo_t *what, void *context)
{
    const struct sigaction *before = &earlier[number];
    // One before us that hands it back to us has had its turn.
    if (passed_on[number]) {
        signal(number, SIG_DFL);
        raise(number);
        return;
    }
    passed_on[number] = number != SIGXCPU;
    if (before->sa_flags & SA_SIGINFO) {
        before->sa_sigaction(number, what, context);
    } else if (before->sa_handler == SIG_DFL) {
        signal(number, SIG_DFL);
        // A fault comes again by itself when its instruction does.
        if (what->si_code <= 0 || number == SIGXCPU)
            raise(number);
    } else if (before->sa_handler != SIG_IGN) {
        before->sa_handler(number);
    }
    passed_on[number] = 0;
}

static void fault(int number, siginfo_t *what, void *context)
{
    opengpac_guard *guard = current;
    // A signal that a process sent (si_code <= 0) is not a fault of the block.
    if (guard && guard->armed && guard->step != GUARD_OUTSIDE && what->si_code > 0)
        siglongjmp(guard->place, number);
    pass_on(number, what, context);
}

// The watchdog sends this signal to the thread of a loop that is too old. It may come late, so it looks for itself.
static void budget(int number, siginfo_t *what, void *context)
{
    opengpac_guard *guard = current;
    if (guard && guard->armed && guard->step != GUARD_OUTSIDE && guard->started_ns)
        if (number == SIGXCPU || now_ns() - guard->started_ns > guard->budget_ns)
            siglongjmp(guard->place, budget_signal);
    // RLIMIT_RTTIME ran out on a thread that is none of ours.
    if (number == SIGXCPU && !guard)
        pass_on(number, what, context);
}

// Puts `handler` in front for a signal, unless it is there.
static int put_in_front(int number, void (*handler)(int, siginfo_t *, void *), int flags)
{
    struct sigaction action, present;
    if (sigaction(number, NULL, &present) != 0)
        return -1;
    if ((present.sa_flags & SA_SIGINFO) && present.sa_sigaction == handler)
        return 0;
    memset(&action, 0, sizeof action);
    sigemptyset(&action.sa_mask);
    action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_NODEFER | flags;
    action.sa_sigaction = handler;
    return sigaction(number, &action, &earlier[number]);
}

// Installs the handlers, or puts them in front again where somebody else's have come before them (a crash reporter that was
// switched on later). One thread at a time. Gives the signal of a spent budget, or -1.
int opengpac_guard_install(void)
{
    static const int faults[] = {SIGSEGV, SIGFPE, SIGBUS, SIGILL};
    for (unsigned i = 0; i < sizeof faults / sizeof *faults; i++)
        if (put_in_front(faults[i], fault, 0) != 0)
            return -1;
    if (put_in_front(SIGXCPU, budget, SA_RESTART) != 0)
        return -1;
    if (budget_signal)
        return budget_signal;
    // The first real-time signal that nobody has taken.
    for (int signal = SIGRTMIN + 3; signal < SIGRTMAX; signal++) {
        struct sigaction present;
        if (sigaction(signal, NULL, &present) == 0 && !(present.sa_flags & SA_SIGINFO) && present.sa_handler == SIG_DFL) {
            budget_signal = signal;
            return put_in_front(signal, budget, SA_RESTART) == 0 ? signal : -1;
        }
    }
    return -1;
}
