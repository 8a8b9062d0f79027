// SPDX-License-Identifier: Apache-2.0
// OpenGPAC: how to write a function block in C (C11) or C++ (C++17). This one file is all that a code module needs.
//
//     #include <opengpac.h>
//
//     FUNCTION_BLOCK(lowpass, "First-order low-pass filter: y += alpha (u - y).",
//         in   (double, u,          "raw signal"),
//         out  (double, y,          "filtered signal"),
//         param(double, alpha, 0.1, "smoothing factor, 0 to 1"))
//     {
//         self->y += self->alpha * (self->u - self->y);
//         return OK;
//     }
//
// The list declares the interface, at most 32 items; a unit is an optional last word, "rad":
//
//     in      (T, name, "what")               input; synchronous: one invocation for each value of its writer
//     in_async(T, name, "what")               input; the newest value, whenever it was written
//     in_ratio(T, name, n, "what")            input; its writer updates once in n invocations of this block
//     in_default(T, name, value, "what")      synchronous input that may stay unbound and then reads `value`
//     in_async_default(T, name, value, "what")
//     in_history(T, name, n, "what")           the last n values, whenever they were written: self->name[0] is the oldest
//     out     (T, name, "what")               output; out_async the same for readers of any rate
//     out_ratio(T, name, n, "what")           output; stored on every nth invocation
//     out_nonfinite(T, name, "what")          output that may be infinite or not a number: others make the invocation a fault
//     state   (T, name, initial, "what")      memory of the block from one invocation to the next
//     state_keep(T, name, initial, "what")    the same, kept when its verb is started again
//     param   (T, name, value, "what")        parameter with its default
//     device  (T, name, read, "what")         channel of a physical device, read before or (write) written after the body
//     condition(name, "what")                 reported by report(name)
//     condition_of(T, name, "what")           reported by report_value(name, x); its preset is self->name, 0 unless set
//     condition_of_default(T, name, preset, "what")
//     size    (n, least, most)                for items of type double[n]: self->n is the number of elements
//
// T is double, float, bool, int8_t to uint64_t, a TYPE of yours, or an array of one: double[6]. A list of numbers is a
// value in parentheses: param(double[3], k, (1, 2, 3), "gains"). In C one size name serves one block of a file.
//
// The body sees `self`, a copy of its items, and `invocation` (->number from 0, ->time_ns running time since the start,
// ->now_ns). It returns OK, or FAULT(code): then nothing is stored and the state stays as it was; a C++ exception that leaves it is
// such a fault. A report does not return.
//
//     TYPE(pose, "Position and heading.", field(double[3], p), field(double, yaw))      a struct type for items
//
// The bytes below are described by the Rust file abi.rs too; a test compares them.
#ifndef OPENGPAC_H
#define OPENGPAC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __cpp_exceptions
#include <exception>
#endif

#ifndef __cplusplus
#undef bool // so that the text of a type is "bool" in C as in C++
typedef _Bool bool;
#define OG_ASSERT(condition, message) _Static_assert(condition, message)
#define OG_EXTERN_C extern
#define OG_ZERO 0
#else
#define OG_ASSERT(condition, message) static_assert(condition, message)
#define OG_EXTERN_C extern "C"
#define OG_ZERO
#endif
#ifdef __FAST_MATH__
#error "compile a function block without -ffast-math: it must give the same bits everywhere"
#endif

// ---- The bytes that a code module and the real-time system share: abi.rs ----

#define OPENGPAC_ABI 2

typedef struct {
    uint64_t number;  // invocations since the start of the verb, from 0
    int64_t time_ns;  // running time of the verb since its start
    int64_t now_ns;   // release time of the firing
} Invocation;

typedef struct {
    uint64_t number, activated;
} opengpac_header;
#define OG_RUNNING ((uint64_t)1 << 63) // in `number`: the invocation has stored nothing, and may be ended

typedef struct {
    uint8_t kind, mode;
    uint16_t flags;
    uint32_t ratio;
    const char *name, *type_text, *unit, *doc;
    uint32_t offset, size, address, report, element, reserved;
} opengpac_item;

typedef struct {
    uint32_t abi, item_count;
    const char *name, *doc;
    const opengpac_item *items;
    const void *image;
    uint32_t instance_size, instance_align;
    uint64_t (*run)(void *, const Invocation *);
    const char *file;
    uint32_t line, reserved;
} opengpac_descriptor;

// Bank entries: bank.rs.
typedef struct {
    uint64_t (*run)(void *, const Invocation *);
    void *instance;
    const Invocation *invocation;
} opengpac_call;
typedef uint64_t (*opengpac_bank)(const opengpac_call *, uint32_t *, uint32_t, uint32_t);
typedef struct {
    uint64_t (*run)(void *, const Invocation *);
    opengpac_bank bank;
} opengpac_bank_entry;

typedef struct {
    const char *name, *declaration, *doc;
    uint32_t size, align;
} opengpac_type_descriptor;

typedef struct {
    uint32_t abi, block_count;
    const opengpac_descriptor *const *blocks;
    uint32_t type_count, reserved;
    const opengpac_type_descriptor *const *types;
    const char *target, *compiler;
} opengpac_module_table;

enum { OG_DONE = 0, OG_FAULT = 1, OG_NONFINITE = 3, OG_THREW = 4 };
enum { OG_INPUT = 1, OG_OUTPUT = 2, OG_DEVICE_READ = 3, OG_DEVICE_WRITE = 4, OG_CONDITION = 5, OG_PARAMETER = 6, OG_STATE = 7, OG_SIZE = 8 };
enum { OG_SYNCHRONOUS = 0, OG_RATIO = 1, OG_ASYNCHRONOUS = 2 };
enum { OG_DEFAULT = 1, OG_MAY_BE_NONFINITE = 2, OG_KEEP = 4, OG_SIZED = 8, OG_HISTORY = 16 };
#define OG_NONE UINT32_MAX

// ---- What a body uses ----

typedef struct {
    uint64_t word;
} opengpac_outcome;

static inline opengpac_outcome opengpac_outcome_of(uint64_t word) {
    opengpac_outcome outcome = {word};
    return outcome;
}

#define OK opengpac_outcome_of(OG_DONE)
#define FAULT(code) opengpac_outcome_of(OG_FAULT | (uint64_t)(uint32_t)(code) << 8)
#define report(condition) ((void)(self->opengpac_reports |= (uint64_t)1 << (7 + sizeof(*self->opengpac_bit_##condition))))
#define report_value(condition, value) ((void)(self->opengpac_report_##condition = (value)), report(condition))

// ---- Types ----
// `opengpac_class_T` is never defined: it is an array whose *size* says what T is, and whose elements have that size too, so
// that the text `double[6]` pasted behind `opengpac_class_` still says it. `opengpac_base_T` says sizeof(T) in the same way.

