// SPDX-License-Identifier: Apache-2.0
//! Faulty drivers: the example in C with one defect each. The intended check refuses it with its cause, and no other check fails. The
//! Python ones are in `tests/python/drivers/test_broken_classes.py`.
//!
//! A quarter of them, a different one each day, runs the whole kit; the others stop at the first check that fails, as `opengpac driver
//! check` does. `OPENGPAC_BROKEN_DRIVERS=all` runs the whole kit for all of them, `OPENGPAC_SEED` selects the day.
use crate::{built, checked, checked_until_it_fails};
use driver_kit::conformance::Report;
use serde_json::json;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Text that some of them place before everything else.
const BEFORE: &str = "#define _GNU_SOURCE
#include <fenv.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>
__attribute__((unused)) static void *stays(void *none) { for (;;) pause(); return none; }
__attribute__((unused)) static void begin(void) { pthread_t thread; pthread_create(&thread, 0, stays, 0); }
#include <opengpac_driver.h>
__attribute__((unused)) static opengpac_slot lamp;\n";

/// Limit of a check that must not be reached.
const LIMIT: Duration = Duration::from_secs(120);
/// Limit for drivers that hang.
const SHORT: Duration = Duration::from_secs(15);

/// Returns the options of `opengpac driver check` for the example with one change.
#[track_caller]
fn made(name: &str, right: &str, wrong: &str) -> String {
    let example = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/drivers/conveyor.c")).expect("it is there");
    assert!(example.contains(right), "the example has no '{right}'");
    let source = format!("{BEFORE}{}", example.replacen(right, wrong, 1));
    format!("conveyor@{}", built(name, &source).display())
}

#[track_caller]
fn changed(name: &str, right: &str, wrong: &str) -> Report {
    checked(&made(name, right, wrong), &json!({}))
}

