// SPDX-License-Identifier: Apache-2.0
// Whose code a signal has interrupted: containment.c asks, foreign.c knows.
#ifndef OPENGPAC_FOREIGN_H
#define OPENGPAC_FOREIGN_H
#include <stdint.h>

// Takes the code of the object that holds `address` for the blocks' own: it may be left at any instruction. Not in a handler.
void opengpac_containment_trust(const void *address);

// Looks up what `foreign_is_harmless` needs. Not in a handler.
void foreign_prepare(void);

// Where the handler's context was interrupted.
uintptr_t foreign_place(const void *context);

// The place from which a call through a bad pointer came; `place` where it was none.
uintptr_t foreign_caller(const void *context, uintptr_t place, const void *address);

int foreign_is_ours(uintptr_t place);

// True where the library function that a block has called, and that was interrupted at `place`, holds no lock: it can be left. Called in the
// handler itself: it walks up the stack.
int foreign_is_harmless(uintptr_t place);

// A trap after each instruction from here on, or none. 0: this machine cannot.
int foreign_step(void *context, int on);

#endif