enum { OG_CLASS_EXACT = 1, OG_CLASS_FLOAT = 2, OG_CLASS_DOUBLE = 3, OG_CLASS_STRUCT = 4, OG_CLASS_OTHER_WIDTH = 5 };
#define OG_TYPE_CLASS(T, class) extern char opengpac_class_##T[1][1][1][class]; extern T opengpac_base_##T[1][1][1][1]
OG_TYPE_CLASS(double, OG_CLASS_DOUBLE); OG_TYPE_CLASS(float, OG_CLASS_FLOAT); OG_TYPE_CLASS(bool, OG_CLASS_EXACT);
OG_TYPE_CLASS(int8_t, OG_CLASS_EXACT); OG_TYPE_CLASS(int16_t, OG_CLASS_EXACT); OG_TYPE_CLASS(int32_t, OG_CLASS_EXACT); OG_TYPE_CLASS(int64_t, OG_CLASS_EXACT);
OG_TYPE_CLASS(uint8_t, OG_CLASS_EXACT); OG_TYPE_CLASS(uint16_t, OG_CLASS_EXACT); OG_TYPE_CLASS(uint32_t, OG_CLASS_EXACT); OG_TYPE_CLASS(uint64_t, OG_CLASS_EXACT);
OG_TYPE_CLASS(char, OG_CLASS_OTHER_WIDTH); OG_TYPE_CLASS(short, OG_CLASS_OTHER_WIDTH); OG_TYPE_CLASS(int, OG_CLASS_OTHER_WIDTH); OG_TYPE_CLASS(long, OG_CLASS_OTHER_WIDTH);
OG_TYPE_CLASS(unsigned, OG_CLASS_OTHER_WIDTH); OG_TYPE_CLASS(size_t, OG_CLASS_OTHER_WIDTH);
#define OG_CLASS(T) (sizeof(opengpac_class_##T))
#define OG_BASE_SIZE(T) (sizeof(opengpac_base_##T))
// Questions to a text while compiling; each compiler folds other functions to constants.
// OG_IS_SIZED: "double[n]", what stands in the first brackets (or in those appended) is no number.
#if defined(__cplusplus)
constexpr const char *opengpac_bracket(const char *text) { return *text == 0 || *text == '[' ? text : opengpac_bracket(text + 1); }
#define OG_HAS_BRACKET(text) (*opengpac_bracket(text) != 0)
#define OG_IS_QUOTED(text) (text[0] == '"')
#define OG_IS_SIZED(text) (*opengpac_bracket(text) != 0 && (opengpac_bracket(text)[1] < '0' || opengpac_bracket(text)[1] > '9'))
#elif defined(__clang__)
#define OG_HAS_BRACKET(text) (__builtin_strchr(text "[", '[')[1] != 0)
#define OG_IS_QUOTED(text) (__builtin_memcmp(text, "\"", 1) == 0)
#define OG_IS_SIZED(text) (__builtin_strchr(text "[0", '[')[1] < '0' || __builtin_strchr(text "[0", '[')[1] > '9')
#else
#define OG_HAS_BRACKET(text) (__builtin_strcspn(text, "[") != sizeof(text) - 1)
#define OG_IS_QUOTED(text) (__builtin_strspn(text, "\"") != 0)
#define OG_IS_SIZED(text) (__builtin_strspn(text "[0" + __builtin_strcspn(text "[", "[") + 1, "0123456789") == 0)
#endif

// A struct type and how it is checked. They lie side by side in a section of the module, the class of an item finds its own.
typedef struct {
    opengpac_type_descriptor type;
    uint64_t (*nonfinite)(const void *);
} opengpac_type_record;

// Weak: absent where the module has no struct type.
OG_EXTERN_C const opengpac_type_descriptor *const __start_opengpac_types[] __attribute__((weak, visibility("hidden")));
OG_EXTERN_C const opengpac_type_descriptor *const __stop_opengpac_types[] __attribute__((weak, visibility("hidden")));
OG_EXTERN_C const opengpac_descriptor *const __start_opengpac_blocks[] __attribute__((weak, visibility("hidden")));
OG_EXTERN_C const opengpac_descriptor *const __stop_opengpac_blocks[] __attribute__((weak, visibility("hidden")));
OG_EXTERN_C const opengpac_bank_entry *const __start_opengpac_banks[] __attribute__((weak, visibility("hidden")));
OG_EXTERN_C const opengpac_bank_entry *const __stop_opengpac_banks[] __attribute__((weak, visibility("hidden")));

__attribute__((unused, noinline)) static const opengpac_type_record *opengpac_find_type(const char *text) {
    size_t length = __builtin_strcspn(text, "[ ");
    for (const opengpac_type_descriptor *const *t = __start_opengpac_types; t != __stop_opengpac_types; t++)
        if (__builtin_strncmp((*t)->name, text, length) == 0 && (*t)->name[length] == 0) return (const opengpac_type_record *)(const void *)*t;
    return (const opengpac_type_record *)0;
}

#define OG_INLINE __attribute__((always_inline, unused)) static inline

// The top bit says whether an element is infinite or not a number: its exponent is all ones, and one more carries.
OG_INLINE uint64_t opengpac_nonfinite_double(const char *p) {
    uint64_t bits;
    __builtin_memcpy(&bits, p, 8);
    return (bits & 0x7ff0000000000000u) + 0x0010000000000000u;
}

OG_INLINE uint64_t opengpac_nonfinite_float(const char *p) {
    uint32_t bits;
    __builtin_memcpy(&bits, p, 4);
    return (uint64_t)((bits & 0x7f800000u) + 0x00800000u) << 32;
}

OG_INLINE uint64_t opengpac_nonfinite(const void *value, size_t bytes, size_t type_class, const char *text) {
    const char *p = (const char *)value;
    uint64_t top = 0;
    if (type_class == OG_CLASS_DOUBLE && bytes == 8) return opengpac_nonfinite_double(p);
    if (type_class == OG_CLASS_FLOAT && bytes == 4) return opengpac_nonfinite_float(p);
    if (type_class == OG_CLASS_DOUBLE)
        for (size_t i = 0; i < bytes; i += 8) top |= opengpac_nonfinite_double(p + i);
    if (type_class == OG_CLASS_FLOAT)
        for (size_t i = 0; i < bytes; i += 4) top |= opengpac_nonfinite_float(p + i);
    if (type_class == OG_CLASS_STRUCT) {
        const opengpac_type_record *record = opengpac_find_type(text);
        for (size_t i = 0; record && i < bytes; i += record->type.size) top |= record->nonfinite(p + i);
    }
    return top;
}

// ---- The preprocessor's part ----

#define OG_CAT(a, b) OG_CAT_(a, b)
#define OG_CAT_(a, b) a##b
#define OG_STR(...) OG_STR_(__VA_ARGS__)
#define OG_STR_(...) #__VA_ARGS__
#define OG_UNWRAP(...) __VA_ARGS__
#define OG_CALL(M, arguments) M arguments

// How many arguments: 1 to 32, or MANY.
#define OG_COUNT(...) OG_COUNT_(__VA_ARGS__, OG_MANY8, OG_MANY8, OG_MANY8, OG_MANY8, 32, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0)
#define OG_MANY8 MANY, MANY, MANY, MANY, MANY, MANY, MANY, MANY
#define OG_COUNT_(...) OG_COUNT_OF(__VA_ARGS__)
#define OG_COUNT_OF(a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, a12, a13, a14, a15, a16, a17, a18, a19, a20, a21, a22, a23, a24, a25, a26, a27, a28, a29, a30, a31, a32, a33, a34, a35, a36, a37, a38, a39, a40, a41, a42, a43, a44, a45, a46, a47, a48, a49, a50, a51, a52, a53, a54, a55, a56, a57, a58, a59, a60, a61, a62, a63, a64, count, ...) count

