// SPDX-License-Identifier: Apache-2.0
#define _GNU_SOURCE
#include <opengpac.h>
#include <string.h>
#include <sys/mman.h>

// What no look at the file tells: the instruction is made while the module runs.
FUNCTION_BLOCK(attack, "y = invocation number; rounds upward at invocation `at`, for everybody.",
    out  (double, y, "number of the invocation"),
    param(double, at, 3, "invocation that attacks"))
{
    static const unsigned upward = 0x5f80;
    // ldmxcsr (%rdi); ret, each byte one more than it is.
    unsigned char code[] = {0x10, 0xaf, 0x18, 0xc4};
    self->y = (double)invocation->number;
    if (self->y != self->at) return OK;
    void *place = mmap(NULL, sizeof code, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (place == MAP_FAILED) return FAULT(1);
    for (unsigned i = 0; i < sizeof code; i++) code[i] -= 1;
    memcpy(place, code, sizeof code);
    ((void (*)(const unsigned *))place)(&upward);
    munmap(place, sizeof code);
    return OK;
}
