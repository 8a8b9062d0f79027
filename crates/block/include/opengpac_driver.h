// SPDX-License-Identifier: Apache-2.0
// OpenGPAC: how to write a driver of a machine in C (C11) or C++ (C++17). This one file is all that a driver needs.
//
//     #include <opengpac_driver.h>
//
//     struct axis { double gain, place, speed; int64_t at_ns; opengpac_slot position, effort; };
//
//     DRIVER(axis, "One axis that follows its effort, x' = gain u.",
//         option_number(gain, 1.0, "its speed for an effort of 1", "rad/s"))
//
//     const char *axis_make(struct axis *self, opengpac_host *host) {
//         self->gain = given_number(host, "gain");
//         self->position = reads(host, "double", "axis.position", "where it is", "rad");
//         self->effort = writes(host, "double", "axis.effort", 0.0, "what moves it", "N.m");
//         return OK;
//     }
//     const char *axis_open(struct axis *self, int64_t now_ns) { self->at_ns = now_ns; return OK; }
//     const char *axis_read(struct axis *self, int64_t release_ns, uint8_t *readings) { ... set_number(readings, self->position, x); return OK; }
//     const char *axis_write(struct axis *self, int64_t release_ns, const uint8_t *commands, const uint8_t *engaged) { ... return OK; }
//     void axis_safe_state(struct axis *self) { self->speed = 0.0; }
//
// `gpac.drivers.load("axis.c")` makes it a driver of a Python program; docs/drivers/writing.md goes through one.
//
// The list is the manual of the driver, at most 32 items; a unit is an optional last word:
//
//     option_number(name, value, "what", "unit")   an option with its default; option_whole, option_bool, option_text the same
//     option_list  (name, "[1, 2]", "what")        a list, its default as JSON; option_table the same: "{}"
//     needed_number(name, "what", "unit")          an option that must be given; needed_whole, _bool, _text, _list, _table the same
//     exchange     (worker)                        on a thread of its own: read and write may wait. Without it: inline, see below
//     waits        (ns)                            how long open waits for a device that is not there yet
//     lost_within  (ns)                            how long after its last answer a device that is gone is told as lost, at most
//     safe         ("what", ns, BY_DRIVER)         its safe state, how soon it holds, and what brings it about: BY_DRIVER | BY_GUARD | BY_DEVICE | BY_END.
//                                                  BY_DEVICE: its own watchdog. BY_END: the machine is computed here, and gone with this process
//     counter      (name, "what", "unit")          what it counts
//     right        ("raw sockets: cap_net_raw")    what it may do that a program of the user alone may not, and how that is given
//     service      (name, "what")                  what it does off the cycle; options that stand behind it are its arguments
//     service_of   (name, number, "what")          the same, with an answer: number, whole, bool, text, list or table
//     moving_service (name, "what")               a service that moves the machine: refused while an emergency stop is latched
//
// A driver `axis` is a `struct axis` of plain data, 0 when it is made, and these functions; those that it does not need are left out:
//
//     make         channels and parts, from the options; it may allocate and read files. Nothing of the machine is touched
//     open         once before the first exchange; now_ns is the clock of the exchange
//     read, write  at the start and the end of each firing. Inline: bounded; no allocation, no lock, no wait, for this is the real-time thread
//     taken        after each read: when the machine took its readings, on the clock of release_ns. Left out: with the read. One that has heard
//                  nothing new answers the time from before, and the channel age of its device grows
//     safe_state   all outputs to their safe state now: after a fault, an emergency stop, at the end; also where it never was open
//     close        once at the end, also where it never was open; then the struct is freed
//     handles      after open: what the guard writes when this process is gone (safe_handle)
//     service      (self, host, name): from another thread while read and write run; what both use is atomic
//     scan         (host): looks for devices and moves nothing (found)
//
// All but taken, safe_state and close return OK, or the cause for people: return because("no answer from %s", host). A cause of read or write
// means that the device is lost. The host lives as long as the call that is given it; texts of options live as long as the driver.
//
// The bytes below are described by the Rust file foreign/abi.rs too; a test compares them.
#ifndef OPENGPAC_DRIVER_H
#define OPENGPAC_DRIVER_H

