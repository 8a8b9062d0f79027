// SPDX-License-Identifier: Apache-2.0
// The functions of FMI 2 over a graph of OpenGPAC, which runs in a system with the virtual clock of its own in each instance. Generated before
// this text: FMU_NAME, FMU_TOKEN, FMU_SETUP (calls of opengpac_ps.h, in pairs), FMU_CREATE, FMU_READ, fmu_svvs, fmu_values.
//
// A value of the FMU is an element of an SVV or a parameter. What the master sets is stored before a step, in one call for each SVV that changed;
// what it gets is read once after a step. Numbers travel as texts of 17 digits, which name each double exactly.
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct opengpac_system opengpac_system;
extern opengpac_system *opengpac_open(const char *name, const char *clock, const char *options);
extern char *opengpac_call(opengpac_system *system, const char *call, const char *arguments);
extern const char *opengpac_error(void);
extern void opengpac_free(char *text);
extern void opengpac_close(opengpac_system *system);

typedef int fmi2Status;
enum { fmi2OK = 0, fmi2Warning = 1, fmi2Discard = 2, fmi2Error = 3 };
typedef void *fmi2Component;
typedef unsigned int fmi2ValueReference;
typedef const char *fmi2String;
typedef struct {
    void (*logger)(void *, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(void *, fmi2Status);
    void *componentEnvironment;
} fmi2CallbackFunctions;
#define EXPORT __attribute__((visibility("default")))

enum { COUNT = sizeof fmu_values / sizeof *fmu_values, SVVS = sizeof fmu_svvs / sizeof *fmu_svvs };
typedef struct {
    opengpac_system *system;
    fmi2CallbackFunctions with;
    char *name, *resources, *instance;
    double values[COUNT];
    bool changed[SVVS];
    bool read;
    int64_t start_ns, now_ns;
} graph;

// ---- the system ----

static fmi2Status failed(graph *g, const char *what) {
    if (g->with.logger) g->with.logger(g->with.componentEnvironment, g->name, fmi2Error, "logStatusError", "%s: %s", what, opengpac_error());
    return fmi2Error;
}

static bool made(graph *g, const char *call, const char *arguments) {
    char *answer = opengpac_call(g->system, call, arguments);
    opengpac_free(answer);
    return answer != NULL;
}

// A text with each "$RESOURCES" replaced, to be freed.
static char *resolved(graph *g, const char *text) {
    size_t length = strlen(text) + 1;
    for (const char *at = text; (at = strstr(at, "$RESOURCES")); at++) length += strlen(g->resources);
    char *found = malloc(length), *to = found;
    for (const char *at = text; found && *at;) {
        if (!strncmp(at, "$RESOURCES", 10)) { to = stpcpy(to, g->resources); at += 10; }
        else *to++ = *at++;
    }
    if (found) *to = 0;
    return found;
}

static void closed(graph *g) {
    opengpac_close(g->system);
    opengpac_free(g->instance);
    g->system = NULL;
    g->instance = NULL;
}

static bool opened(graph *g) {
    closed(g);
    g->system = opengpac_open(FMU_NAME, "virtual", "{}");
    for (size_t i = 0; g->system && FMU_SETUP[i]; i += 2) {
        char *arguments = resolved(g, FMU_SETUP[i + 1]);
        bool good = arguments && made(g, FMU_SETUP[i], arguments);
        free(arguments);
        if (!good) return false;
    }
    g->instance = g->system ? opengpac_call(g->system, "create", FMU_CREATE) : NULL;
    for (int i = 0; i < COUNT; i++) g->values[i] = fmu_values[i].start;
    memset(g->changed, 0, sizeof g->changed);
    g->read = false;
    g->now_ns = 0;
    return g->instance != NULL;
}

static char *number(char *to, const value *v, double x) {
    if (v->kind == 'b') return to + sprintf(to, "%s", x != 0.0 ? "true" : "false");
    if (v->kind == 'i') return to + sprintf(to, "%" PRId64, (int64_t)x);
    return to + sprintf(to, "%.17g", x);
}

// The elements of one SVV or parameter as JSON.
static char *json(char *to, graph *g, int svv) {
    const variable *of = &fmu_svvs[svv];
    if (of->size) *to++ = '[';
    for (int k = 0; k < (of->size ? of->size : 1); k++) {
        if (k) *to++ = ',';
        to = number(to, &fmu_values[of->first + k], g->values[of->first + k]);
    }
    if (of->size) *to++ = ']';
    *to = 0;
    return to;
}

static fmi2Status stored(graph *g) {
    static const size_t ROOM = 512 + 32 * (size_t)COUNT;
    char *text = malloc(ROOM);
    fmi2Status status = text ? fmi2OK : fmi2Error;
    for (int i = 0; i < SVVS && status == fmi2OK; i++) {
        if (!g->changed[i] || fmu_svvs[i].role != 'i') continue;
        char *to = text + sprintf(text, "{\"name\": \"%s\", \"value\": ", fmu_svvs[i].name);
        strcpy(json(to, g, i), "}");
        if (!made(g, "write", text)) status = failed(g, fmu_svvs[i].name);
        g->changed[i] = false;
    }
    free(text);
    return status;
}

// Takes all outputs from one snapshot: the values follow "value": in the order of FMU_READ.
static fmi2Status taken(graph *g) {
    if (g->read) return fmi2OK;
    char *answer = opengpac_call(g->system, "read", FMU_READ);
    if (!answer) return failed(g, "read");
    const char *at = answer;
    for (int i = 0; i < SVVS; i++) {
        const variable *of = &fmu_svvs[i];
        if (of->role != 'o') continue;
        at = strstr(at, "\"value\":");
        if (!at) { opengpac_free(answer); return failed(g, of->name); }
        at += 8;
        for (int k = 0; k < (of->size ? of->size : 1); k++) {
            at += strspn(at, " ,[");
            if (*at == 't' || *at == 'f') g->values[of->first + k] = *at == 't';
            else { char *end; g->values[of->first + k] = strtod(at, &end); at = end; }
            at += strcspn(at, ",]}");
        }
    }
    opengpac_free(answer);
    g->read = true;
    return fmi2OK;
}

static fmi2Status started(graph *g) {
    size_t room = 512 + 64 * (size_t)COUNT;
    char *text = malloc(room), *to = text;
    if (!text) return fmi2Error;
    to += sprintf(to, "{\"instance\": %s, \"values\": {", g->instance);
    bool first = true;
    for (int i = 0; i < SVVS; i++) {
        if (fmu_svvs[i].role != 'p') continue;
        to += sprintf(to, "%s\"%s\": ", first ? "" : ", ", fmu_svvs[i].name);
        to = json(to, g, i);
        first = false;
    }
    strcpy(to, "}}");
    bool good = made(g, "start", text);
    free(text);
    return good ? fmi2OK : failed(g, "start");
}

// ---- FMI 2 ----

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, int on, size_t n, const fmi2String categories[]) { (void)c, (void)on, (void)n, (void)categories; return fmi2OK; }