/// Returns true if this one runs the whole kit today.
fn is_whole(name: &str) -> bool {
    let day = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    let seed = std::env::var("OPENGPAC_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or_else(day);
    let place: u64 = name.bytes().map(u64::from).sum();
    std::env::var("OPENGPAC_BROKEN_DRIVERS").is_ok_and(|text| text == "all") || (place + seed).is_multiple_of(4)
}

#[track_caller]
fn refused(name: &str, right: &str, wrong: &str, checks: &[&str], cause: &str) {
    if !is_whole(name) {
        return refused_at_once(name, right, wrong, checks[0], cause, LIMIT);
    }
    let report = changed(name, right, wrong);
    let failed = report.failed();
    assert_eq!(failed.iter().map(|(check, _)| *check).collect::<Vec<_>>(), checks, "{report}");
    assert!(failed[0].1.contains(cause), "{failed:?}");
}

/// Checks that the first failing check is this one, with this cause.
#[track_caller]
fn refused_at_once(name: &str, right: &str, wrong: &str, check: &str, cause: &str, limit: Duration) {
    let report = checked_until_it_fails(&made(name, right, wrong), &json!({}), limit);
    let failed = report.failed();
    assert_eq!(failed.iter().map(|(check, _)| *check).collect::<Vec<_>>(), [check], "{report}");
    assert!(failed[0].1.contains(cause), "{failed:?}");
    assert!(!failed[0].1.contains('\n'), "{failed:?}");
}

macro_rules! faulty {
    ($($name:ident: $right:expr => $wrong:expr, $checks:expr, $cause:expr;)*) => {
        $(#[test]
        fn $name() {
            refused(stringify!($name), $right, $wrong, &$checks, $cause);
        })*
    };
}

faulty! {
    no_doc: r#""A conveyor that follows its effort, x' = gain u.""# => r#""""#,
        ["doc"], "it is empty";
    unit_with_blanks: r#""its speed for an effort of 1", "m/s (0, 100]""# => r#""its speed for an effort of 1", "m / s""#,
        ["option-units"], "'gain' has the unit 'm / s', which is not known";
    time_without_unit: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), option_whole(delay_ns, 5, "how long"),"#,
        ["option-units"], "'delay_ns' is not a whole number in ns";
    option_without_doc: r#""its speed for an effort of 1""# => r#""""#,
        ["option-docs"], "'gain': it is empty";
    option_twice: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), option_number(gain, 1.0, "again"),"#,
        ["option-names"], "'gain' appears twice";
    option_of_its_class: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), exchange(worker), option_whole(period_ns, 1, "its own", "ns"),"#,
        ["option-of-class"], "'period_ns' does";
    waits_backwards: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), waits(-1),"#,
        ["life-waits"], "it waits for -1 ns";
    lost_after_minutes: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), lost_within(INT64_C(120000000000)),"#,
        ["life-lost"], "it is 120000000000 ns";
    safe_by_nobody: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", 0, 0)"#,
        ["safe-by"], "it has no means";
    safe_too_late: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", INT64_C(20000000000), BY_DRIVER)"#,
        ["safe-time"], "it is 20000000000 ns";
    counter_twice: r#"counter      (exchanges, "readings so far"),"# => r#"counter(exchanges, "readings so far"), counter(exchanges, "again"),"#,
        ["counter-words"], "'exchanges' appears twice";
    right_without_a_way: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), right("everything"),"#,
        ["rights"], "'everything'";
    service_without_doc: r#"service_of   (place, number, "where it is")"# => r#"service_of(place, number, "")"#,
        ["service-words"], "'place': it is empty";
    argument_with_a_bad_unit: r#"service_of   (place, number, "where it is")"# => r#"service_of(place, number, "where it is"), option_text(of, "belt", "which", "m")"#,
        ["service-arguments"], "'place': 'of' is not a number but has the unit m";
    channel_with_blanks: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); reads(host, "bool", "belt sensor", "", "");"#,
        ["channel-names"], "'belt sensor' is not a valid name";
    safe_value_nan: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); writes(host, "double", "lamp.level", __builtin_nan(""), "", "");"#,
        ["safe-values"], "that of 'lamp.level' is not finite";
    slew_below_zero: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); host->channel(host, &(opengpac_channel){sizeof(opengpac_channel), 1, "lamp.level", "double", "", "", 0.0, -1.0});"#,
        ["slews"], "that of 'lamp.level' is -1";
    other_channels_each_time: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); static int made; reads(host, "double", because("x.y%d", made++), "", "");"#,
        ["channels-stable"], "a second driver has different ones";
    part_without_channels: r#".name = "belt""# => r#".name = "blet""#,
        ["parts"], "part 'blet' needs the channels";
    watchdog_too_short: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); watchdog(host, 5);"#,
        ["watchdog"], "it is 5 ns";
    descriptors_left: r#"    self->at_ns = now_ns;
    return OK;"# => r#"    extern int dup(int); dup(2);
    self->at_ns = now_ns;
    return OK;"#,
        ["descriptors"], "20 are left";
    threads_left: r#"    self->at_ns = now_ns;
    return OK;"# => r#"    begin();
    self->at_ns = now_ns;
    return OK;"#,
        ["threads"], "20 are left";
    safe_only_when_open: "{ self->speed = 0.0; }" => "{ if (!self->at_ns) __builtin_trap(); self->speed = 0.0; }",
        ["safe-unopened"], "it ended its process: was ended by SIG";
    first_reading_nan: "    set_number(readings, self->position, place);" => r#"    set_number(readings, self->position, *self->exchanges ? place : __builtin_nan(""));"#,
        ["first-reading"], "'belt.position' is not finite";
    stores_behind_its_channels: r#"    count(self->exchanges, 1);
    return OK;"# => r#"    readings[24] = 1;
    count(self->exchanges, 1);
    return OK;"#,
        ["readings-whole"], "bytes beyond it have changed";
    changes_commands: "    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => r#"    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;
    ((uint8_t *)commands)[0] = 1;"#,
        ["commands-kept"], "they differ after it";
    drifts: "    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => "    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.7;",
        ["unengaged", "creep"], "within 20 firings";
    leaps_when_engaged: "    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => r#"    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;
    if (is_engaged(engaged, self->effort) && self->bias.index != 7) self->place += 0.5, self->bias.index = 7;"#,
        ["no-leap"], "goes from 0 to 0.5 in one firing";
    divides_by_no_time: r#"    self->at_ns = release_ns;
    set_number(readings, self->position, place);"# => r#"    set_number(readings, self->velocity, 0.0);
    double rate = self->speed * (double)(release_ns - self->at_ns) / (double)(release_ns - self->at_ns);
    self->at_ns = release_ns;
    set_number(readings, self->position, *self->exchanges ? place + 0.0 * rate : place);"#,
        ["time-stands"], "'belt.position' is not finite";
    nan_goes_through: "!__builtin_isfinite(effort)" => "__builtin_isinf(effort)",
        ["nan"], "'belt.position' is not finite";
    infinity_goes_through: "!__builtin_isfinite(effort)" => "__builtin_isnan(effort)",
        ["infinity"], "'belt.position' is not finite";
    breaks_at_the_greatest_number: "    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => r#"    if (effort == __DBL_MAX__) __builtin_trap();
    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;"#,
        ["huge"], "it ended its process: was ended by SIG";
    breaks_at_some_bytes: "    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => r#"    uint64_t bits; get_value(commands, self->effort, &bits, 8); if (bits == UINT64_C(0x0101010101010101)) __builtin_trap();
    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;"#,
        ["all-bytes"], "it ended its process: was ended by SIG";
    nan_after_many_readings: "    set_number(readings, self->position, place);" => r#"    set_number(readings, self->position, *self->exchanges > 200 ? __builtin_nan("") : place);"#,
        ["readings-stay-finite"], "'belt.position' is not finite after";
    creeps: "is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => "is_engaged(engaged, self->effort) ? self->gain * effort : 0.05;",
        ["creep"], "although nothing commands it";
    ignores_its_effort: "is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => "0.0;",
        ["moves", "moves-alone", "moves-late"], "the command is ignored, or the reading is frozen";
    reading_freezes: "    set_number(readings, self->position, place);" => "    if (*self->exchanges == 0) set_number(readings, self->position, place);",
        ["moves", "moves-alone", "moves-late"], "'belt.position' does not change when 'belt' is commanded to move in either direction";
    velocity_of_the_wrong_sign: "    set_number(readings, self->velocity, self->speed);" => "    set_number(readings, self->velocity, -self->speed);",
        ["velocity-sign"], "while 'belt.velocity' is -";
    velocity_always_zero: "    set_number(readings, self->velocity, self->speed);" => "    set_number(readings, self->velocity, 0.0);",
        ["velocity-sign", "velocity-size"], "on average";
    // Computes for a fifth longer than the limit, in processor time, so that it does so on every machine and no longer than needed.
    spins: "    count(self->exchanges, 1);" => r#"    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    int64_t until_ns = now.tv_sec * INT64_C(1000000000) + now.tv_nsec + 300000;
    do clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    while (now.tv_sec * INT64_C(1000000000) + now.tv_nsec < until_ns);
    count(self->exchanges, 1);"#,
        ["brief"], "it computes for";
    prints: "    count(self->exchanges, 1);" => r#"    if (write(1, "reading\n", 8) < 8) return "nobody reads";
    count(self->exchanges, 1);"#,
        ["prints"], "bytes in 50 exchanges";
    allocates: r#"    count(self->exchanges, 1);
    return OK;"# => r#"    extern void *malloc(size_t); extern void free(void *); void *volatile block = malloc(100); free(block);
    count(self->exchanges, 1);
    return OK;"#,
        ["allocation", "sanitizer"], "500 times in 500 firings";
    allocates_in_its_safe_state: "{ self->speed = 0.0; }" => r#"{
    extern void *malloc(size_t); extern void free(void *); void *volatile block = malloc(100); free(block);
    self->speed = 0.0; }"#,
        ["safe-allocation", "sanitizer"], "1 times";
    waits_in_its_reading: r#"    count(self->exchanges, 1);
    return OK;"# => r#"    extern int usleep(unsigned); usleep(1);
    count(self->exchanges, 1);
    return OK;"#,
        ["waiting", "sanitizer"], "its thread gave up its processor";
    memory_grows: r#"    count(self->exchanges, 1);
    return OK;"# => r#"    extern void *malloc(size_t); if (*self->exchanges % 5000 == 4999) { void *volatile block = malloc(1 << 20); (void)block; }
    count(self->exchanges, 1);
    return OK;"#,
        ["memory"], "more bytes";
    counter_falls: "    count(self->exchanges, 1);" => "    *self->exchanges = (*self->exchanges + 1) % 50;",
        ["counters-grow"], "'exchanges' goes from 49 to 0";
    no_safe_state: "{ self->speed = 0.0; }" => "{ (void)self; }",
        ["safe-rests"], "within 10 firings";
    truth_value_of_two: r#"    self->exchanges = counter_of(host, "exchanges");
    return OK;
}"# => r#"    self->exchanges = counter_of(host, "exchanges");
    lamp = reads(host, "bool", "lamp.on", "whether it shines", "");
    return OK;
}
static uint8_t shines = 2;
#define set_number(readings, at, value) (set_number)(readings, at, value), set_value(readings, lamp, &shines, 1)"#,
        ["truth-values"], "'lamp.on' is 2";
    pushes_the_wrong_way: "? self->gain * effort : 0.0;" => "? -self->gain * effort : 0.0;",
        ["moves-alone"], "when 'belt' alone is commanded to move up, and by 5.";
    freezes_late: "    set_number(readings, self->position, place);" => "    if (*self->exchanges < 1500) set_number(readings, self->position, place);",
        ["moves-late"], "after 2000 firings 'belt.position' does not change when";
    velocity_in_degrees: "    set_number(readings, self->velocity, self->speed);" => "    set_number(readings, self->velocity, self->speed * 57.29577951308232);",
        ["velocity-size"], "'belt.position' changes by 5.000e-2 within 0.050 s while 'belt.velocity' is 5.730e1 on average";
    velocity_in_turns: "    set_number(readings, self->velocity, self->speed);" => "    set_number(readings, self->velocity, self->speed / 6.283185307179586);",
        ["velocity-size"], "while 'belt.velocity' is 1.592e-1 on average";
    rounds_upward: "    count(self->exchanges, 1);" => "    count(self->exchanges, 1);\n    fesetround(FE_UPWARD);",
        ["arithmetic-kept"], "the exchange changes it";
    takes_over_a_signal: "    self->at_ns = now_ns;\n    return OK;" => "    signal(SIGSEGV, SIG_IGN);\n    self->at_ns = now_ns;\n    return OK;",
        ["signals-kept"], "open sets a handler for signal 11";
    blocks_signals: "    count(self->exchanges, 1);" => "    count(self->exchanges, 1);\n    sigset_t all; sigfillset(&all); pthread_sigmask(SIG_BLOCK, &all, 0);",
        ["signals-kept"], "the exchange changes whether its thread receives signal";
    changes_the_folder: "    self->at_ns = now_ns;\n    return OK;" => "    if (chdir(\"/\")) return \"no root\";\n    self->at_ns = now_ns;\n    return OK;",
        ["folder-kept"], "open goes from '";
    processes_left: "    self->at_ns = now_ns;\n    return OK;" => r#"    char *words[] = {"true", 0}, *none[] = {0}; posix_spawnp(&(pid_t){0}, "true", 0, 0, words, none);
    self->at_ns = now_ns;
    return OK;"#,
        ["processes"], "20 are left";
    guard_without_handles: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", 0, BY_DRIVER | BY_GUARD)"#,
        ["safe-handles"], "it declares the guard but has none";
    device_without_a_watchdog: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", 0, BY_DRIVER | BY_DEVICE)"#,
        ["watchdog-by"], "it has none with these options";
}