#ifdef OPENGPAC_H
#error "write a driver and a function block in two files: include either opengpac_driver.h or opengpac.h"
#endif

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#ifdef __cplusplus
#define OGD_ASSERT(condition, message) static_assert(condition, message)
#define OGD_C extern "C"
#else
#define OGD_ASSERT(condition, message) _Static_assert(condition, message)
#define OGD_C extern
#endif

// ---- The bytes that a driver and the real-time system share: foreign/abi.rs ----
// Each struct begins with its size or is in an array whose element size is told: what a later version appends, an older one does not see.

#define OPENGPAC_DRIVER_ABI 1

typedef struct {
    uint32_t what, kind;      // OGD_OPTION, …; OGD_NUMBER, …
    const char *name, *doc, *unit;
    const char *text;         // default of a text; of a list or a table as JSON
    double number;            // default of a number
    int64_t whole;            // default of a whole number or a truth value; ns
    uint32_t needed, by;      // an option: whether it must be given; a safe state: what brings it about
} opengpac_driver_item;

typedef struct {
    uint32_t offset;          // in the readings or in the commands
    uint32_t index;           // among those of its direction: engaged[index]
} opengpac_slot;

typedef struct {
    uint32_t size, is_written;
    const char *name, *type, *doc, *unit;
    double safe;              // what each number of it is when nobody commands it
    double slew_max;          // fastest change in units per second; 0: no limit
} opengpac_channel;

// A joint. Its channels are name.position and name.velocity (read), and name.bias (read) and name.effort (written); where the machine closes
// the loop (by_position) name.goal (written, safe value NAN: no goal, it stays where it is) in place of those two.
typedef struct {
    uint32_t size, is_slide;  // a slide is in m and N, a hinge in rad and N.m
    uint32_t by_position, reserved;
    const char *name;
    double range_min, range_max, effort_max, speed_max; // 0: no limit
    double home, kp, kd;
} opengpac_part;

typedef struct {
    uint32_t size, latches;   // latches: it stays in force until a driver opens the device anew
    int32_t descriptor;
    uint32_t length;
    uint64_t offset;
    const void *bytes;
} opengpac_handle;

typedef struct opengpac_host opengpac_host;
struct opengpac_host {
    uint32_t abi, size;
    void *at;
    double (*number)(opengpac_host *, const char *name);
    int64_t (*whole)(opengpac_host *, const char *name);
    const char *(*text)(opengpac_host *, const char *name);
    const char *(*json)(opengpac_host *, const char *name);
    int64_t (*length)(opengpac_host *, const char *name);
    double (*number_at)(opengpac_host *, const char *name, int64_t index);
    const char *(*text_at)(opengpac_host *, const char *name, int64_t index);
    opengpac_slot (*channel)(opengpac_host *, const opengpac_channel *);
    void (*part)(opengpac_host *, const opengpac_part *);
    uint64_t *(*counter)(opengpac_host *, const char *name);
    void (*watchdog)(opengpac_host *, int64_t ns);
    void (*handle)(opengpac_host *, const opengpac_handle *);
    void (*answer)(opengpac_host *, const char *json);
    void (*found)(opengpac_host *, const char *what, const char *options_json);
};

typedef struct {
    uint32_t size, line;
    const char *name, *doc, *file;
    const opengpac_driver_item *items;
    uint32_t item_size, item_count;
    uint64_t instance_size;
    const char *(*make)(void *self, opengpac_host *host);
    const char *(*open)(void *self, int64_t now_ns);
    const char *(*read)(void *self, int64_t release_ns, uint8_t *readings);
    const char *(*write)(void *self, int64_t release_ns, const uint8_t *commands, const uint8_t *engaged);
    void (*safe_state)(void *self);
    void (*close)(void *self);
    const char *(*handles)(void *self, opengpac_host *host);
    const char *(*service)(void *self, opengpac_host *host, const char *name);
    const char *(*scan)(opengpac_host *host);
    int64_t (*taken)(void *self);
} opengpac_driver;