// The path of a URI file:///…, to be freed.
static char *path_of(const char *uri) {
    if (!uri) return strdup(".");
    if (!strncmp(uri, "file://", 7)) uri += 7;
    if (!strncmp(uri, "localhost/", 10)) uri += 9;
    char *path = strdup(uri), *to = path;
    for (const char *at = uri; path && *at; at++) {
        unsigned code;
        if (*at == '%' && sscanf(at + 1, "%2x", &code) == 1) { *to++ = (char)code; at += 2; }
        else *to++ = *at;
    }
    if (path) *to = 0;
    while (path && to > path + 1 && to[-1] == '/') *--to = 0;
    return path;
}

EXPORT void fmi2FreeInstance(fmi2Component c) {
    graph *g = c;
    if (!g) return;
    closed(g);
    free(g->name);
    free(g->resources);
    free(g);
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, int type, fmi2String token, fmi2String resources, const fmi2CallbackFunctions *with, int visible, int logging) {
    (void)visible, (void)logging;
    graph *g = type == 1 && token && !strcmp(token, FMU_TOKEN) ? calloc(1, sizeof *g) : NULL;
    if (!g) return NULL;
    if (with) g->with = *with;
    g->name = strdup(name ? name : FMU_NAME);
    g->resources = path_of(resources);
    if (g->name && g->resources && opened(g)) return g;
    failed(g, "instantiate");
    fmi2FreeInstance(g);
    return NULL;
}

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, int tolerant, double tolerance, double start, int ends, double end) {
    (void)tolerant, (void)tolerance, (void)ends, (void)end;
    ((graph *)c)->start_ns = llround(start * 1e9);
    return fmi2OK;
}
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    fmi2Status status = stored(c);
    return status == fmi2OK ? started(c) : status;
}
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) { return opened(c) ? fmi2OK : failed(c, "reset"); }