macro_rules! ending {
    ($($name:ident: $right:expr => $wrong:expr, $check:expr, $cause:expr;)*) => {
        $(#[test]
        fn $name() {
            refused_at_once(stringify!($name), $right, $wrong, $check, $cause, SHORT);
        })*
    };
}

const OPENED: &str = "    self->at_ns = now_ns;\n    return OK;";
const COUNTED: &str = "    count(self->exchanges, 1);";
const RESTED: &str = "{ self->speed = 0.0; }";

// These drivers end their process or never return: many checks fail, and the first one states the cause.
ending! {
    exits_as_it_is_opened: OPENED => "    _exit(3);", "opens", "it ended its process: ended by itself with status 3";
    hangs_as_it_is_opened: OPENED => "    for (;;) pause();", "opens", "it did not return within 15 s";
    refuses_to_be_opened: OPENED => "    return \"no such port\";", "opens", "no such port";
    exits_in_its_reading: COUNTED => "    exit(3);", "open-twice", "it ended its process: ended by itself with status 3";
    aborts_in_its_reading: COUNTED => "    abort();", "open-twice", "it ended its process: was ended by SIGABRT";
    reads_at_no_address: COUNTED => "    *(volatile int *)8 = 1;", "open-twice", "it ended its process: was ended by SIGSEGV";
    recurses_without_end: COUNTED => "    volatile char room[1 << 22]; room[0] = 1; room[sizeof room - 1] = 1;
    const char *why = conveyor_read(self, release_ns + room[0], readings); if (room[1]) return why;",
        "open-twice", "it ended its process: was ended by SIGSEGV";
    // At the lowest priority, so that the tests beside it get the processor. The result of `nice` is used, and is always below 20.
    spins_for_ever: COUNTED => "    if (nice(19) < 20) for (volatile int turn = 0; ; turn = 1 - turn);", "open-twice", "it did not return within 15 s";
    waits_for_itself: COUNTED => "    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER; pthread_mutex_lock(&lock); pthread_mutex_lock(&lock);",
        "open-twice", "it did not return within 15 s";
    fails_in_its_reading: COUNTED => "    return \"the bus is silent\";", "dropped-open", "the bus is silent";
    fails_late: COUNTED => "    count(self->exchanges, 1); if (*self->exchanges > 300) return \"gone\";", "readings-stay-finite", "its reading fails: gone";
    hangs_in_its_safe_state: RESTED => "{ self->speed = 0.0; for (;;) pause(); }", "safe-unopened", "it did not return within 15 s";
}

/// A real drive may show its velocity only if a whole cycle of its own passes between two readings; no driver can compensate for that.
#[test]
fn a_velocity_that_shows_at_the_pace_of_the_wall_is_right() {
    let right = "    set_number(readings, self->velocity, self->speed);";
    let wrong = r#"    static int64_t seen_ns; struct timespec now; clock_gettime(CLOCK_MONOTONIC, &now);
    int64_t now_ns = now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
    set_number(readings, self->velocity, now_ns - seen_ns > 500000 ? self->speed : 0.0);
    seen_ns = now_ns;"#;
    let report = changed("at_the_pace_of_the_wall", right, wrong);
    assert_eq!(report.failed(), [], "{report}");
}
