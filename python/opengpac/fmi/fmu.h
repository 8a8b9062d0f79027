// SPDX-License-Identifier: Apache-2.0
// An FMU's library and its instances, for a generated block: loaded and instantiated when the module is loaded, off the real-time path.
//
// A block's instance in the real-time system leases one of the FMU's instances at its start and resets it. There are FMU_INSTANCES; where more
// are alive, the one that ran least recently loses its own, and says so (fault 3). An FMU's instance is used by one thread at a time (`busy`).
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { FMU_LEASE_LOST = 3, FMU_STEP_FAILED = 4, FMU_TERMINATED = 5, FMU_OTHER_STEP = 6, FMU_VALUE_REFUSED = 7, FMU_NOT_INITIALISED = 8,
       FMU_NOT_LOADED = 10, FMU_FUNCTION_MISSING = 11, FMU_NOT_INSTANTIATED = 12 };

typedef int fmu_status; // 0 is OK, 1 a warning
typedef struct {
    void *component;
    int64_t lease, at_ns;  // its own time, from 0
    int64_t before_ns;     // running time of the invocation before
    uint64_t before, used; // number of the invocation before, and when it ran last
    int busy, touched, failed;
} fmu_instance;

static fmu_instance fmu_instances[FMU_INSTANCES];
static uint32_t fmu_problem = FMU_NOT_LOADED;
static uint64_t fmu_clock, fmu_leases;
static void *fmu_library;
__attribute__((unused)) static int fmu_file = -1;

static void *fmu_find(const char *name) {
    void *found = dlsym(fmu_library, name);
    if (!found) fmu_problem = FMU_FUNCTION_MISSING;
    return found;
}

#if FMU_VERSION == 2
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} fmu_callbacks;
static void fmu_log(void *e, const char *i, int s, const char *c, const char *m, ...) { (void)e, (void)i, (void)s, (void)c, (void)m; }
static const fmu_callbacks fmu_given = {fmu_log, calloc, free, NULL, NULL};
static void *(*fmu_instantiate)(const char *, int, const char *, const char *, const fmu_callbacks *, int, int);
static fmu_status (*fmu_setup)(void *, int, double, double, int, double);
static fmu_status (*fmu_enter)(void *);
static fmu_status (*fmu_do_step)(void *, double, double, int);
static void *fmu_made(void) { return fmu_instantiate(FMU_NAME, 1, FMU_TOKEN, FMU_RESOURCES, &fmu_given, 0, 0); }
static fmu_status fmu_entered(void *c) { return fmu_setup(c, 0, 0.0, 0.0, 0, 0.0) > 1 ? 3 : fmu_enter(c); }
#else
static void fmu_log(void *e, int s, const char *c, const char *m) { (void)e, (void)s, (void)c, (void)m; }
static void *(*fmu_instantiate)(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *,
                                void (*)(void *, int, const char *, const char *), void *);
static fmu_status (*fmu_enter)(void *, bool, double, double, bool, double);
static fmu_status (*fmu_do_step)(void *, double, double, bool, bool *, bool *, bool *, double *);
static void *fmu_made(void) { return fmu_instantiate(FMU_NAME, FMU_TOKEN, FMU_RESOURCES, 0, 0, 0, 0, NULL, 0, NULL, fmu_log, NULL); }
static fmu_status fmu_entered(void *c) { return fmu_enter(c, 0, 0.0, 0.0, 0, 0.0); }
#endif
static fmu_status (*fmu_exit)(void *);
static fmu_status (*fmu_reset)(void *);
static void (*fmu_free)(void *);

#ifdef FMU_EMBEDDED
extern const unsigned char fmu_image[] __attribute__((visibility("hidden"))), fmu_image_end[] __attribute__((visibility("hidden")));
static void *fmu_opened(void) {
    size_t size = (size_t)(fmu_image_end - fmu_image), at = 0;
    int file = memfd_create(FMU_NAME, MFD_CLOEXEC);
    char path[64];
    void *found = NULL;
    if (file < 0) return NULL;
    for (ssize_t n = 1; at < size && n > 0; at += n > 0 ? (size_t)n : 0) n = write(file, fmu_image + at, size - at);
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    if (at == size) found = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    // It stays open while the library is loaded: another one of the same number would be taken for it.
    if (found) fmu_file = file;
    else close(file);
    return found;
}
#else
static void *fmu_opened(void) { return dlopen(FMU_PATH, RTLD_NOW | RTLD_LOCAL); }
#endif

static void fmu_functions(void); // generated: those that get and set

