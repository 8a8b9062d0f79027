// SPDX-License-Identifier: Apache-2.0
// Runs the only block of a module on numbers that come in, and prints what it gives: rows of the doubles of its inputs, then of its outputs.
// The module's text goes before it, all in one program, so that sanitizers see each access. Memory of the C library is counted.
#include <stdio.h>
#include <stdlib.h>

static long allocated;
void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size) { return allocated++, __real_malloc(size); }
void *__real_calloc(size_t count, size_t size);
void *__wrap_calloc(size_t count, size_t size) { return allocated++, __real_calloc(count, size); }
void *__real_realloc(void *memory, size_t size);
void *__wrap_realloc(void *memory, size_t size) { return allocated++, __real_realloc(memory, size); }

int main(int argc, char **argv) {
    const opengpac_descriptor *block = opengpac_module()->blocks[0];
    int rows = argc > 1 ? atoi(argv[1]) : 0;
    char *instance = aligned_alloc(block->instance_align, (block->instance_size + block->instance_align - 1) / block->instance_align * block->instance_align);
    memcpy(instance, block->image, block->instance_size);
    void *at[32] = {0};
    for (uint32_t i = 0; i < block->item_count; i++)
        if (block->items[i].address != OG_NONE) {
            // Of just its size: one step beyond it is reported.
            at[i] = calloc(1, block->items[i].size);
            memcpy(instance + block->items[i].address, &at[i], sizeof at[i]);
        }
    for (int row = 0; row < rows; row++) {
        for (uint32_t i = 0; i < block->item_count; i++)
            if (block->items[i].kind == OG_INPUT && fread(at[i], 1, block->items[i].size, stdin) != block->items[i].size) return 2;
        Invocation invocation = {0, row * 20000000, row * 20000000};
        long before = allocated;
        uint64_t result = block->run(instance, &invocation);
        if (allocated != before || (result & 0xff) != OG_DONE) return fprintf(stderr, "row %d: %ld allocated, result %lx\n", row, allocated - before, (long)result), 3;
        for (uint32_t i = 0; i < block->item_count; i++)
            if (block->items[i].kind == OG_OUTPUT) fwrite(at[i], 1, block->items[i].size, stdout);
    }
    for (uint32_t i = 0; i < block->item_count; i++) free(at[i]);
    free(instance);
    return 0;
}