typedef const opengpac_driver *(*opengpac_driver_getter)(void);

typedef struct {
    uint32_t abi, size;
    const opengpac_driver_getter *drivers;
    uint32_t count, reserved;
    const char *target, *compiler;
} opengpac_driver_module;

enum { OGD_OPTION = 1, OGD_CLASS = 2, OGD_WAITS = 3, OGD_LOST_WITHIN = 4, OGD_SAFE = 5, OGD_COUNTER = 6, OGD_RIGHT = 7, OGD_SERVICE = 8 };
enum { OGD_NOTHING = 0, OGD_NUMBER = 1, OGD_WHOLE = 2, OGD_BOOL = 3, OGD_TEXT = 4, OGD_LIST = 5, OGD_TABLE = 6 };
enum { OGD_INLINE = 0, OGD_WORKER = 1 };
enum { BY_DRIVER = 1, BY_GUARD = 2, BY_DEVICE = 4, BY_END = 8 };

// ---- What the functions of a driver use ----

#define OK ((const char *)0)
#define OGD_INLINE_FUNCTION __attribute__((unused)) static inline

// A cause with numbers and names in it, as printf makes it. It holds until the next one of this thread.
__attribute__((unused, format(printf, 1, 2))) static const char *because(const char *format, ...) {
    static __thread char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return text;
}

// Options, and arguments of a service.
OGD_INLINE_FUNCTION double given_number(opengpac_host *host, const char *name) { return host->number(host, name); }
OGD_INLINE_FUNCTION int64_t given_whole(opengpac_host *host, const char *name) { return host->whole(host, name); }
OGD_INLINE_FUNCTION bool given_bool(opengpac_host *host, const char *name) { return host->whole(host, name) != 0; }
OGD_INLINE_FUNCTION const char *given_text(opengpac_host *host, const char *name) { return host->text(host, name); }
OGD_INLINE_FUNCTION const char *given_json(opengpac_host *host, const char *name) { return host->json(host, name); }
OGD_INLINE_FUNCTION int64_t list_length(opengpac_host *host, const char *name) { return host->length(host, name); }
OGD_INLINE_FUNCTION double list_number(opengpac_host *host, const char *name, int64_t index) { return host->number_at(host, name, index); }
OGD_INLINE_FUNCTION const char *list_text(opengpac_host *host, const char *name, int64_t index) { return host->text_at(host, name, index); }

// Channels: "part.channel"; the type is "double", "bool", "int16_t", "double[6]", …
OGD_INLINE_FUNCTION opengpac_slot reads(opengpac_host *host, const char *type, const char *name, const char *doc, const char *unit) {
    opengpac_channel channel = {sizeof channel, 0, name, type, doc, unit, 0.0, 0.0};
    return host->channel(host, &channel);
}
OGD_INLINE_FUNCTION opengpac_slot writes(opengpac_host *host, const char *type, const char *name, double safe, const char *doc, const char *unit) {
    opengpac_channel channel = {sizeof channel, 1, name, type, doc, unit, safe, 0.0};
    return host->channel(host, &channel);
}
OGD_INLINE_FUNCTION void part(opengpac_host *host, opengpac_part joint) {
    joint.size = sizeof joint;
    host->part(host, &joint);
}

// Values of a channel, a double or any other type.
OGD_INLINE_FUNCTION void set_value(uint8_t *readings, opengpac_slot slot, const void *value, size_t bytes) { memcpy(readings + slot.offset, value, bytes); }
OGD_INLINE_FUNCTION void get_value(const uint8_t *commands, opengpac_slot slot, void *value, size_t bytes) { memcpy(value, commands + slot.offset, bytes); }
OGD_INLINE_FUNCTION void set_number(uint8_t *readings, opengpac_slot slot, double value) { set_value(readings, slot, &value, sizeof value); }
OGD_INLINE_FUNCTION double get_number(const uint8_t *commands, opengpac_slot slot) {
    double value;
    get_value(commands, slot, &value, sizeof value);
    return value;
}
// Whether a running verb commands the channel; else it carries its safe value.
OGD_INLINE_FUNCTION bool is_engaged(const uint8_t *engaged, opengpac_slot slot) { return engaged[slot.index] != 0; }