__attribute__((constructor)) static void fmu_load(void) {
    fmu_library = fmu_opened();
    if (!fmu_library) return;
    fmu_problem = 0;
#if FMU_VERSION == 2
    *(void **)&fmu_instantiate = fmu_find("fmi2Instantiate");
    *(void **)&fmu_setup = fmu_find("fmi2SetupExperiment");
    *(void **)&fmu_enter = fmu_find("fmi2EnterInitializationMode");
    *(void **)&fmu_exit = fmu_find("fmi2ExitInitializationMode");
    *(void **)&fmu_reset = fmu_find("fmi2Reset");
    *(void **)&fmu_do_step = fmu_find("fmi2DoStep");
    *(void **)&fmu_free = fmu_find("fmi2FreeInstance");
#else
    *(void **)&fmu_instantiate = fmu_find("fmi3InstantiateCoSimulation");
    *(void **)&fmu_enter = fmu_find("fmi3EnterInitializationMode");
    *(void **)&fmu_exit = fmu_find("fmi3ExitInitializationMode");
    *(void **)&fmu_reset = fmu_find("fmi3Reset");
    *(void **)&fmu_do_step = fmu_find("fmi3DoStep");
    *(void **)&fmu_free = fmu_find("fmi3FreeInstance");
#endif
    fmu_functions();
    for (int i = 0; i < FMU_INSTANCES && !fmu_problem; i++)
        if (!(fmu_instances[i].component = fmu_made())) fmu_problem = FMU_NOT_INSTANTIATED;
}

__attribute__((destructor)) static void fmu_unload(void) {
    for (int i = 0; i < FMU_INSTANCES; i++)
        if (fmu_instances[i].component && !fmu_instances[i].busy) fmu_free(fmu_instances[i].component);
    if (fmu_library) dlclose(fmu_library);
    if (fmu_file >= 0) close(fmu_file);
}

static bool fmu_taken(fmu_instance *one) { return !__atomic_exchange_n(&one->busy, 1, __ATOMIC_ACQUIRE); }
static void fmu_left(fmu_instance *one) { __atomic_store_n(&one->busy, 0, __ATOMIC_RELEASE); }

// The instance of a lease, or none where another one has it by now.
static fmu_instance *fmu_of(int64_t lease) {
    fmu_instance *one = lease > 0 ? &fmu_instances[(lease - 1) % FMU_INSTANCES] : NULL;
    if (!one || !fmu_taken(one)) return NULL;
    if (one->lease == lease) return one;
    fmu_left(one);
    return NULL;
}

// The instance that was used least recently, with a new lease; none where all of them are running.
static fmu_instance *fmu_claimed(int64_t *lease) {
    for (int tries = 0; tries < FMU_INSTANCES; tries++) {
        fmu_instance *best = NULL;
        for (int i = 0; i < FMU_INSTANCES; i++) {
            fmu_instance *one = &fmu_instances[i];
            if (!__atomic_load_n(&one->busy, __ATOMIC_RELAXED) && (!best || one->used < best->used)) best = one;
        }
        if (!best || !fmu_taken(best)) continue;
        uint64_t turn = __atomic_add_fetch(&fmu_leases, 1, __ATOMIC_RELAXED);
        *lease = best->lease = (int64_t)(turn * FMU_INSTANCES + (uint64_t)(best - fmu_instances) + 1);
        return best;
    }
    return NULL;
}

enum { FMU_LATE = 3 }; // so many cycles at once are no gap

// One step. Time that was lost with releases that were skipped is not made up for: after a gap, or where the FMU takes steps of one size
// only, it goes on by one cycle.
static uint32_t fmu_stepped(fmu_instance *one, const Invocation *invocation) {
    int64_t step_ns = invocation->time_ns - one->before_ns, cycles = (int64_t)(invocation->number - one->before);
    one->before_ns = invocation->time_ns, one->before = invocation->number;
    if (step_ns == 0) return 0;
    if (cycles > (FMU_STEP_NS ? 1 : FMU_LATE)) step_ns /= cycles;
    if (FMU_STEP_NS && step_ns != FMU_STEP_NS) return FMU_OTHER_STEP;
    double at = (double)one->at_ns * 1e-9, step = (double)step_ns * 1e-9;
#if FMU_VERSION == 2
    if (fmu_do_step(one->component, at, step, 1) > 1) return FMU_STEP_FAILED;
#else
    bool event = 0, ends = 0, early = 0;
    double last = 0.0;
    if (fmu_do_step(one->component, at, step, 1, &event, &ends, &early, &last) > 1 || early) return FMU_STEP_FAILED;
    if (ends) return FMU_TERMINATED;
#endif
    one->at_ns += step_ns;
    return 0;
}
