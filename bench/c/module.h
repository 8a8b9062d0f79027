// SPDX-License-Identifier: Apache-2.0
// For loops in C that call what a shared object has: a library that is opened, the only block of a module with its ports, the time.
#include <dlfcn.h>
#include <opengpac.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { ITEMS_MAX = 32 };

typedef struct {
    void *memory;
    uint64_t (*run)(void *, const Invocation *);
    const opengpac_descriptor *descriptor;
    double ports[ITEMS_MAX]; // By item.
} block;

static void *opened(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        exit(1);
    }
    return library;
}

static void open_block(const char *path, block *made) {
    const opengpac_module_table *(*entry)(void) = (const opengpac_module_table *(*)(void))dlsym(opened(path), "opengpac_module");
    const opengpac_descriptor *d = made->descriptor = entry()->blocks[0];
    made->memory = aligned_alloc(64, (d->instance_size + 63u) / 64 * 64);
    memcpy(made->memory, d->image, d->instance_size);
    made->run = d->run;
    for (uint32_t i = 0; i < d->item_count; i++)
        if (d->items[i].address != OG_NONE) *(double **)((char *)made->memory + d->items[i].address) = &made->ports[i];
}

static double now_ns(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return 1e9 * (double)time.tv_sec + (double)time.tv_nsec;
}