// Counters: asked for in make, counted anywhere.
OGD_INLINE_FUNCTION uint64_t *counter_of(opengpac_host *host, const char *name) { return host->counter(host, name); }
OGD_INLINE_FUNCTION void count(uint64_t *counter, uint64_t more) { __atomic_fetch_add(counter, more, __ATOMIC_RELAXED); }

// In make: the device goes to its safe state by itself where no command comes for so long.
OGD_INLINE_FUNCTION void watchdog(opengpac_host *host, int64_t ns) { host->watchdog(host, ns); }
// In handles: what is written to a descriptor when this process is gone.
OGD_INLINE_FUNCTION void safe_handle(opengpac_host *host, int descriptor, uint64_t offset, const void *bytes, uint32_t length, bool latches) {
    opengpac_handle handle = {sizeof handle, latches, descriptor, length, offset, bytes};
    host->handle(host, &handle);
}
// In service: what is answered, as JSON: because("%.17g", x).
OGD_INLINE_FUNCTION void answer(opengpac_host *host, const char *json) { host->answer(host, json); }
// In scan: a device, and the options that open it, as JSON.
OGD_INLINE_FUNCTION void found(opengpac_host *host, const char *what, const char *options_json) { host->found(host, what, options_json); }

// ---- The preprocessor's part ----