// M(C, index, item) for each item.
#define OG_MAP(M, C, ...) OG_CAT(OG_MAP_, OG_COUNT(__VA_ARGS__))(M, C, 0, __VA_ARGS__)
#define OG_MAP_1(M, C, i, t) M(C, i, t)
#define OG_MAP_2(M, C, i, t, ...) M(C, i, t) OG_MAP_1(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_3(M, C, i, t, ...) M(C, i, t) OG_MAP_2(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_4(M, C, i, t, ...) M(C, i, t) OG_MAP_3(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_5(M, C, i, t, ...) M(C, i, t) OG_MAP_4(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_6(M, C, i, t, ...) M(C, i, t) OG_MAP_5(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_7(M, C, i, t, ...) M(C, i, t) OG_MAP_6(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_8(M, C, i, t, ...) M(C, i, t) OG_MAP_7(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_9(M, C, i, t, ...) M(C, i, t) OG_MAP_8(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_10(M, C, i, t, ...) M(C, i, t) OG_MAP_9(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_11(M, C, i, t, ...) M(C, i, t) OG_MAP_10(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_12(M, C, i, t, ...) M(C, i, t) OG_MAP_11(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_13(M, C, i, t, ...) M(C, i, t) OG_MAP_12(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_14(M, C, i, t, ...) M(C, i, t) OG_MAP_13(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_15(M, C, i, t, ...) M(C, i, t) OG_MAP_14(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_16(M, C, i, t, ...) M(C, i, t) OG_MAP_15(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_17(M, C, i, t, ...) M(C, i, t) OG_MAP_16(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_18(M, C, i, t, ...) M(C, i, t) OG_MAP_17(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_19(M, C, i, t, ...) M(C, i, t) OG_MAP_18(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_20(M, C, i, t, ...) M(C, i, t) OG_MAP_19(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_21(M, C, i, t, ...) M(C, i, t) OG_MAP_20(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_22(M, C, i, t, ...) M(C, i, t) OG_MAP_21(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_23(M, C, i, t, ...) M(C, i, t) OG_MAP_22(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_24(M, C, i, t, ...) M(C, i, t) OG_MAP_23(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_25(M, C, i, t, ...) M(C, i, t) OG_MAP_24(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_26(M, C, i, t, ...) M(C, i, t) OG_MAP_25(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_27(M, C, i, t, ...) M(C, i, t) OG_MAP_26(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_28(M, C, i, t, ...) M(C, i, t) OG_MAP_27(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_29(M, C, i, t, ...) M(C, i, t) OG_MAP_28(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_30(M, C, i, t, ...) M(C, i, t) OG_MAP_29(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_31(M, C, i, t, ...) M(C, i, t) OG_MAP_30(M, C, (i + 1), __VA_ARGS__)
#define OG_MAP_32(M, C, i, t, ...) M(C, i, t) OG_MAP_31(M, C, (i + 1), __VA_ARGS__)

// Each item becomes one tuple (KIND, mode, flags, ratio, type, name, value, description, unit, text): a word of the list is
// known where OG_WORD_word is a macro, else OG_UNKNOWN takes its place.
#define OG_TUPLE(C, i, item) , OG_APPLY(#item, OG_WORD_##item, OG_UNKNOWN, (), ~)
#define OG_APPLY(...) OG_APPLY_(__VA_ARGS__)
#define OG_APPLY_(text, probe, M, arguments, ...) OG_CALL(M, (text, OG_UNWRAP arguments))
#define OG_ERROR(message) (ERROR, 0, 0, 0, int, error, OG_ZERO, message, "", "")
#define OG_UNKNOWN(text, ...) OG_ERROR("'" text "' is not an item of a function block: use in, in_async, in_ratio, in_history, in_default, in_async_default, out, out_async, out_ratio, out_nonfinite, state, state_keep, param, device, condition, condition_of, condition_of_default, size")
#define OG_NO_DESCRIPTION(text, form) OG_ERROR("'" text "' has no description: write " form)
#define OG_EXCESS(text, form) OG_ERROR("'" text "' has too many arguments: write " form)
#define OG_WORD_more_than_32(...) ~, OG_OVERFULL, ()
#define OG_OVERFULL(text, ...) OG_ERROR("a block has at most 32 items: put several values into an array or a TYPE")
#define OG_MAP_MANY(M, C, i, ...) M(C, i, more_than_32())

// word(T, name, "what"[, "unit"])
#define OG_WORD_in(...) ~, OG_PLAIN, (IN, OG_SYNCHRONOUS, 0, __VA_ARGS__)
#define OG_WORD_in_async(...) ~, OG_PLAIN, (IN, OG_ASYNCHRONOUS, 0, __VA_ARGS__)
#define OG_WORD_out(...) ~, OG_PLAIN, (OUT, OG_SYNCHRONOUS, 0, __VA_ARGS__)
#define OG_WORD_out_async(...) ~, OG_PLAIN, (OUT, OG_ASYNCHRONOUS, 0, __VA_ARGS__)
#define OG_WORD_out_nonfinite(...) ~, OG_PLAIN, (OUT, OG_SYNCHRONOUS, OG_MAY_BE_NONFINITE, __VA_ARGS__)
#define OG_WORD_condition_of(...) ~, OG_PLAIN, (COND, 0, 0, __VA_ARGS__)
#define OG_PLAIN(text, K, mode, flags, ...) OG_CAT(OG_PLAIN_, OG_COUNT(__VA_ARGS__))(text, K, mode, flags, __VA_ARGS__)
#define OG_PLAIN_FORM "word(T, name, \"what it is\") or word(T, name, \"what it is\", \"unit\")"
#define OG_PLAIN_1(text, ...) OG_NO_DESCRIPTION(text, OG_PLAIN_FORM)
#define OG_PLAIN_2(text, ...) OG_NO_DESCRIPTION(text, OG_PLAIN_FORM)
#define OG_PLAIN_3(text, K, mode, flags, T, name, doc) (K, mode, flags, 0, T, name, OG_ZERO, doc, "", text)
#define OG_PLAIN_4(text, K, mode, flags, T, name, doc, unit) (K, mode, flags, 0, T, name, OG_ZERO, doc, unit, text)
#define OG_PLAIN_5(text, ...) OG_EXCESS(text, OG_PLAIN_FORM)
#define OG_PLAIN_6(text, ...) OG_EXCESS(text, OG_PLAIN_FORM)

// word(T, name, n, "what"[, "unit"])
#define OG_WORD_in_ratio(...) ~, OG_RATED, (IN, OG_RATIO, 0, __VA_ARGS__)
#define OG_WORD_out_ratio(...) ~, OG_RATED, (OUT, OG_RATIO, 0, __VA_ARGS__)
#define OG_WORD_in_history(...) ~, OG_RATED, (PAST, OG_ASYNCHRONOUS, OG_HISTORY, __VA_ARGS__)
#define OG_RATED(text, K, mode, flags, ...) OG_CAT(OG_RATED_, OG_COUNT(__VA_ARGS__))(text, K, mode, flags, __VA_ARGS__)
#define OG_RATED_FORM "word(T, name, n, \"what it is\") or word(T, name, n, \"what it is\", \"unit\")"
#define OG_RATED_1(text, ...) OG_NO_DESCRIPTION(text, OG_RATED_FORM)
#define OG_RATED_2(text, ...) OG_NO_DESCRIPTION(text, OG_RATED_FORM)
#define OG_RATED_3(text, ...) OG_NO_DESCRIPTION(text, OG_RATED_FORM)
#define OG_RATED_4(text, K, mode, flags, T, name, n, doc) (K, mode, flags, n, T, name, OG_ZERO, doc, "", text)
#define OG_RATED_5(text, K, mode, flags, T, name, n, doc, unit) (K, mode, flags, n, T, name, OG_ZERO, doc, unit, text)
#define OG_RATED_6(text, ...) OG_EXCESS(text, OG_RATED_FORM)

