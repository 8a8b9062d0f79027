// SPDX-License-Identifier: Apache-2.0
// Containment: runs a step loop so that a signal inside block code ends the loop, not the process.
//
// One `sigsetjmp` a firing (5 ns; no signal mask is saved: what handlers block is let through again after a jump). The
// kernel writes `step` before each call of a block; it is OUTSIDE_BLOCKS while no block runs. Containments of one thread nest where the
// virtual clock preempts: `outer` is the one below.
//
// An invocation stores all of its outputs or none. A signal that its entry can wait for (a spent budget) ends it only while it is marked as
// running (abi.rs); once it stores it finishes, and the loop looks at `late` when it is through.
//
// A jump out of a library may leave a lock of that library held for ever (malloc, stdio). So an invocation that has used up its budget there
// goes on, an instruction at a time, until it is back in the block's own code; what crashes there, or does not come back, is `lost`: its
// thread must not call such a library again, and the process is not to be trusted any more.
#define _GNU_SOURCE
#include "foreign.h"
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sysexits.h>
#include <time.h>
#include <unistd.h>

#define OUTSIDE_BLOCKS UINT32_MAX
#define RUNNING ((uint64_t)1 << 63) // abi.rs: in the first word of an instance
#define WATCHED ((uint64_t)1 << 62) // floats.rs: the rest of that word is the address of the instance

// One call of the step loop (table.rs): every instance begins with the word that holds its mark.
typedef struct {
    void *run;
    const volatile uint64_t *instance;
    const void *invocation;
} opengpac_call;

typedef struct opengpac_containment {
    volatile uint32_t step;
    volatile uint32_t armed;
    volatile int64_t started_ns; // 0: no loop runs
    volatile int64_t budget_ns;
    volatile int64_t spent_ns; // `started_ns` of the loop that the watchdog has found to have spent its budget
    const opengpac_call *volatile calls;
    volatile uint32_t late;  // 1 + the step in which the budget ran out; 0: it has not
    volatile uint32_t lost;  // it was ended in code that may hold a lock
    volatile uint32_t heard; // the budget's signal has come through
    volatile uint32_t forked; // 1 + the step that has called fork(); 0: none has
    volatile uint32_t charged; // waits for a core do not count, so that the clock does not tell whether the budget is spent
    volatile uint32_t handling; // a handler of ours runs for it: what interrupts that is not what it looks at
    volatile int64_t foreign_ns; // since when it is led out of foreign code; 0: it is not
    volatile uint32_t steps, steps_seen;
    struct opengpac_containment *outer;
    sigjmp_buf place;
} opengpac_containment;

static _Thread_local opengpac_containment *volatile current __attribute__((tls_model("initial-exec")));
static struct sigaction earlier[NSIG];
static volatile sig_atomic_t passed_on[NSIG];
static int budget_signal;
static const volatile uint32_t *here; // 0 in a process that was forked from this one

static int64_t time_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

// What says that time is spent. It waits while a handler runs: what it would interrupt there is our code, and below it may be a library's.
static sigset_t of_time(void)
{
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGXCPU);
    sigaddset(&signals, budget_signal);
    return signals;
}

size_t opengpac_containment_size(void)
{
    return sizeof(opengpac_containment);
}

static int is_in_a_block(const opengpac_containment *containment)
{
    return containment && containment->armed && containment->step != OUTSIDE_BLOCKS;
}

// A child that was forked by what runs here, by whatever call: nothing of it may go on. A containment lies in memory that it does not have.
static void end_if_child(void)
{
    if (current && !*here)
        _exit(EX_SOFTWARE);
}

// The same before fork() returns there.
static void in_the_child(void)
{
    if (current)
        _exit(EX_SOFTWARE);
}

// A block that makes a process is told of.
static void in_the_parent(void)
{
    if (is_in_a_block(current))
        current->forked = current->step + 1;
}

// The end of the process while a block runs is not without a word. The thread is called as its source is.
static void last_word(const char *what)
{
    char text[256] = "opengpac: the process ", name[16] = "?";
    prctl(PR_GET_NAME, name);
    strcat(text, what);
    strcat(text, " while a block ran on interrupt source '");
    strcat(text, name);
    strcat(text, "'\n");
    if (write(STDERR_FILENO, text, strlen(text)) < 0)
        return; // nobody is there to read it
}

// What is not ours goes to the handler that was there before.
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
        if (is_in_a_block(current))
            last_word("was ended by a signal that was sent to the process");
        signal(number, SIG_DFL);
        // A fault comes again by itself when its instruction does.
        if (what->si_code <= 0 || number == SIGXCPU)
            raise(number);
    } else if (before->sa_handler != SIG_IGN) {
        before->sa_handler(number);
    }
    passed_on[number] = 0;
}