#define OGD_CAT(a, b) OGD_CAT_(a, b)
#define OGD_CAT_(a, b) a##b
#define OGD_UNWRAP(...) __VA_ARGS__
#define OGD_CALL(M, arguments) M arguments
#define OGD_COUNT(...) OGD_COUNT_(__VA_ARGS__, MANY, MANY, MANY, MANY, MANY, MANY, MANY, 33, 32, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0)
#define OGD_COUNT_(a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, a15, a16, a17, a18, a19, a20, a21, a22, a23, a24, a25, a26, a27, a28, a29, a30, a31, a32, a33, a34, a35, a36, a37, a38, a39, a40, count, ...) count
#define OGD_EACH(M, ...) OGD_CAT(OGD_EACH_, OGD_COUNT(__VA_ARGS__))(M, __VA_ARGS__)
#define OGD_EACH_MANY(M, ...) M(more_than_32_items())
#define OGD_EACH_1(M, doc)
#define OGD_EACH_2(M, doc, item) M(item)
#define OGD_EACH_3(M, doc, item, ...) M(item) OGD_EACH_2(M, doc, __VA_ARGS__)
#define OGD_EACH_4(M, doc, item, ...) M(item) OGD_EACH_3(M, doc, __VA_ARGS__)
#define OGD_EACH_5(M, doc, item, ...) M(item) OGD_EACH_4(M, doc, __VA_ARGS__)
#define OGD_EACH_6(M, doc, item, ...) M(item) OGD_EACH_5(M, doc, __VA_ARGS__)
#define OGD_EACH_7(M, doc, item, ...) M(item) OGD_EACH_6(M, doc, __VA_ARGS__)
#define OGD_EACH_8(M, doc, item, ...) M(item) OGD_EACH_7(M, doc, __VA_ARGS__)
#define OGD_EACH_9(M, doc, item, ...) M(item) OGD_EACH_8(M, doc, __VA_ARGS__)
#define OGD_EACH_10(M, doc, item, ...) M(item) OGD_EACH_9(M, doc, __VA_ARGS__)
#define OGD_EACH_11(M, doc, item, ...) M(item) OGD_EACH_10(M, doc, __VA_ARGS__)
#define OGD_EACH_12(M, doc, item, ...) M(item) OGD_EACH_11(M, doc, __VA_ARGS__)
#define OGD_EACH_13(M, doc, item, ...) M(item) OGD_EACH_12(M, doc, __VA_ARGS__)
#define OGD_EACH_14(M, doc, item, ...) M(item) OGD_EACH_13(M, doc, __VA_ARGS__)
#define OGD_EACH_15(M, doc, item, ...) M(item) OGD_EACH_14(M, doc, __VA_ARGS__)
#define OGD_EACH_16(M, doc, item, ...) M(item) OGD_EACH_15(M, doc, __VA_ARGS__)
#define OGD_EACH_17(M, doc, item, ...) M(item) OGD_EACH_16(M, doc, __VA_ARGS__)
#define OGD_EACH_18(M, doc, item, ...) M(item) OGD_EACH_17(M, doc, __VA_ARGS__)
#define OGD_EACH_19(M, doc, item, ...) M(item) OGD_EACH_18(M, doc, __VA_ARGS__)
#define OGD_EACH_20(M, doc, item, ...) M(item) OGD_EACH_19(M, doc, __VA_ARGS__)
#define OGD_EACH_21(M, doc, item, ...) M(item) OGD_EACH_20(M, doc, __VA_ARGS__)
#define OGD_EACH_22(M, doc, item, ...) M(item) OGD_EACH_21(M, doc, __VA_ARGS__)
#define OGD_EACH_23(M, doc, item, ...) M(item) OGD_EACH_22(M, doc, __VA_ARGS__)
#define OGD_EACH_24(M, doc, item, ...) M(item) OGD_EACH_23(M, doc, __VA_ARGS__)
#define OGD_EACH_25(M, doc, item, ...) M(item) OGD_EACH_24(M, doc, __VA_ARGS__)
#define OGD_EACH_26(M, doc, item, ...) M(item) OGD_EACH_25(M, doc, __VA_ARGS__)
#define OGD_EACH_27(M, doc, item, ...) M(item) OGD_EACH_26(M, doc, __VA_ARGS__)
#define OGD_EACH_28(M, doc, item, ...) M(item) OGD_EACH_27(M, doc, __VA_ARGS__)
#define OGD_EACH_29(M, doc, item, ...) M(item) OGD_EACH_28(M, doc, __VA_ARGS__)
#define OGD_EACH_30(M, doc, item, ...) M(item) OGD_EACH_29(M, doc, __VA_ARGS__)
#define OGD_EACH_31(M, doc, item, ...) M(item) OGD_EACH_30(M, doc, __VA_ARGS__)
#define OGD_EACH_32(M, doc, item, ...) M(item) OGD_EACH_31(M, doc, __VA_ARGS__)
#define OGD_EACH_33(M, doc, item, ...) M(item) OGD_EACH_32(M, doc, __VA_ARGS__)
#define OGD_FIRST(...) OGD_FIRST_(__VA_ARGS__, ~)
#define OGD_FIRST_(first, ...) first

// A word of the list is known where OGD_WORD_word is a macro, else OGD_UNKNOWN takes its place.
#define OGD_TUPLE(item) OGD_APPLY(#item, OGD_WORD_##item, OGD_UNKNOWN, (), ~)
#define OGD_APPLY(...) OGD_APPLY_(__VA_ARGS__)
#define OGD_APPLY_(text, probe, M, arguments, ...) OGD_CALL(M, (text, OGD_UNWRAP arguments))
#define OGD_UNKNOWN(text, ...) (UNKNOWN, text)
#define OGD_CHECK(item) OGD_CALL_ON(OGD_CHECK_, OGD_TUPLE(item))
#define OGD_ITEM(item) OGD_CALL_ON(OGD_ITEM_, OGD_TUPLE(item))
#define OGD_CALL_ON(M, tuple) OGD_CALL_ON_(M, OGD_UNWRAP tuple)
#define OGD_CALL_ON_(...) OGD_CALL_OF(__VA_ARGS__)
#define OGD_CALL_OF(M, K, ...) OGD_CAT(M, K)(__VA_ARGS__)
#define OGD_CHECK_UNKNOWN(text) OGD_ASSERT(0, "'" text "' is not an item of a driver: use option_number, option_whole, option_bool, option_text, option_list, option_table, needed_ of each, exchange, waits, lost_within, safe, counter, right, service, service_of, moving_service; at most 32 items");
#define OGD_CHECK_IS(...)
#define OGD_ITEM_UNKNOWN(text) {0, 0, "", "", "", 0, 0.0, 0, 0, 0},
#define OGD_ITEM_IS(what, kind, name, doc, unit, text, number, whole, needed, by) {what, kind, name, doc, unit, text, number, whole, needed, by},