EXPORT fmi2Status fmi2DoStep(fmi2Component c, double at, double step, int no_earlier) {
    (void)no_earlier;
    graph *g = c;
    char text[64];
    int64_t to_ns = llround((at + step) * 1e9) - g->start_ns;
    if (to_ns < g->now_ns) return fmi2Error;
    fmi2Status status = stored(g);
    if (status != fmi2OK) return status;
    snprintf(text, sizeof text, "{\"duration_ns\": %" PRId64 "}", to_ns - g->now_ns);
    if (!made(g, "advance", text)) return failed(g, "advance");
    g->now_ns = to_ns;
    g->read = false;
    snprintf(text, sizeof text, "{\"instance\": %.20s}", g->instance);
    char *report = opengpac_call(g->system, "report", text);
    bool ended = report && strcmp(report, "null");
    if (ended && g->with.logger) g->with.logger(g->with.componentEnvironment, g->name, fmi2Error, "logStatusError", "the graph ended: %s", report);
    opengpac_free(report);
    return ended ? fmi2Error : fmi2OK;
}
EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }

static fmi2Status got(graph *g, const fmi2ValueReference refs[], size_t n, double into[], int whole[]) {
    for (size_t i = 0; i < n; i++) {
        if (refs[i] >= COUNT) return fmi2Error;
        if (fmu_svvs[fmu_values[refs[i]].svv].role == 'o' && taken(g) != fmi2OK) return fmi2Error;
        if (into) into[i] = g->values[refs[i]];
        else whole[i] = (int)g->values[refs[i]];
    }
    return fmi2OK;
}
static fmi2Status set(graph *g, const fmi2ValueReference refs[], size_t n, const double from[], const int whole[]) {
    for (size_t i = 0; i < n; i++) {
        if (refs[i] >= COUNT || fmu_svvs[fmu_values[refs[i]].svv].role == 'o') return fmi2Error;
        double x = from ? from[i] : whole[i];
        if (!isfinite(x)) return fmi2Discard;
        g->values[refs[i]] = x;
        g->changed[fmu_values[refs[i]].svv] = true;
    }
    return fmi2OK;
}
EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, double v[]) { return got(c, r, n, v, NULL); }
EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, int v[]) { return got(c, r, n, NULL, v); }
EXPORT fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, int v[]) { return got(c, r, n, NULL, v); }
EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const double v[]) { return set(c, r, n, v, NULL); }
EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference r[], size_t n, const int v[]) { return set(c, r, n, NULL, v); }
EXPORT fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference r[], size_t n, const int v[]) { return set(c, r, n, NULL, v); }
EXPORT fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2String v[]) { (void)c, (void)r, (void)v; return n ? fmi2Error : fmi2OK; }
EXPORT fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]) { (void)c, (void)r, (void)v; return n ? fmi2Error : fmi2OK; }

// What the description says that it cannot do.
EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, void **s) { (void)c, (void)s; return fmi2Error; }
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, void *s) { (void)c, (void)s; return fmi2Error; }
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, void **s) { (void)c, (void)s; return fmi2Error; }
EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, void *s, size_t *n) { (void)c, (void)s, (void)n; return fmi2Error; }
EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, void *s, char b[], size_t n) { (void)c, (void)s, (void)b, (void)n; return fmi2Error; }
EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const char b[], size_t n, void **s) { (void)c, (void)b, (void)n, (void)s; return fmi2Error; }
EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu, const fmi2ValueReference k[], size_t nk, const double dk[], double du[]) {
    (void)c, (void)u, (void)nu, (void)k, (void)nk, (void)dk, (void)du;
    return fmi2Error;
}
EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const int o[], const double v[]) { (void)c, (void)r, (void)n, (void)o, (void)v; return fmi2Error; }
EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n, const int o[], double v[]) { (void)c, (void)r, (void)n, (void)o, (void)v; return fmi2Error; }
EXPORT fmi2Status fmi2GetStatus(fmi2Component c, int k, fmi2Status *v) { (void)c, (void)k, (void)v; return fmi2Discard; }
EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, int k, double *v) { (void)k; *v = (double)(((graph *)c)->start_ns + ((graph *)c)->now_ns) * 1e-9; return fmi2OK; }
EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, int k, int *v) { (void)c, (void)k, (void)v; return fmi2Discard; }
EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, int k, int *v) { (void)c, (void)k; *v = 0; return fmi2OK; }
EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, int k, fmi2String *v) { (void)c, (void)k, (void)v; return fmi2Discard; }