// How an invocation may come back from foreign code: in so many instructions (printf takes some thousands, each trap some microseconds), and
// where it takes none, since it waits, in this time.
enum { STEPS_MAX = 50 * 1000, WAIT_MAX_NS = 300 * 1000 * 1000 };

// Something was left in code that may hold a lock: at its end the process must not wait for it.
static volatile sig_atomic_t untrusted;

static void leave(opengpac_containment *containment, int number, int is_lost)
{
    if (is_lost)
        untrusted = 1;
    containment->lost = is_lost;
    siglongjmp(containment->place, number);
}

// Stands for the signal where a block has ended its thread (fault.rs).
enum { ENDED_ITS_THREAD = 0xfd };

// A block that calls pthread_exit() unwinds its thread up to here. It stays, to say so, and runs nothing more: its source is lost.
static void is_left(opengpac_containment *const *containment)
{
    if ((*containment)->armed)
        leave(*containment, ENDED_ITS_THREAD, 1);
}

// Runs `body(argument)`. 0 when it returned, else the signal that ended it.
int opengpac_containment_run(opengpac_containment *containment, void (*body)(void *), void *argument, int64_t started_ns)
{
    containment->outer = current;
    containment->step = OUTSIDE_BLOCKS;
    containment->late = containment->lost = containment->heard = containment->forked = containment->handling = 0;
    containment->foreign_ns = 0;
    containment->started_ns = started_ns;
    __attribute__((cleanup(is_left))) opengpac_containment *left = containment;
    int ended_by = sigsetjmp(containment->place, 0);
    if (ended_by == 0) {
        containment->armed = 1;
        current = containment;
        body(argument);
    } else {
        // Out of a handler, in which they wait.
        sigset_t waiting = of_time();
        pthread_sigmask(SIG_UNBLOCK, &waiting, NULL);
    }
    containment->armed = 0;
    containment->started_ns = 0;
    current = containment->outer;
    return ended_by;
}

// True where what was interrupted at `place` may be left.
static int may_be_left(uintptr_t place)
{
    return foreign_is_ours(place) || foreign_is_harmless(place);
}

// A block has done what no block may.
static void faulted(opengpac_containment *containment, int number, siginfo_t *what, const void *context)
{
    uintptr_t place = foreign_place(context);
    if (number == SIGSEGV || number == SIGBUS)
        place = foreign_caller(context, place, what->si_addr);
    leave(containment, number, !may_be_left(place));
}

// The invocation that runs has stored nothing so far.
static int may_be_ended(const opengpac_containment *containment)
{
    uint64_t mark = *containment->calls[containment->step].instance;
    if (mark & WATCHED)
        mark = *(const volatile uint64_t *)(uintptr_t)(mark & ~WATCHED);
    return (mark & RUNNING) != 0;
}

// One instruction further on the way out of foreign code.
static void stepped(opengpac_containment *containment, void *context)
{
    if (!is_in_a_block(containment) || !may_be_ended(containment)) {
        containment->foreign_ns = 0;
        foreign_step(context, 0);
    } else if (foreign_is_ours(foreign_place(context))) {
        leave(containment, budget_signal, 0);
    } else if (containment->steps++ >= STEPS_MAX) {
        leave(containment, budget_signal, 1);
    }
}

// True for the trap after a single instruction. Linux reports it as TRAP_TRACE, or as TRAP_BRKPT if the cause was lost from DR6, which happens in
// virtual machines under load. A breakpoint instruction has SI_KERNEL.
static int is_single_step(int number, const siginfo_t *what)
{
    return number == SIGTRAP && (what->si_code == TRAP_TRACE || what->si_code == TRAP_BRKPT);
}

static void fault(int number, siginfo_t *what, void *context)
{
    end_if_child();
    opengpac_containment *containment = current;
    // Of a handler: the stack that it walked up is not one.
    if (is_in_a_block(containment) && containment->handling && what->si_code > 0)
        leave(containment, number, 1);
    if (containment)
        containment->handling = 1;
    if (is_single_step(number, what) && containment && containment->foreign_ns) {
        stepped(containment, context);
        containment->handling = 0;
        return;
    }
    if (is_in_a_block(containment)) {
        if (what->si_code > 0)
            faulted(containment, number, what, context);
        // By itself, as abort() and raise() do; what another thread or process sends is not a fault of the block.
        if (what->si_code == SI_TKILL && what->si_pid == getpid() && !foreign_is_ours(foreign_place(context))) {
            int is_harmless = may_be_left(foreign_place(context));
            if (is_harmless || number == SIGABRT)
                leave(containment, number, !is_harmless);
        }
    }
    if (containment)
        containment->handling = 0;
    pass_on(number, what, context);
}