// (IS, what, kind, name, doc, unit, text, number, whole, needed, by)
#define OGD_OPTION_OF(kind, name, text, number, whole, needed, ...) OGD_DOC_AND_UNIT(OGD_OPTION, kind, name, text, number, whole, needed, 0, __VA_ARGS__, "", ~)
#define OGD_DOC_AND_UNIT(what, kind, name, text, number, whole, needed, by, doc, unit, ...) (IS, what, kind, name, doc, unit, text, number, whole, needed, by)
#define OGD_WORD_option_number(...) ~, OGD_OPTION_number, (__VA_ARGS__)
#define OGD_OPTION_number(t, name, value, ...) OGD_OPTION_OF(OGD_NUMBER, #name, 0, value, 0, 0, __VA_ARGS__)
#define OGD_WORD_option_whole(...) ~, OGD_OPTION_whole, (__VA_ARGS__)
#define OGD_OPTION_whole(t, name, value, ...) OGD_OPTION_OF(OGD_WHOLE, #name, 0, 0.0, value, 0, __VA_ARGS__)
#define OGD_WORD_option_bool(...) ~, OGD_OPTION_bool, (__VA_ARGS__)
#define OGD_OPTION_bool(t, name, value, ...) OGD_OPTION_OF(OGD_BOOL, #name, 0, 0.0, value, 0, __VA_ARGS__)
#define OGD_WORD_option_text(...) ~, OGD_OPTION_text, (__VA_ARGS__)
#define OGD_OPTION_text(t, name, value, ...) OGD_OPTION_OF(OGD_TEXT, #name, value, 0.0, 0, 0, __VA_ARGS__)
#define OGD_WORD_option_list(...) ~, OGD_OPTION_list, (__VA_ARGS__)
#define OGD_OPTION_list(t, name, value, ...) OGD_OPTION_OF(OGD_LIST, #name, value, 0.0, 0, 0, __VA_ARGS__)
#define OGD_WORD_option_table(...) ~, OGD_OPTION_table, (__VA_ARGS__)
#define OGD_OPTION_table(t, name, value, ...) OGD_OPTION_OF(OGD_TABLE, #name, value, 0.0, 0, 0, __VA_ARGS__)
#define OGD_WORD_needed_number(...) ~, OGD_NEEDED, (OGD_NUMBER, __VA_ARGS__)
#define OGD_WORD_needed_whole(...) ~, OGD_NEEDED, (OGD_WHOLE, __VA_ARGS__)
#define OGD_WORD_needed_bool(...) ~, OGD_NEEDED, (OGD_BOOL, __VA_ARGS__)
#define OGD_WORD_needed_text(...) ~, OGD_NEEDED, (OGD_TEXT, __VA_ARGS__)
#define OGD_WORD_needed_list(...) ~, OGD_NEEDED, (OGD_LIST, __VA_ARGS__)
#define OGD_WORD_needed_table(...) ~, OGD_NEEDED, (OGD_TABLE, __VA_ARGS__)
#define OGD_NEEDED(t, kind, name, ...) OGD_OPTION_OF(kind, #name, 0, 0.0, 0, 1, __VA_ARGS__)
#define OGD_WORD_exchange(...) ~, OGD_EXCHANGE, (__VA_ARGS__)
#define OGD_EXCHANGE(t, class) (IS, OGD_CLASS, OGD_CLASS_##class, "", "", "", 0, 0.0, 0, 0, 0)
#define OGD_CLASS_inline OGD_INLINE
#define OGD_CLASS_worker OGD_WORKER
#define OGD_WORD_waits(...) ~, OGD_TIME, (OGD_WAITS, __VA_ARGS__)
#define OGD_WORD_lost_within(...) ~, OGD_TIME, (OGD_LOST_WITHIN, __VA_ARGS__)
#define OGD_TIME(t, what, ns) (IS, what, 0, "", "", "", 0, 0.0, ns, 0, 0)
#define OGD_WORD_safe(...) ~, OGD_SAFE_OF, (__VA_ARGS__)
#define OGD_SAFE_OF(t, doc, ns, by) (IS, OGD_SAFE, 0, "", doc, "", 0, 0.0, ns, 0, by)
#define OGD_WORD_counter(...) ~, OGD_COUNTER_OF, (__VA_ARGS__)
#define OGD_COUNTER_OF(t, name, ...) OGD_DOC_AND_UNIT(OGD_COUNTER, 0, #name, 0, 0.0, 0, 0, 0, __VA_ARGS__, "", ~)
#define OGD_WORD_right(...) ~, OGD_RIGHT_OF, (__VA_ARGS__)
#define OGD_RIGHT_OF(t, doc) (IS, OGD_RIGHT, 0, "", doc, "", 0, 0.0, 0, 0, 0)
#define OGD_WORD_service(...) ~, OGD_SERVICE_OF, (nothing, __VA_ARGS__)
#define OGD_SERVICE_OF(t, kind, name, doc) (IS, OGD_SERVICE, OGD_ANSWER_##kind, #name, doc, "", 0, 0.0, 0, 0, 0)
#define OGD_WORD_moving_service(...) ~, OGD_MOVING_SERVICE, (__VA_ARGS__)
#define OGD_MOVING_SERVICE(t, name, doc) (IS, OGD_SERVICE, OGD_NOTHING, #name, doc, "", 0, 0.0, 1, 0, 0)
#define OGD_WORD_service_of(...) ~, OGD_SERVICE_ANSWERS, (__VA_ARGS__)
#define OGD_SERVICE_ANSWERS(t, name, kind, doc) (IS, OGD_SERVICE, OGD_ANSWER_##kind, #name, doc, "", 0, 0.0, 0, 0, 0)
#define OGD_ANSWER_nothing OGD_NOTHING
#define OGD_ANSWER_number OGD_NUMBER
#define OGD_ANSWER_whole OGD_WHOLE
#define OGD_ANSWER_bool OGD_BOOL
#define OGD_ANSWER__Bool OGD_BOOL
#define OGD_ANSWER_text OGD_TEXT
#define OGD_ANSWER_list OGD_LIST
#define OGD_ANSWER_table OGD_TABLE

