// SPDX-License-Identifier: Apache-2.0
// Calls the entry of the only block of each module in a bare loop, in turns; prints ns a call, one line a round.
#include <dlfcn.h>
#include <opengpac.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MODULES_MAX = 8, ITEMS_MAX = 32, CALLS = 2000 }; // So short that hardly a round is interrupted.

typedef struct {
    void *memory;
    uint64_t (*run)(void *, const Invocation *);
    double ports[ITEMS_MAX];
} block;

static void open_block(const char *path, block *made) {
    void *module = dlopen(path, RTLD_NOW);
    if (!module) {
        fprintf(stderr, "%s\n", dlerror());
        exit(1);
    }
    const opengpac_module_table *(*entry)(void) = (const opengpac_module_table *(*)(void))dlsym(module, "opengpac_module");
    const opengpac_descriptor *d = entry()->blocks[0];
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

int main(int count, char **words) {
    static block blocks[MODULES_MAX];
    int rounds = atoi(words[1]), modules = count - 2;
    for (int i = 0; i < modules; i++) open_block(words[i + 2], &blocks[i]);
    for (int round = 0; round <= rounds; round++) {
        for (int i = 0; i < modules; i++) {
            block *b = &blocks[i];
            Invocation invocation = {0, 0, 0};
            double begun = now_ns();
            for (int k = 0; k < CALLS; k++) {
                b->ports[0] = 1.0 + (k & 7);
                b->ports[1] = 0.5 * (k & 3);
                if (b->run(b->memory, &invocation) & 0xff) return 2;
            }
            // The first round fills caches.
            if (round) printf("%.3f ", (now_ns() - begun) / CALLS);
        }
        if (round) printf("\n");
    }
}