// The budget is spent: the block that runs now is late. It is ended unless it stores, or is in foreign code.
static void is_late(opengpac_containment *containment, void *context)
{
    if (!containment->late)
        containment->late = containment->step + 1;
    if (!may_be_ended(containment))
        return;
    if (may_be_left(foreign_place(context)))
        leave(containment, budget_signal, 0);
    if (!containment->foreign_ns) {
        containment->steps = 0;
        containment->foreign_ns = time_ns();
    } else if (containment->steps == containment->steps_seen && time_ns() - containment->foreign_ns > WAIT_MAX_NS) {
        leave(containment, budget_signal, 1);
    }
    containment->steps_seen = containment->steps;
    foreign_step(context, 1);
}

static int is_spent(const opengpac_containment *containment)
{
    int64_t started_ns = containment->started_ns;
    return started_ns && (containment->spent_ns == started_ns || (!containment->charged && time_ns() - started_ns > containment->budget_ns));
}

// The watchdog sends this signal to the thread of a loop whose budget is spent. It may come late, in another loop, so it looks for itself.
static void budget(int number, siginfo_t *what, void *context)
{
    end_if_child();
    opengpac_containment *containment = current;
    if (containment)
        containment->heard = 1;
    if (is_in_a_block(containment) && !containment->handling && containment->started_ns && (number == SIGXCPU || is_spent(containment))) {
        containment->handling = 1;
        is_late(containment, context);
        containment->handling = 0;
    }
    // RLIMIT_RTTIME ran out on a thread that is none of ours.
    if (number == SIGXCPU && !containment)
        pass_on(number, what, context);
}

// The end of the process: what flushes and frees after us would wait for a lock that nobody gives back.
static void at_exit(int status, void *argument)
{
    (void)argument;
    if (is_in_a_block(current))
        last_word("was ended by exit()");
    if (untrusted)
        _exit(status);
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
    action.sa_mask = of_time();
    action.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_NODEFER | flags;
    action.sa_sigaction = handler;
    return sigaction(number, &action, &earlier[number]);
}

static const int faults[] = {SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGTRAP, SIGABRT};
enum { FAULTS = sizeof faults / sizeof *faults };

// A signal whose handler is not ours any more; `by`: the handler that is there, or nothing (default, ignored). 0: all are in place.
int opengpac_containment_replaced(const void **by)
{
    for (int i = 0; i < FAULTS + 2; i++) {
        int number = i < FAULTS ? faults[i] : i == FAULTS ? SIGXCPU : budget_signal;
        struct sigaction present;
        if (sigaction(number, NULL, &present) != 0 || ((present.sa_flags & SA_SIGINFO) && present.sa_sigaction == (i < FAULTS ? fault : budget)))
            continue;
        *by = (present.sa_flags & SA_SIGINFO) || (present.sa_handler != SIG_DFL && present.sa_handler != SIG_IGN) ? (const void *)present.sa_sigaction : NULL;
        return number;
    }
    return 0;
}

// Installs the handlers, or puts them in front again where somebody else's have come before them (a crash reporter that was
// switched on later). One thread at a time. `word` is 0 in every child. Gives the signal of a spent budget, or -1.
int opengpac_containment_install(const uint32_t *word)
{
    if (!budget_signal) {
        foreign_prepare();
        opengpac_containment_trust(opengpac_containment_install);
        on_exit(at_exit, NULL);
        here = word;
        pthread_atfork(NULL, in_the_parent, in_the_child);
    }
    // The first real-time signal that nobody has taken.
    for (int signal = SIGRTMIN + 3; !budget_signal && signal < SIGRTMAX; signal++) {
        struct sigaction present;
        if (sigaction(signal, NULL, &present) == 0 && !(present.sa_flags & SA_SIGINFO) && present.sa_handler == SIG_DFL)
            budget_signal = signal;
    }
    if (!budget_signal || put_in_front(budget_signal, budget, SA_RESTART) != 0 || put_in_front(SIGXCPU, budget, SA_RESTART) != 0)
        return -1;
    for (int i = 0; i < FAULTS; i++)
        if (put_in_front(faults[i], fault, 0) != 0)
            return -1;
    return budget_signal;
}