// word(T, name, value, "what"[, "unit"])
#define OG_WORD_in_default(...) ~, OG_VALUED, (IN, OG_SYNCHRONOUS, OG_DEFAULT, __VA_ARGS__)
#define OG_WORD_in_async_default(...) ~, OG_VALUED, (IN, OG_ASYNCHRONOUS, OG_DEFAULT, __VA_ARGS__)
#define OG_WORD_state(...) ~, OG_VALUED, (STATE, 0, 0, __VA_ARGS__)
#define OG_WORD_state_keep(...) ~, OG_VALUED, (STATE, 0, OG_KEEP, __VA_ARGS__)
#define OG_WORD_param(...) ~, OG_VALUED, (PARAM, 0, 0, __VA_ARGS__)
#define OG_WORD_condition_of_default(...) ~, OG_VALUED, (COND, 0, 0, __VA_ARGS__)
#define OG_VALUED(text, K, mode, flags, ...) OG_CAT(OG_VALUED_, OG_COUNT(__VA_ARGS__))(text, K, mode, flags, __VA_ARGS__)
#define OG_VALUED_FORM "word(T, name, value, \"what it is\") or word(T, name, value, \"what it is\", \"unit\")"
#define OG_VALUED_1(text, ...) OG_NO_DESCRIPTION(text, OG_VALUED_FORM)
#define OG_VALUED_2(text, ...) OG_NO_DESCRIPTION(text, OG_VALUED_FORM)
#define OG_VALUED_3(text, ...) OG_NO_DESCRIPTION(text, OG_VALUED_FORM)
#define OG_VALUED_4(text, K, mode, flags, T, name, value, doc) (K, mode, flags, 0, T, name, value, doc, "", text)
#define OG_VALUED_5(text, K, mode, flags, T, name, value, doc, unit) (K, mode, flags, 0, T, name, value, doc, unit, text)
#define OG_VALUED_6(text, ...) OG_EXCESS(text, OG_VALUED_FORM)

// device(T, name, read or write, "what"[, "unit"])
#define OG_WORD_device(...) ~, OG_DEVICE, (__VA_ARGS__)
#define OG_DEVICE(text, ...) OG_CAT(OG_DEVICE_, OG_COUNT(__VA_ARGS__))(text, __VA_ARGS__)
#define OG_DEVICE_FORM "device(T, name, read, \"what it is\") or device(T, name, write, \"what it is\", \"unit\")"
#define OG_DEVICE_1(text, ...) OG_NO_DESCRIPTION(text, OG_DEVICE_FORM)
#define OG_DEVICE_2(text, ...) OG_NO_DESCRIPTION(text, OG_DEVICE_FORM)
#define OG_DEVICE_3(text, ...) OG_NO_DESCRIPTION(text, OG_DEVICE_FORM)
#define OG_DEVICE_4(text, T, name, way, doc) OG_DEVICE_5(text, T, name, way, doc, "")
#define OG_DEVICE_5(text, T, name, way, doc, unit) OG_APPLY_WAY(text, OG_WAY_##way(T, name, doc, unit), OG_WAYLESS, (), ~)
#define OG_DEVICE_6(text, ...) OG_EXCESS(text, OG_DEVICE_FORM)
#define OG_APPLY_WAY(...) OG_APPLY_WAY_(__VA_ARGS__)
#define OG_APPLY_WAY_(text, probe, M, arguments, ...) OG_CALL_WAY(M, (text, OG_UNWRAP arguments))
#define OG_CALL_WAY(M, arguments) M arguments
#define OG_WAY_read(...) ~, OG_WAY, (DEVR, __VA_ARGS__)
#define OG_WAY_write(...) ~, OG_WAY, (DEVW, __VA_ARGS__)
#define OG_WAY(text, K, T, name, doc, unit) (K, 0, 0, 0, T, name, OG_ZERO, doc, unit, text)
#define OG_WAYLESS(text, ...) OG_ERROR("'" text "' declares neither read nor write: write " OG_DEVICE_FORM)

// condition(name, "what")
#define OG_WORD_condition(...) ~, OG_BARE, (__VA_ARGS__)
#define OG_BARE(text, ...) OG_CAT(OG_BARE_, OG_COUNT(__VA_ARGS__))(text, __VA_ARGS__)
#define OG_BARE_FORM "condition(name, \"what it is\"), or condition_of(T, name, \"what it is\") for one with a value"
#define OG_BARE_1(text, ...) OG_NO_DESCRIPTION(text, OG_BARE_FORM)
#define OG_BARE_2(text, name, doc) (BARE, 0, 0, 0, bool, name, OG_ZERO, doc, "", text)
#define OG_BARE_3(text, ...) OG_EXCESS(text, OG_BARE_FORM)
#define OG_BARE_4(text, ...) OG_EXCESS(text, OG_BARE_FORM)

// size(n, least, most[, "what"])
#define OG_WORD_size(...) ~, OG_SIZE_ITEM, (__VA_ARGS__)
#define OG_SIZE_ITEM(text, ...) OG_CAT(OG_SIZE_, OG_COUNT(__VA_ARGS__))(text, __VA_ARGS__)
#define OG_SIZE_FORM "size(n, least, most)"
#define OG_SIZE_1(text, ...) OG_ERROR("'" text "' has no number of elements: write " OG_SIZE_FORM)
#define OG_SIZE_2(text, ...) OG_SIZE_1(text)
#define OG_SIZE_3(text, n, least, most) OG_SIZE_4(text, n, least, most, "number of elements")
#define OG_SIZE_4(text, n, least, most, doc) (SIZE, most, 0, least, uint32_t, n, least, doc, "", text)

// A value in an initialiser: a list in parentheses becomes one in braces, anything else stays.
#define OG_BRACES(value) OG_CAT(OG_VALUE_, OG_ONE_OR_LIST(OG_UNWRAP value))(value)
#ifdef __cplusplus
#define OG_VALUE_ONE(value) { value }
#else
#define OG_VALUE_ONE(value) value // for an array too: braces may be left out there, and may not be written round a scalar
#endif
#define OG_VALUE_LIST(value) { OG_UNWRAP value }
#define OG_ONE_OR_LIST(...) OG_COUNT_(__VA_ARGS__, OG_LIST7, OG_LIST8, OG_LIST8, OG_LIST8, OG_LIST8, OG_LIST8, OG_LIST8, OG_LIST8, ONE, ~)
#define OG_LIST7 LIST, LIST, LIST, LIST, LIST, LIST, LIST
#define OG_LIST8 OG_LIST7, LIST
#define OG_LENGTH_LIST(value) OG_COUNT value
#define OG_LENGTH_ONE(value) 0

// ---- What the list of a block becomes ----
// A pass goes over the tuples: OG_EACH names what it does with one of each kind. Actions take
// (block, index, KIND, mode, flags, ratio, T, name, value, doc, unit, text).

#define OG_EACH(C, i, t, ...) OG_CALL(OG_EACH_, (C, i, (__VA_ARGS__), OG_UNWRAP t))
#define OG_EACH_(C, i, choices, K, ...) OG_KIND_##K choices(C, i, K, __VA_ARGS__)
#define OG_KIND_IN(reads, writes, param, state, cond, bare, size, error) reads
#define OG_KIND_PAST(reads, writes, param, state, cond, bare, size, error) reads
#define OG_KIND_DEVR(reads, writes, param, state, cond, bare, size, error) reads
#define OG_KIND_OUT(reads, writes, param, state, cond, bare, size, error) writes
#define OG_KIND_DEVW(reads, writes, param, state, cond, bare, size, error) writes
#define OG_KIND_PARAM(reads, writes, param, state, cond, bare, size, error) param
#define OG_KIND_STATE(reads, writes, param, state, cond, bare, size, error) state
#define OG_KIND_COND(reads, writes, param, state, cond, bare, size, error) cond
#define OG_KIND_BARE(reads, writes, param, state, cond, bare, size, error) bare
#define OG_KIND_SIZE(reads, writes, param, state, cond, bare, size, error) size
#define OG_KIND_ERROR(reads, writes, param, state, cond, bare, size, error) error
#define OG_NOTHING(...)

