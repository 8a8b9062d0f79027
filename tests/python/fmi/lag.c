// SPDX-License-Identifier: Apache-2.0
// An FMU for tests, of FMI 2 or 3 by -DFMI: y' = (k u - y) / tau by Euler's method in steps of 1 ms, n counts steps, on says whether y > 0.5.
#include <stdlib.h>
#include <string.h>
#if FMI == 2
#include "fmi2Functions.h"
typedef fmi2Status status;
typedef fmi2Component instance;
typedef fmi2ValueReference reference;
typedef fmi2Boolean boolean;
#define F(name) fmi2##name
#define COUNT
#else
#include "fmi3Functions.h"
typedef fmi3Status status;
typedef fmi3Instance instance;
typedef fmi3ValueReference reference;
typedef fmi3Boolean boolean;
#define F(name) fmi3##name
#define COUNT , size_t values
#endif
enum { OKAY = 0, ERROR = 3 };

typedef struct { double u, y, k, tau, gain; int n, mode, gear; boolean hold; } lag;
/* A gear, reference 10, cannot be 0. */
static int whole(lag *s, unsigned r, int v) { if (r == 10 && v == 0) return 0; *(r == 10 ? &s->gear : &s->mode) = v; return 1; }
static const lag START = {0.0, 0.25, 2.0, 0.1, 1.0, 0, 0, 0};

static instance made(void) {
    lag *new = malloc(sizeof *new);
    if (new) *new = START;
    return new;
}

static status stepped(lag *s, double step) {
    if (s->mode == 99) return ERROR;
    for (int i = 0; i < (int)(step / 1e-3 + 0.5); i++)
        if (!s->hold) s->y += 1e-3 * (s->gain * s->k * s->u - s->y) / s->tau;
    s->n++;
    return OKAY;
}

static double *real(lag *s, reference r) { return r == 1 ? &s->u : r == 2 ? &s->y : r == 3 ? &s->k : r == 4 ? &s->tau : r == 9 ? &s->gain : NULL; }

#if FMI == 2
instance fmi2Instantiate(fmi2String n, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions *f, boolean v, boolean l) {
    (void)n, (void)t, (void)r, (void)f, (void)v, (void)l;
    return strcmp(g, "{lag}") ? NULL : made();
}
status fmi2SetupExperiment(instance c, boolean td, double t, double s, boolean sd, double e) { (void)c, (void)td, (void)t, (void)s, (void)sd, (void)e; return OKAY; }
status fmi2EnterInitializationMode(instance c) { (void)c; return OKAY; }
status fmi2DoStep(instance c, double at, double step, boolean p) { (void)at, (void)p; return stepped(c, step); }
status fmi2GetInteger(instance c, const reference r[], size_t n, fmi2Integer v[]) {
    for (size_t i = 0; i < n; i++) v[i] = r[i] == 5 ? ((lag *)c)->n : r[i] == 10 ? ((lag *)c)->gear : ((lag *)c)->mode;
    return OKAY;
}
status fmi2SetInteger(instance c, const reference r[], size_t n, const fmi2Integer v[]) { for (size_t i = 0; i < n; i++) if (!whole(c, r[i], v[i])) return ERROR; return OKAY; }
#define GET_REAL fmi2GetReal
#define SET_REAL fmi2SetReal
#else
instance fmi3InstantiateCoSimulation(fmi3String n, fmi3String t, fmi3String r, boolean v, boolean l, boolean e, boolean early,
                                     const reference needed[], size_t count, fmi3InstanceEnvironment env, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback up) {
    (void)n, (void)v, (void)l, (void)e, (void)early, (void)needed, (void)count, (void)env, (void)log, (void)up;
    // There are FMUs that read where their resources are whether they have some or not.
    return strcmp(t, "{lag}") || strlen(r) > 4096 ? NULL : made();
}
status fmi3EnterInitializationMode(instance c, boolean td, double t, double s, boolean sd, double e) { (void)c, (void)td, (void)t, (void)s, (void)sd, (void)e; return OKAY; }
status fmi3DoStep(instance c, double at, double step, boolean p, boolean *event, boolean *ends, boolean *early, double *last) {
    (void)p;
    *event = *ends = *early = 0;
    *last = at + step;
    return stepped(c, step);
}
status fmi3GetInt32(instance c, const reference r[], size_t n, fmi3Int32 v[], size_t values) {
    (void)values;
    for (size_t i = 0; i < n; i++) v[i] = r[i] == 5 ? ((lag *)c)->n : r[i] == 10 ? ((lag *)c)->gear : ((lag *)c)->mode;
    return OKAY;
}
status fmi3SetInt32(instance c, const reference r[], size_t n, const fmi3Int32 v[], size_t values) { (void)values; for (size_t i = 0; i < n; i++) if (!whole(c, r[i], v[i])) return ERROR; return OKAY; }
#define GET_REAL fmi3GetFloat64
#define SET_REAL fmi3SetFloat64
#endif
status F(ExitInitializationMode)(instance c) { return ((lag *)c)->tau > 0.0 ? OKAY : ERROR; }
status F(Reset)(instance c) { *(lag *)c = START; return OKAY; }
status F(Terminate)(instance c) { (void)c; return OKAY; }
void F(FreeInstance)(instance c) { free(c); }
status GET_REAL(instance c, const reference r[], size_t n, double v[] COUNT) { for (size_t i = 0; i < n; i++) v[i] = *real(c, r[i]); return OKAY; }
status SET_REAL(instance c, const reference r[], size_t n, const double v[] COUNT) { for (size_t i = 0; i < n; i++) *real(c, r[i]) = v[i]; return OKAY; }
status F(GetBoolean)(instance c, const reference r[], size_t n, boolean v[] COUNT) { for (size_t i = 0; i < n; i++) v[i] = r[i] == 6 ? ((lag *)c)->y > 0.5 : ((lag *)c)->hold; return OKAY; }
status F(SetBoolean)(instance c, const reference r[], size_t n, const boolean v[] COUNT) { for (size_t i = 0; i < n; i++) ((lag *)c)->hold = v[i]; return OKAY; }
