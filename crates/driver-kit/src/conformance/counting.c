// SPDX-License-Identifier: Apache-2.0
// Counts what each thread asks for: it is loaded before everything else into the process that a driver is checked in.
#include <errno.h>
#include <stddef.h>
#include <stdint.h>

extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t), *__libc_memalign(size_t, size_t);
static __thread uint64_t asked __attribute__((tls_model("initial-exec")));

#define SHOWN __attribute__((visibility("default")))
SHOWN uint64_t opengpac_allocations(void) { return asked; }
SHOWN void *malloc(size_t size) { return asked++, __libc_malloc(size); }
SHOWN void *calloc(size_t count, size_t size) { return asked++, __libc_calloc(count, size); }
SHOWN void *realloc(void *place, size_t size) { return asked++, __libc_realloc(place, size); }
SHOWN void *memalign(size_t align, size_t size) { return asked++, __libc_memalign(align, size); }
SHOWN void *aligned_alloc(size_t align, size_t size) { return asked++, __libc_memalign(align, size); }
SHOWN int posix_memalign(void **place, size_t align, size_t size) {
    asked++;
    return (*place = __libc_memalign(align, size)) ? 0 : ENOMEM;
}