// Mistakes in plain words, before anything else can stumble over them.
#define OG_CHECK(C, i, t) OG_EACH(C, i, t, OG_CHECK_ITEM, OG_CHECK_ITEM, OG_CHECK_ITEM, OG_CHECK_ITEM, OG_CHECK_ITEM, OG_CHECK_NAME, OG_CHECK_SIZE, OG_CHECK_ERROR)
#define OG_CHECK_ERROR(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) OG_ASSERT(0, doc);
#define OG_CHECK_NAME(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) \
    OG_ASSERT(!OG_HAS_BRACKET(#name), "'" text "': the brackets belong to the type: write word(double[6], name, ...)"); \
    OG_ASSERT(OG_IS_QUOTED(#doc), "'" text "' has no description in quotes where it belongs");
#define OG_CHECK_ITEM(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) \
    OG_CHECK_NAME(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) \
    OG_ASSERT(OG_CLASS(T) != OG_CLASS_OTHER_WIDTH, "'" text "': the width of this type differs between machines: write int32_t, uint8_t, ..."); \
    OG_ASSERT(!OG_IS_SIZED(#T) || opengpac_sizes_##C == 1, "'" text "': the brackets hold neither a number nor the name of a size(n, least, most)"); \
    OG_ASSERT((mode) != OG_RATIO || (ratio) >= 1, "'" text "': the ratio must be 1 or more"); \
    OG_ASSERT(!((flags) & OG_HISTORY) || ((ratio) >= 1 && (ratio) <= 4096), "'" text "': a history must hold 1 to 4096 values"); \
    OG_ASSERT(!((flags) & OG_HISTORY) || !OG_IS_SIZED(#T), "'" text "': all values of a history must have the same length: write a number into the brackets"); \
    OG_ASSERT(OG_CAT(OG_LENGTH_, OG_ONE_OR_LIST(OG_UNWRAP value))(value) == 0 || OG_CLASS(T) == OG_CLASS_STRUCT || \
        OG_CAT(OG_LENGTH_, OG_ONE_OR_LIST(OG_UNWRAP value))(value) == sizeof(__typeof__(T)) / OG_BASE_SIZE(T), \
        "'" text "': the list in parentheses must have as many values as the type has elements");
#define OG_CHECK_SIZE(C, i, K, most, flags, least, T, name, value, doc, unit, text) \
    OG_ASSERT(__builtin_strcmp(#name, "self") && __builtin_strcmp(#name, "invocation"), "'" text "': the body already has 'self' and 'invocation': choose another name"); \
    OG_CHECK_NAME(C, i, K, most, flags, least, T, name, value, doc, unit, text) \
    OG_ASSERT((least) >= 1 && (least) <= (most) && (most) <= 65536, "'" text "': the minimum size must be 1 or more, the maximum at least that and at most 65536"); \
    OG_ASSERT(opengpac_sizes_##C == 1, "'" text "': a block can have only one size");

// The name of the size: a constant for the struct, and a variable for the body.
#define OG_ONLY_SIZE(C, i, t, M) OG_EACH(C, i, t, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, M, OG_NOTHING)
#define OG_SIZES(C, i, t) OG_ONLY_SIZE(C, i, t, OG_SIZES_OF)
#ifdef __cplusplus
#define OG_SIZES_OF(C, i, K, most, flags, least, T, name, ...) enum { name = most };
#else
// The array has no length before the first block that has a size of this name, and two elements after it.
#define OG_SIZES_OF(C, i, K, most, flags, least, T, name, ...) \
    extern char opengpac_size_##name[]; \
    OG_ASSERT(__builtin_types_compatible_p(__typeof__(opengpac_size_##name), char[1]), \
        "the size '" #name "' of block '" #C "' has the name of another block's size: in C give each block of a file its own size name, for example " #name "_" #C); \
    extern char opengpac_size_##name[2]; \
    enum { name = most };
#endif
#define OG_MOST(C, i, t) OG_ONLY_SIZE(C, i, t, OG_MOST_OF)
#define OG_MOST_OF(C, i, K, most, ...) + (most)
#define OG_HAS_SIZE(C, i, t) OG_ONLY_SIZE(C, i, t, OG_HAS_SIZE_OF)
#define OG_HAS_SIZE_OF(...) + 1
#define OG_VARIABLE(C, i, t) OG_ONLY_SIZE(C, i, t, OG_VARIABLE_OF)
#define OG_VARIABLE_OF(C, i, K, most, flags, least, T, name, ...) , __attribute__((unused)) uint32_t name
#define OG_ACTUAL(C, i, t) OG_ONLY_SIZE(C, i, t, OG_ACTUAL_OF)
#define OG_ACTUAL_OF(...) , opengpac_n
#define OG_FIND_SIZE(C, i, t) OG_ONLY_SIZE(C, i, t, OG_FIND_SIZE_OF)
#define OG_FIND_SIZE_OF(C, i, K, most, flags, least, T, name, ...) opengpac_n = opengpac_m->self.name < (most) ? opengpac_m->self.name : (most);

// A name for each type, so that it is written down once.
#define OG_TYPES(C, i, t) OG_EACH(C, i, t, OG_TYPES_OF, OG_TYPES_OF, OG_TYPES_OF, OG_TYPES_OF, OG_TYPES_OF, OG_NOTHING, OG_TYPES_OF, OG_NOTHING)
#define OG_TYPES_OF(C, i, K, mode, flags, ratio, T, name, ...) typedef __typeof__(T) opengpac_type_##C##_##name OG_CAT(OG_LENGTH_OF_, K)(ratio);
#define OG_LENGTH_OF_IN(n)
#define OG_LENGTH_OF_PAST(n) [(n) < 1 ? 1 : (n)]
#define OG_LENGTH_OF_OUT(n)
#define OG_LENGTH_OF_DEVR(n)
#define OG_LENGTH_OF_DEVW(n)
#define OG_LENGTH_OF_PARAM(n)
#define OG_LENGTH_OF_STATE(n)
#define OG_LENGTH_OF_COND(n)
#define OG_LENGTH_OF_SIZE(n)

// self: a field for each value and each report; the bit of a condition is the size of an array that nobody makes.
#define OG_FIELDS(C, i, t) OG_EACH(C, i, t, OG_FIELDS_OF, OG_FIELDS_OF, OG_FIELDS_OF, OG_FIELDS_OF, OG_FIELDS_COND, OG_NOTHING, OG_FIELDS_OF, OG_NOTHING)
#define OG_FIELDS_COND(C, i, K, mode, flags, ratio, T, name, value, ...) \
    OG_FIELDS_OF(C, i, K, mode, flags, ratio, T, name, value, ~) opengpac_type_##C##_##name opengpac_report_##name OG_IN_CXX(= {});
#ifdef __cplusplus
#define OG_IN_CXX(...) __VA_ARGS__
#else
#define OG_IN_CXX(...)
#endif
#define OG_FIELDS_OF(C, i, K, mode, flags, ratio, T, name, value, ...) opengpac_type_##C##_##name name OG_IN_CXX(= OG_BRACES(value));
#define OG_BITS(C, i, t) OG_EACH(C, i, t, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_BITS_OF, OG_BITS_OF, OG_NOTHING, OG_NOTHING)
#define OG_BITS_OF(C, i, K, mode, flags, ratio, T, name, ...) char(*opengpac_bit_##name)[(i) + 1];

#define OG_ADDRESSES(C, i, t) OG_EACH(C, i, t, OG_ADDRESSES_OF, OG_ADDRESSES_OF, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING)
#define OG_ADDRESSES_OF(C, i, K, mode, flags, ratio, T, name, ...) opengpac_type_##C##_##name *at_##name OG_IN_CXX(= nullptr);

#define OG_INITIAL(C, i, t) OG_EACH(C, i, t, OG_INITIAL_OF, OG_INITIAL_OF, OG_INITIAL_OF, OG_INITIAL_OF, OG_INITIAL_OF, OG_NOTHING, OG_INITIAL_OF, OG_NOTHING)
#define OG_INITIAL_OF(C, i, K, mode, flags, ratio, T, name, value, ...) .name = OG_BRACES(value),

// The entry: load, (body), check, store.
#define OG_BYTES(C, T, name) (OG_IS_SIZED(#T) ? opengpac_n * (sizeof(opengpac_type_##C##_##name) / OG_DIVISOR(opengpac_most_##C)) : sizeof(opengpac_type_##C##_##name))
#define OG_DIVISOR(n) ((n) + !(n))
#define OG_LOAD(C, i, t) OG_EACH(C, i, t, OG_LOAD_BOUND, OG_LOAD_OWN, OG_LOAD_OWN, OG_LOAD_OWN, OG_LOAD_COND, OG_NOTHING, OG_LOAD_OWN, OG_NOTHING)
#define OG_LOAD_BOUND(C, i, K, mode, flags, ratio, T, name, ...) __builtin_memcpy(&opengpac_local.name, opengpac_given_in && opengpac_given_in[i] ? opengpac_given_in[i] : opengpac_m->at_##name, OG_BYTES(C, T, name));
#define OG_LOAD_OWN(C, i, K, mode, flags, ratio, T, name, ...) __builtin_memcpy(&opengpac_local.name, &opengpac_m->self.name, OG_BYTES(C, T, name));
#define OG_LOAD_COND(C, i, K, mode, flags, ratio, T, name, ...) \
    OG_LOAD_OWN(C, i, K, mode, flags, ratio, T, name, ~) \
    __builtin_memcpy(&opengpac_local.opengpac_report_##name, &opengpac_m->self.opengpac_report_##name, OG_BYTES(C, T, name));
#define OG_TOP(C, i, t) OG_EACH(C, i, t, OG_NOTHING, OG_TOP_OF, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING)
#define OG_TOP_OF(C, i, K, mode, flags, ratio, T, name, ...) \
    if (!((flags) & OG_MAY_BE_NONFINITE)) opengpac_top |= opengpac_nonfinite(&opengpac_local.name, OG_BYTES(C, T, name), OG_CLASS(T), #T);
#define OG_WHICH(C, i, t) OG_EACH(C, i, t, OG_NOTHING, OG_WHICH_OF, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING)
#define OG_WHICH_OF(C, i, K, mode, flags, ratio, T, name, ...) \
    if (!((flags) & OG_MAY_BE_NONFINITE) && opengpac_nonfinite(&opengpac_local.name, OG_BYTES(C, T, name), OG_CLASS(T), #T) >> 63) return OG_NONFINITE | (uint64_t)(i) << 8;
// Equal values have equal bytes: padding is 0, if the compiler can set it. A replay compares bytes.
#ifdef __has_builtin
#if __has_builtin(__builtin_clear_padding)
#define OG_CLEAR_PADDING(address) __builtin_clear_padding(address);
#endif
#endif
#ifndef OG_CLEAR_PADDING
#define OG_CLEAR_PADDING(address)
#endif
#define OG_CLEAR(C, i, t) OG_EACH(C, i, t, OG_NOTHING, OG_CLEAR_OF, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING)
#define OG_CLEAR_OF(C, i, K, mode, flags, ratio, T, name, ...) OG_CLEAR_PADDING(&opengpac_local.name)
#define OG_PASS(C, i, t) OG_EACH(C, i, t, OG_NOTHING, OG_PASS_OUT, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING)
#define OG_PASS_OUT(C, i, K, mode, flags, ratio, T, name, ...) if (opengpac_given_out && opengpac_given_out[i]) __builtin_memcpy(opengpac_given_out[i], &opengpac_local.name, OG_BYTES(C, T, name));
#define OG_STORE(C, i, t) OG_EACH(C, i, t, OG_NOTHING, OG_STORE_BOUND, OG_NOTHING, OG_STORE_OWN, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING)
#define OG_STORE_BOUND(C, i, K, mode, flags, ratio, T, name, ...) \
    if ((mode) != OG_RATIO || (opengpac_now.number - opengpac_m->header.activated + 1) % OG_DIVISOR(ratio) == 0) \
        __builtin_memcpy(opengpac_m->at_##name, &opengpac_local.name, OG_BYTES(C, T, name)); \
    OG_STORE_OWN(C, i, K, mode, flags, ratio, T, name, ~)
#define OG_STORE_OWN(C, i, K, mode, flags, ratio, T, name, ...) __builtin_memcpy(&opengpac_m->self.name, &opengpac_local.name, OG_BYTES(C, T, name));
#define OG_REPORTS(C, i, t) OG_EACH(C, i, t, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_NOTHING, OG_REPORTS_OF, OG_NOTHING, OG_NOTHING, OG_NOTHING)
#define OG_REPORTS_OF(C, i, K, mode, flags, ratio, T, name, ...) \
    __builtin_memcpy(&opengpac_m->self.opengpac_report_##name, &opengpac_local.opengpac_report_##name, OG_BYTES(C, T, name));

// The table of items.
#define OG_ITEMS(C, i, t) OG_EACH(C, i, t, OG_ITEMS_BOUND, OG_ITEMS_BOUND, OG_ITEMS_OWN, OG_ITEMS_OWN, OG_ITEMS_COND, OG_ITEMS_BARE, OG_ITEMS_SIZE, OG_NOTHING)
#define OG_AT(C, member) (uint32_t)__builtin_offsetof(struct opengpac_instance_##C, member)
#define OG_ITEMS_OF(C, kind, mode, flags, ratio, T, name, doc, unit, address, report_offset) \
    {kind, mode, (flags) | (OG_IS_SIZED(#T) ? OG_SIZED : 0), ratio, #name, #T, unit, doc, OG_AT(C, self.name), (uint32_t)sizeof(opengpac_type_##C##_##name), \
     address, report_offset, (uint32_t)(sizeof(opengpac_type_##C##_##name) / (OG_IS_SIZED(#T) ? OG_DIVISOR(opengpac_most_##C) : (flags) & OG_HISTORY ? OG_DIVISOR(ratio) : 1)), 0},
#define OG_ITEMS_BOUND(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) \
    OG_ITEMS_OF(C, OG_NUMBER_##K, mode, flags, ratio, T, name, doc, unit, OG_AT(C, at_##name), OG_NONE)
#define OG_ITEMS_OWN(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) \
    OG_ITEMS_OF(C, OG_NUMBER_##K, mode, flags, ratio, T, name, doc, unit, OG_NONE, OG_NONE)
#define OG_ITEMS_COND(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) \
    OG_ITEMS_OF(C, OG_CONDITION, mode, flags, ratio, T, name, doc, unit, OG_NONE, OG_AT(C, self.opengpac_report_##name))
#define OG_ITEMS_BARE(C, i, K, mode, flags, ratio, T, name, value, doc, unit, text) \
    {OG_CONDITION, 0, 0, 0, #name, "", "", doc, OG_NONE, 0, OG_NONE, OG_NONE, 0, 0},
#define OG_ITEMS_SIZE(C, i, K, most, flags, least, T, name, value, doc, unit, text) \
    {OG_SIZE, 0, 0, least, #name, "uint32_t", "", doc, OG_AT(C, self.name), 4, OG_NONE, OG_NONE, most, 0},
#define OG_NUMBER_IN OG_INPUT
#define OG_NUMBER_PAST OG_INPUT
#define OG_NUMBER_OUT OG_OUTPUT
#define OG_NUMBER_DEVR OG_DEVICE_READ
#define OG_NUMBER_DEVW OG_DEVICE_WRITE
#define OG_NUMBER_PARAM OG_PARAMETER
#define OG_NUMBER_STATE OG_STATE

#ifdef __cplusplus
#define OG_NAMESPACE(C) namespace opengpac_block_##C {
#define OG_END_NAMESPACE }
#define OG_SCOPE(C) opengpac_block_##C::
#define OG_IMAGE(C, ...) static constexpr opengpac_instance_##C opengpac_image_##C = {};
#else
#define OG_NAMESPACE(C)
#define OG_END_NAMESPACE
#define OG_SCOPE(C)
#define OG_IMAGE(C, ...) \
    _Pragma("GCC diagnostic push") _Pragma("GCC diagnostic ignored \"-Wmissing-braces\"") \
    static const struct opengpac_instance_##C opengpac_image_##C = {.self = {.opengpac_reports = 0, OG_MAP(OG_INITIAL, C, __VA_ARGS__)}}; \
    _Pragma("GCC diagnostic pop")
#endif

// A C++ exception that leaves a body is a fault of the block: further out nobody could catch it. What it says goes with it.
#ifdef __cpp_exceptions
enum { OG_WHAT_MAX = 200 };
__attribute__((cold, noinline, unused)) static uint64_t opengpac_threw(const char *what) {
    static char text[OG_WHAT_MAX + 1]; // the last byte stays 0
    size_t length = what ? __builtin_strlen(what) : 0;
    if (length > OG_WHAT_MAX) length = OG_WHAT_MAX;
    for (size_t i = 0; i < OG_WHAT_MAX; i++) text[i] = i < length ? what[i] : 0;
    return OG_THREW | (uint64_t)(uintptr_t)text << 8;
}
#define OG_TRY(...) \
    try { __VA_ARGS__ } \
    catch (const std::exception &thrown) { opengpac_result.word = opengpac_threw(thrown.what()); } \
    catch (...) { opengpac_result.word = opengpac_threw("it is not a std::exception"); }
#else
#define OG_TRY(...) __VA_ARGS__
#endif

// FUNCTION_BLOCK(name, "what it computes", items...) { body }
#define FUNCTION_BLOCK(NAME, ...) OG_CAT(OG_BLOCK_, OG_ONE_OR_LIST(__VA_ARGS__))(NAME, __VA_ARGS__)
#define OG_BLOCK_ONE(NAME, ...) \
    OG_ASSERT(0, "FUNCTION_BLOCK(" #NAME ", ...) has no items: write FUNCTION_BLOCK(name, \"what it computes\", items...)"); \
    static opengpac_outcome opengpac_body_##NAME(void)
// A bank entry runs each step exactly as `run` does. Before one begins, its index and all that the step before has stored are in memory: a
// signal finds which it was. A large block spends its time in its body: it has no second text of that.
#define OG_BEGIN_STEP(step, index) \
    __asm__ volatile("" ::: "memory"); \
    *(volatile uint32_t *)(step) = (index); \
    __asm__ volatile("" ::: "memory");
#define OG_BANKED_SIZE_MAX 1024
#define OG_BANK(NAME) \
    static uint64_t opengpac_bank_##NAME(const opengpac_call *calls, uint32_t *step, uint32_t from, uint32_t to) { \
        for (uint32_t index = from; index < to; index++) { \
            OG_BEGIN_STEP(step, index) \
            const opengpac_call *call = calls + index; \
            uint64_t result = OG_IS_BANKED(NAME) ? opengpac_once_##NAME(call->instance, call->invocation, 0, 0) : opengpac_run_##NAME(call->instance, call->invocation); \
            if (result != OG_DONE) return result; \
        } \
        return OG_DONE; \
    } \
    static const opengpac_bank_entry opengpac_bank_entry_##NAME = {opengpac_run_##NAME, OG_IS_BANKED(NAME) ? opengpac_bank_##NAME : (opengpac_bank)0}; \
    static const opengpac_bank_entry *const opengpac_bank_pointer_##NAME __attribute__((section("opengpac_banks"), used)) = &opengpac_bank_entry_##NAME;
#define OG_IS_BANKED(NAME) (sizeof(struct opengpac_instance_##NAME) <= OG_BANKED_SIZE_MAX)
#define OG_BLOCK_LIST(NAME, DOC, ...) OG_BLOCK(NAME, DOC OG_MAP(OG_TUPLE, ~, __VA_ARGS__))
#define OG_BLOCK(...) OG_BLOCK_OF(__VA_ARGS__)
#define OG_BLOCK_OF(NAME, DOC, ...) \
    OG_NAMESPACE(NAME) \
    OG_MAP(OG_SIZES, NAME, __VA_ARGS__) \
    enum { opengpac_most_##NAME = 0 OG_MAP(OG_MOST, NAME, __VA_ARGS__), opengpac_sizes_##NAME = 0 OG_MAP(OG_HAS_SIZE, NAME, __VA_ARGS__) }; \
    OG_ASSERT(OG_IS_QUOTED(#DOC), "FUNCTION_BLOCK(" #NAME ", ...) has no description: write FUNCTION_BLOCK(name, \"what it computes\", items...)"); \
    OG_MAP(OG_CHECK, NAME, __VA_ARGS__) \
    OG_MAP(OG_TYPES, NAME, __VA_ARGS__) \
    struct opengpac_self_##NAME { \
        union { uint64_t opengpac_reports OG_IN_CXX(= 0); OG_MAP(OG_BITS, NAME, __VA_ARGS__) }; \
        OG_MAP(OG_FIELDS, NAME, __VA_ARGS__) \
    }; \
    struct opengpac_instance_##NAME { opengpac_header header; OG_MAP(OG_ADDRESSES, NAME, __VA_ARGS__) struct opengpac_self_##NAME self; }; \
    OG_END_NAMESPACE \
    OG_INLINE opengpac_outcome opengpac_body_##NAME(struct OG_SCOPE(NAME) opengpac_self_##NAME *, const Invocation * OG_MAP(OG_VARIABLE, NAME, __VA_ARGS__)); \
    OG_NAMESPACE(NAME) \
    /* One invocation. Fused blocks hand values on: what is given for an item in `given_in` is its value; `given_out` takes it, too. */ \
    OG_INLINE uint64_t opengpac_once_##NAME(void *opengpac_memory, const Invocation *opengpac_given, __attribute__((unused)) const void *const *opengpac_given_in, __attribute__((unused)) void *const *opengpac_given_out) { \
        struct opengpac_instance_##NAME *opengpac_m = (struct opengpac_instance_##NAME *)opengpac_memory; \
        struct opengpac_self_##NAME opengpac_local; \
        Invocation opengpac_now; \
        __attribute__((unused)) uint32_t opengpac_n = 0; \
        uint64_t opengpac_top = 0; \
        opengpac_outcome opengpac_result; \
        opengpac_now.number = opengpac_m->header.number; \
        opengpac_now.time_ns = opengpac_given->time_ns; \
        opengpac_now.now_ns = opengpac_given->now_ns; \
        *(volatile uint64_t *)&opengpac_m->header.number = (opengpac_now.number + 1) | OG_RUNNING; \
        OG_MAP(OG_FIND_SIZE, NAME, __VA_ARGS__) \
        opengpac_local.opengpac_reports = 0; \
        OG_MAP(OG_LOAD, NAME, __VA_ARGS__) \
        OG_TRY(opengpac_result = opengpac_body_##NAME(&opengpac_local, &opengpac_now OG_MAP(OG_ACTUAL, NAME, __VA_ARGS__));) \
        if (opengpac_result.word == OG_DONE) { OG_MAP(OG_TOP, NAME, __VA_ARGS__) } \
        OG_MAP(OG_CLEAR, NAME, __VA_ARGS__) \
        OG_MAP(OG_PASS, NAME, __VA_ARGS__) \
        /* From here on it is not ended: nothing below comes before the mark is gone. */ \
        *(volatile uint64_t *)&opengpac_m->header.number = opengpac_now.number + 1; \
        __asm__ volatile("" ::: "memory"); \
        if (__builtin_expect(opengpac_result.word != OG_DONE, 0)) return opengpac_result.word; \
        if (__builtin_expect((int64_t)opengpac_top < 0, 0)) { OG_MAP(OG_WHICH, NAME, __VA_ARGS__) } \
        OG_MAP(OG_STORE, NAME, __VA_ARGS__) \
        if (__builtin_expect(opengpac_local.opengpac_reports != 0, 0)) { OG_MAP(OG_REPORTS, NAME, __VA_ARGS__) } \
        return opengpac_local.opengpac_reports; \
    } \
    static uint64_t opengpac_run_##NAME(void *memory, const Invocation *given) { return opengpac_once_##NAME(memory, given, 0, 0); } \
    OG_BANK(NAME) \
    OG_IMAGE(NAME, __VA_ARGS__) \
    static const opengpac_item opengpac_items_##NAME[] = {OG_MAP(OG_ITEMS, NAME, __VA_ARGS__)}; \
    static const opengpac_descriptor opengpac_descriptor_##NAME = { \
        OPENGPAC_ABI, sizeof(opengpac_items_##NAME) / sizeof(opengpac_item), #NAME, DOC, opengpac_items_##NAME, &opengpac_image_##NAME, \
        sizeof(struct opengpac_instance_##NAME), __alignof__(struct opengpac_instance_##NAME), opengpac_run_##NAME, __FILE__, __LINE__, 0}; \
    static const opengpac_descriptor *const opengpac_block_pointer_##NAME __attribute__((section("opengpac_blocks"), used)) = &opengpac_descriptor_##NAME; \
    OG_END_NAMESPACE \
    OG_INLINE opengpac_outcome opengpac_body_##NAME( \
        __attribute__((unused)) struct OG_SCOPE(NAME) opengpac_self_##NAME *self, __attribute__((unused)) const Invocation *invocation OG_MAP(OG_VARIABLE, NAME, __VA_ARGS__))

// TYPE(name, "what it is", field(T, member), ...): a struct type that items may have.
#define TYPE(NAME, DOC, ...) \
    typedef struct { OG_MAP(OG_MEMBER, NAME, __VA_ARGS__) } NAME; \
    OG_TYPE_CLASS(NAME, OG_CLASS_STRUCT); \
    OG_INLINE uint64_t opengpac_nonfinite_of_##NAME(const void *memory) { \
        const NAME *p = (const NAME *)memory; \
        uint64_t top = 0; \
        OG_MAP(OG_MEMBER_TOP, NAME, __VA_ARGS__) \
        return top; \
    } \
    static const opengpac_type_record opengpac_record_##NAME = { \
        {#NAME, "struct {" OG_MAP(OG_MEMBER_TEXT, NAME, __VA_ARGS__) " }", DOC, sizeof(NAME), __alignof__(NAME)}, opengpac_nonfinite_of_##NAME}; \
    static const opengpac_type_descriptor *const opengpac_type_pointer_##NAME __attribute__((section("opengpac_types"), used)) = &opengpac_record_##NAME.type
#define OG_FIELD_field(...) ~, OG_FIELD, (__VA_ARGS__, ~)
#define OG_FIELD(text, T, member, ...) (FIELD, T, member, text)
#define OG_NO_FIELD(text, ...) (NO_FIELD, int, error, "'" text "' is not a member of a TYPE: write field(T, name)")
#define OG_MEMBER_TUPLE(item) OG_APPLY(#item, OG_FIELD_##item, OG_NO_FIELD, (), ~)
#define OG_MEMBER(C, i, item) OG_CALL_MEMBER(OG_MEMBER_, OG_MEMBER_TUPLE(item))
#define OG_MEMBER_TOP(C, i, item) OG_CALL_MEMBER(OG_TOP_, OG_MEMBER_TUPLE(item))
#define OG_MEMBER_TEXT(C, i, item) OG_CALL_MEMBER(OG_TEXT_, OG_MEMBER_TUPLE(item))
#define OG_CALL_MEMBER(M, t) OG_CALL_MEMBER_(M, OG_UNWRAP t)
#define OG_CALL_MEMBER_(...) OG_CALL_MEMBER_OF(__VA_ARGS__)
#define OG_CALL_MEMBER_OF(M, K, ...) OG_CAT(M, K)(__VA_ARGS__)
#define OG_MEMBER_FIELD(T, member, text) \
    OG_ASSERT(!OG_HAS_BRACKET(#member), "'" text "': the brackets belong to the type: write field(double[6], name)"); \
    OG_ASSERT(OG_CLASS(T) != OG_CLASS_OTHER_WIDTH, "'" text "': the width of this type differs between machines: write int32_t, uint8_t, ..."); \
    __typeof__(T) member;
#define OG_MEMBER_NO_FIELD(T, member, text) OG_ASSERT(0, text);
#define OG_TOP_FIELD(T, member, text) top |= opengpac_nonfinite(&p->member, sizeof(p->member), OG_CLASS(T), #T);
#define OG_TOP_NO_FIELD(T, member, text)
#define OG_TEXT_FIELD(T, member, text) " " #T " " #member ";"
#define OG_TEXT_NO_FIELD(T, member, text)

// ---- What a code module exports ----
// Each translation unit brings it, the linker keeps one; it lists the blocks and types of all of them.

#if defined(__x86_64__)
#define OG_TARGET "x86_64-linux"
#elif defined(__aarch64__)
#define OG_TARGET "aarch64-linux"
#elif defined(__riscv) && __riscv_xlen == 64
#define OG_TARGET "riscv64-linux"
#else
#define OG_TARGET "other"
#endif

OG_EXTERN_C __attribute__((weak, visibility("default"))) const opengpac_module_table *opengpac_module(void);
OG_EXTERN_C __attribute__((weak, visibility("default"))) const opengpac_module_table *opengpac_module(void) {
    static opengpac_module_table opengpac_module_here;
    opengpac_module_here.abi = OPENGPAC_ABI;
    opengpac_module_here.block_count = (uint32_t)(__stop_opengpac_blocks - __start_opengpac_blocks);
    opengpac_module_here.blocks = __start_opengpac_blocks;
    opengpac_module_here.type_count = (uint32_t)(__stop_opengpac_types - __start_opengpac_types);
    opengpac_module_here.types = __start_opengpac_types;
    opengpac_module_here.target = OG_TARGET;
    opengpac_module_here.compiler = __VERSION__;
    return &opengpac_module_here;
}

// The bank entry of the block with this `run`, if it has one: who does not ask runs it step by step.
OG_EXTERN_C __attribute__((weak, visibility("default"))) opengpac_bank opengpac_bank_1(uint64_t (*run)(void *, const Invocation *));
OG_EXTERN_C __attribute__((weak, visibility("default"))) opengpac_bank opengpac_bank_1(uint64_t (*run)(void *, const Invocation *)) {
    for (const opengpac_bank_entry *const *entry = __start_opengpac_banks; entry != __stop_opengpac_banks; entry++)
        if ((*entry)->run == run) return (*entry)->bank;
    return (opengpac_bank)0;
}

#endif