// A function of the driver: weak, so that one that is left out is no error, and what calls it.
#define OGD_FUNCTION(NAME, result, function, parameters, typed, arguments, returns) \
    OGD_C __attribute__((weak, visibility("hidden"))) result NAME##_##function typed; \
    static result opengpac_##function##_##NAME parameters { returns NAME##_##function arguments; }

// DRIVER(name, "what it drives", items...)
#define DRIVER(NAME, ...) \
    OGD_EACH(OGD_CHECK, __VA_ARGS__) \
    OGD_FUNCTION(NAME, const char *, make, (void *self, opengpac_host *host), (struct NAME *, opengpac_host *), ((struct NAME *)self, host), return) \
    OGD_FUNCTION(NAME, const char *, open, (void *self, int64_t now_ns), (struct NAME *, int64_t), ((struct NAME *)self, now_ns), return) \
    OGD_FUNCTION(NAME, const char *, read, (void *self, int64_t at, uint8_t *readings), (struct NAME *, int64_t, uint8_t *), ((struct NAME *)self, at, readings), return) \
    OGD_FUNCTION(NAME, const char *, write, (void *self, int64_t at, const uint8_t *commands, const uint8_t *engaged), \
                 (struct NAME *, int64_t, const uint8_t *, const uint8_t *), ((struct NAME *)self, at, commands, engaged), return) \
    OGD_FUNCTION(NAME, void, safe_state, (void *self), (struct NAME *), ((struct NAME *)self), ) \
    OGD_FUNCTION(NAME, void, close, (void *self), (struct NAME *), ((struct NAME *)self), ) \
    OGD_FUNCTION(NAME, const char *, handles, (void *self, opengpac_host *host), (struct NAME *, opengpac_host *), ((struct NAME *)self, host), return) \
    OGD_FUNCTION(NAME, const char *, service, (void *self, opengpac_host *host, const char *name), (struct NAME *, opengpac_host *, const char *), \
                 ((struct NAME *)self, host, name), return) \
    OGD_FUNCTION(NAME, const char *, scan, (opengpac_host *host), (opengpac_host *), (host), return) \
    OGD_FUNCTION(NAME, int64_t, taken, (void *self), (struct NAME *), ((struct NAME *)self), return) \
    static const opengpac_driver_item opengpac_items_##NAME[] = {OGD_EACH(OGD_ITEM, __VA_ARGS__) {0, 0, "", "", "", 0, 0.0, 0, 0, 0}}; \
    static const opengpac_driver *opengpac_driver_##NAME(void) { \
        static opengpac_driver driver; \
        driver.size = sizeof driver, driver.line = __LINE__, driver.name = #NAME, driver.doc = OGD_FIRST(__VA_ARGS__), driver.file = __FILE__; \
        driver.items = opengpac_items_##NAME, driver.item_size = sizeof(opengpac_driver_item); \
        driver.item_count = sizeof opengpac_items_##NAME / sizeof(opengpac_driver_item) - 1; \
        driver.instance_size = sizeof(struct NAME); \
        driver.make = NAME##_make ? opengpac_make_##NAME : 0, driver.open = NAME##_open ? opengpac_open_##NAME : 0; \
        driver.read = NAME##_read ? opengpac_read_##NAME : 0, driver.write = NAME##_write ? opengpac_write_##NAME : 0; \
        driver.safe_state = NAME##_safe_state ? opengpac_safe_state_##NAME : 0, driver.close = NAME##_close ? opengpac_close_##NAME : 0; \
        driver.handles = NAME##_handles ? opengpac_handles_##NAME : 0, driver.service = NAME##_service ? opengpac_service_##NAME : 0; \
        driver.scan = NAME##_scan ? opengpac_scan_##NAME : 0, driver.taken = NAME##_taken ? opengpac_taken_##NAME : 0; \
        return &driver; \
    } \
    static const opengpac_driver_getter opengpac_getter_##NAME __attribute__((section("opengpac_drivers"), used)) = opengpac_driver_##NAME;

