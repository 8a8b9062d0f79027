// SPDX-License-Identifier: Apache-2.0
// Whose code a signal has interrupted. Block code and our own may be left at any instruction: they hold no lock that others wait for. A
// library may hold one (malloc, stdio): it is left only in a function that is known to hold none.
#define _GNU_SOURCE
#include "foreign.h"
#include <dlfcn.h>
#include <link.h>
#include <stddef.h>
#include <ucontext.h>
#include <unwind.h>

enum { OURS_MAX = 4096, FRAMES_MAX = 64 };

typedef struct {
    uintptr_t start, end;
} range;

// Modules are never unloaded: it only grows. The count is stored last.
static range ours[OURS_MAX];
static volatile unsigned ours_count;
static range c_library, mathematics;
static uintptr_t harmless[64];
static volatile unsigned harmless_count;

// What blocks call by mistake with a bad address, and what ends them: none of it holds a lock while it runs.
static const char *const HARMLESS[] = {
    "abort", "raise", "pthread_kill", "__assert_fail", "__assert", "__assert_perror_fail", "__stack_chk_fail", "__chk_fail", "__memcpy_chk",
    "__memmove_chk", "__memset_chk", "__strcpy_chk", "__strcat_chk", "memcpy", "memmove", "memset", "memcmp", "memchr", "memrchr", "strlen",
    "strnlen", "strcmp", "strncmp", "strcpy", "strncpy", "stpcpy", "strcat", "strncat", "strchr", "strrchr", "strstr", "strcspn", "strspn",
    "atoi", "atol", "strtol", "strtoll", "strtoul", "strtoull", "abs", "labs", "div", "ldiv", "bsearch"};

typedef struct {
    uintptr_t address;
    range *found;
    unsigned count, room;
} question;

// The stretches of code of the object that holds an address.
static int of_object(struct dl_phdr_info *object, size_t size, void *argument)
{
    (void)size;
    question *asked = argument;
    int holds = 0;
    for (int i = 0; i < object->dlpi_phnum; i++) {
        const ElfW(Phdr) *part = &object->dlpi_phdr[i];
        uintptr_t start = object->dlpi_addr + part->p_vaddr;
        holds |= part->p_type == PT_LOAD && asked->address >= start && asked->address - start < part->p_memsz;
    }
    for (int i = 0; holds && i < object->dlpi_phnum && asked->count < asked->room; i++) {
        const ElfW(Phdr) *part = &object->dlpi_phdr[i];
        if (part->p_type == PT_LOAD && (part->p_flags & PF_X)) {
            uintptr_t start = object->dlpi_addr + part->p_vaddr;
            asked->found[asked->count++] = (range){start, start + part->p_memsz};
        }
    }
    return holds;
}

static int is_in(const range *where, uintptr_t place)
{
    return place >= where->start && place < where->end;
}

int foreign_is_ours(uintptr_t place)
{
    for (unsigned i = 0; i < ours_count; i++)
        if (is_in(&ours[i], place))
            return 1;
    return 0;
}

void opengpac_containment_trust(const void *address)
{
    if (foreign_is_ours((uintptr_t)address))
        return;
    question asked = {(uintptr_t)address, &ours[ours_count], 0, OURS_MAX - ours_count};
    dl_iterate_phdr(of_object, &asked);
    __atomic_store_n(&ours_count, ours_count + asked.count, __ATOMIC_RELEASE);
}

void foreign_prepare(void)
{
    if (harmless_count)
        return;
    for (unsigned i = 0; i < sizeof HARMLESS / sizeof *HARMLESS; i++) {
        void *found = dlsym(RTLD_DEFAULT, HARMLESS[i]);
        if (found)
            harmless[harmless_count++] = (uintptr_t)found;
    }
    void *sine = dlsym(RTLD_DEFAULT, "sin");
    question c = {(uintptr_t)dlsym(RTLD_DEFAULT, "abort"), &c_library, 0, 1}, m = {(uintptr_t)sine, &mathematics, 0, 1};
    dl_iterate_phdr(of_object, &c);
    dl_iterate_phdr(of_object, &m);
}

uintptr_t foreign_place(const void *context)
{
    const ucontext_t *of = context;
#if defined(__x86_64__)
    return (uintptr_t)of->uc_mcontext.gregs[REG_RIP];
#elif defined(__aarch64__)
    return (uintptr_t)of->uc_mcontext.pc;
#elif defined(__riscv)
    return (uintptr_t)of->uc_mcontext.__gregs[REG_PC];
#else
    (void)of;
    return 0;
#endif
}

uintptr_t foreign_caller(const void *context, uintptr_t place, const void *address)
{
    if (place != (uintptr_t)address)
        return place;
    const ucontext_t *of = context;
#if defined(__x86_64__)
    return *(const uintptr_t *)of->uc_mcontext.gregs[REG_RSP];
#elif defined(__aarch64__)
    return (uintptr_t)of->uc_mcontext.regs[30];
#elif defined(__riscv)
    return (uintptr_t)of->uc_mcontext.__gregs[REG_RA];
#else
    (void)of;
    return place;
#endif
}

typedef struct {
    uintptr_t place, entered;
    int is_reached, frames;
} walk;

// Goes up from the interrupted place to where the C library was entered.
static _Unwind_Reason_Code visit(struct _Unwind_Context *frame, void *argument)
{
    walk *on = argument;
    int is_before = 0;
    uintptr_t at = (uintptr_t)_Unwind_GetIPInfo(frame, &is_before);
    if (!on->is_reached && at != on->place)
        return ++on->frames > FRAMES_MAX ? _URC_END_OF_STACK : _URC_NO_REASON;
    // A return address may lie behind the end of what has called.
    uintptr_t inside = on->is_reached && !is_before ? at - 1 : at;
    on->is_reached = 1;
    if (!is_in(&c_library, inside) || ++on->frames > FRAMES_MAX)
        return _URC_END_OF_STACK;
    on->entered = (uintptr_t)_Unwind_FindEnclosingFunction((void *)inside);
    return _URC_NO_REASON;
}

int foreign_is_harmless(uintptr_t place)
{
    if (is_in(&mathematics, place))
        return 1;
    walk up = {place, 0, 0, 0};
    _Unwind_Backtrace(visit, &up);
    for (unsigned i = 0; i < harmless_count; i++)
        if (harmless[i] == up.entered)
            return 1;
    return 0;
}

int foreign_step(void *context, int on)
{
#if defined(__x86_64__)
    enum { TRAP_FLAG = 0x100 };
    ucontext_t *of = context;
    if (on)
        of->uc_mcontext.gregs[REG_EFL] |= TRAP_FLAG;
    else
        of->uc_mcontext.gregs[REG_EFL] &= ~(greg_t)TRAP_FLAG;
    return 1;
#else
    (void)context, (void)on;
    return 0;
#endif
}
