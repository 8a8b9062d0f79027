// SPDX-License-Identifier: Apache-2.0
// Steps of an FMU of FMI 2 in turns: by its block's entry, and by its own functions: a value set, a step of 1 ms, a value got. Prints ns a step
// of both, one line a round; both have taken the same inputs, and end at the same value.
#include "module.h"

enum { STEPS = 2000, STEP_NS = 1000000 };

static double *port(block *of, const char *name) {
    for (uint32_t i = 0; i < of->descriptor->item_count; i++)
        if (!strcmp(of->descriptor->items[i].name, name)) return &of->ports[i];
    return NULL;
}

static double input(int k) { return 1.0 + (k & 7); }

int main(int count, char **words) {
    if (count < 4) return 1;
    int rounds = atoi(words[1]);
    static block ours;
    open_block(words[2], &ours);
    double *u = port(&ours, "u"), *y = port(&ours, "y");
    void *fmu = opened(words[3]);
    void *(*instantiate)(const char *, int, const char *, const char *, const void *, int, int) =
        (void *(*)(const char *, int, const char *, const char *, const void *, int, int))dlsym(fmu, "fmi2Instantiate");
    int (*enter)(void *) = (int (*)(void *))dlsym(fmu, "fmi2EnterInitializationMode");
    int (*leave)(void *) = (int (*)(void *))dlsym(fmu, "fmi2ExitInitializationMode");
    int (*set)(void *, const uint32_t *, size_t, const double *) = (int (*)(void *, const uint32_t *, size_t, const double *))dlsym(fmu, "fmi2SetReal");
    int (*get)(void *, const uint32_t *, size_t, double *) = (int (*)(void *, const uint32_t *, size_t, double *))dlsym(fmu, "fmi2GetReal");
    int (*step)(void *, double, double, int) = (int (*)(void *, double, double, int))dlsym(fmu, "fmi2DoStep");
    void *own = instantiate("own", 1, "{lag}", NULL, NULL, 0, 0);
    if (!u || !y || !own || enter(own) > 1 || leave(own) > 1) return 3;
    static const uint32_t in[] = {1}, out[] = {2};
    double value = 0.0, result = 0.0;
    Invocation invocation = {0, 0, 0};
    *u = input(0);
    if (ours.run(ours.memory, &invocation) & 0xff) return 4; // Its start.
    for (int round = 0; round <= rounds; round++) {
        double begun = now_ns();
        for (int k = 0; k < STEPS; k++) {
            invocation.time_ns += STEP_NS;
            *u = input(k);
            if (ours.run(ours.memory, &invocation) & 0xff) return 5;
        }
        double between = now_ns();
        for (int k = 0; k < STEPS; k++) {
            value = input(k);
            if (set(own, in, 1, &value) > 1 || step(own, 1e-3 * (round * STEPS + k), 1e-3, 1) > 1 || get(own, out, 1, &result) > 1) return 6;
        }
        double ended = now_ns();
        if (*y != result) return 7;
        // The first round fills caches.
        if (round) printf("%.3f %.3f\n", (between - begun) / STEPS, (ended - between) / STEPS);
    }
    return 0;
}