// ---- What a file of drivers exports ----
// Each translation unit brings it, the linker keeps one; it lists the drivers of all of them.

#if defined(__x86_64__)
#define OGD_TARGET "x86_64-linux"
#elif defined(__aarch64__)
#define OGD_TARGET "aarch64-linux"
#elif defined(__riscv) && __riscv_xlen == 64
#define OGD_TARGET "riscv64-linux"
#else
#define OGD_TARGET "other"
#endif

// Weak: absent where there is no driver.
OGD_C const opengpac_driver_getter __start_opengpac_drivers[] __attribute__((weak, visibility("hidden")));
OGD_C const opengpac_driver_getter __stop_opengpac_drivers[] __attribute__((weak, visibility("hidden")));
OGD_C __attribute__((weak, visibility("default"))) const opengpac_driver_module *opengpac_driver_file(void);
OGD_C __attribute__((weak, visibility("default"))) const opengpac_driver_module *opengpac_driver_file(void) {
    static opengpac_driver_module module;
    module.abi = OPENGPAC_DRIVER_ABI, module.size = sizeof module;
    module.drivers = __start_opengpac_drivers;
    module.count = (uint32_t)(__stop_opengpac_drivers - __start_opengpac_drivers);
    module.target = OGD_TARGET, module.compiler = __VERSION__;
    return &module;
}

#endif
