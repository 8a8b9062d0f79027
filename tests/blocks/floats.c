// SPDX-License-Identifier: Apache-2.0
#define _GNU_SOURCE
#include <fenv.h>
#include <opengpac.h>

// Attacks on floating-point state, and whether the block then ends as one should.
enum { UPWARD, DOWNWARD, TOWARD_ZERO, FLUSH, DENORMALS_ARE_ZERO, TRAP_DIVISION, TRAP_ALL, X87_PRECISION, X87_ROUNDING, X87_PENDING, ENVIRONMENT, MMX, X87_STACK };
enum { RETURNS, FAULTS, CRASHES, STAYS };

#ifdef __x86_64__
static void add_mxcsr(unsigned bits) {
    unsigned words;
    __asm__ volatile("stmxcsr %0" : "=m"(words));
    words |= bits;
    __asm__ volatile("ldmxcsr %0" : : "m"(words));
}
static void set_x87(unsigned short words) { __asm__ volatile("fnclex; fldcw %0" : : "m"(words)); }
static void leave_mmx(void) { __asm__ volatile("pxor %%mm0, %%mm0" : : : "mm0"); }
static void leave_one(void) { __asm__ volatile("fld1"); }
#else
static void add_mxcsr(unsigned bits) { (void)bits; fesetround(FE_UPWARD); }
static void set_x87(unsigned short words) { (void)words; fesetround(FE_UPWARD); }
static void leave_mmx(void) { fesetround(FE_UPWARD); }
static void leave_one(void) { fesetround(FE_UPWARD); }
#endif

static void attack(int32_t kind) {
    fenv_t all;
    switch (kind) {
    case UPWARD: fesetround(FE_UPWARD); break;
    case DOWNWARD: fesetround(FE_DOWNWARD); break;
    case TOWARD_ZERO: fesetround(FE_TOWARDZERO); break;
    case FLUSH: add_mxcsr(0x8000); break;
    case DENORMALS_ARE_ZERO: add_mxcsr(0x40); break;
    case TRAP_DIVISION: feenableexcept(FE_DIVBYZERO); break;
    case TRAP_ALL: feclearexcept(FE_ALL_EXCEPT); feenableexcept(FE_ALL_EXCEPT); break;
    case X87_PRECISION: set_x87(0x27f); break;
    case X87_ROUNDING: set_x87(0xb7f); break;
    case X87_PENDING:
        set_x87(0x37b);
#ifdef __x86_64__
        // The next user of the x87 gets the signal.
        __asm__ volatile("fld1; fldz; fdivrp");
#endif
        break;
    case ENVIRONMENT: fegetenv(&all); fesetround(FE_DOWNWARD); feenableexcept(FE_INVALID); feupdateenv(&all); fesetround(FE_UPWARD); break;
    case MMX: leave_mmx(); break;
    case X87_STACK: leave_one(); break;
    }
}

FUNCTION_BLOCK(attack, "y = invocation number; changes floating-point state at invocation `at`.",
    out  (double, y, "number of the invocation"),
    param(int32_t, kind, 0, "what is changed"),
    param(int32_t, then, 0, "0 returns, 1 returns a fault, 2 reads through a null pointer, 3 never ends"),
    param(double, at, 3, "invocation that attacks"))
{
    self->y = (double)invocation->number;
    if (self->y != self->at) return OK;
    attack(self->kind);
    volatile int on = self->then == STAYS;
    while (on) {}
    if (self->then == CRASHES) *(volatile int *)0 = 1;
    return self->then == FAULTS ? FAULT(5) : OK;
}
