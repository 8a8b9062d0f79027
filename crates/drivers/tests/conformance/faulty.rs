// SPDX-License-Identifier: Apache-2.0
//! Faulty drivers: the example in C with one thing wrong in it. The check that is meant refuses it, with its cause, and no other check does.
use crate::{built, checked};
use driver_kit::conformance::Report;
use serde_json::json;
use std::path::Path;

/// Text that some of them have before everything else.
const BEFORE: &str = "#define _GNU_SOURCE\n#include <pthread.h>\n#include <time.h>\n#include <unistd.h>
__attribute__((unused)) static void *stays(void *none) { for (;;) pause(); return none; }
__attribute__((unused)) static void begin(void) { pthread_t thread; pthread_create(&thread, 0, stays, 0); }\n";

/// The report on the example with one thing changed in it.
#[track_caller]
fn changed(name: &str, right: &str, wrong: &str) -> Report {
    let example = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/drivers/conveyor.c")).expect("it is there");
    assert!(example.contains(right), "the example has no '{right}'");
    let source = format!("{BEFORE}{}", example.replacen(right, wrong, 1));
    checked(&format!("conveyor@{}", built(name, &source).display()), &json!({}))
}

#[track_caller]
fn refused(name: &str, right: &str, wrong: &str, checks: &[&str], cause: &str) {
    let report = changed(name, right, wrong);
    let failed = report.failed();
    assert_eq!(failed.iter().map(|(check, _)| *check).collect::<Vec<_>>(), checks, "{report}");
    assert!(failed[0].1.contains(cause), "{failed:?}");
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
        ["option-units"], "'gain' is in 'm / s', which is no unit";
    time_without_unit: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), option_whole(delay_ns, 5, "how long"),"#,
        ["option-units"], "'delay_ns' is no whole number in ns";
    option_without_doc: r#""its speed for an effort of 1""# => r#""""#,
        ["option-docs"], "'gain': it is empty";
    option_twice: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), option_number(gain, 1.0, "again"),"#,
        ["option-names"], "'gain' is there twice";
    option_of_its_class: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), exchange(worker), option_whole(period_ns, 1, "its own", "ns"),"#,
        ["option-of-class"], "'period_ns' does";
    waits_backwards: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), waits(-1),"#,
        ["life-waits"], "it waits for -1 ns";
    lost_after_minutes: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), lost_within(INT64_C(120000000000)),"#,
        ["life-lost"], "it is 120000000000 ns";
    safe_by_nobody: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", 0, 0)"#,
        ["safe-by"], "by nothing";
    safe_too_late: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", INT64_C(20000000000), BY_DRIVER)"#,
        ["safe-time"], "it is 20000000000 ns";
    counter_twice: r#"counter      (exchanges, "readings so far"),"# => r#"counter(exchanges, "readings so far"), counter(exchanges, "again"),"#,
        ["counter-words"], "'exchanges' is there twice";
    right_without_a_way: r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"),"# => r#"option_number(gain, 1.0, "its speed for an effort of 1", "m/s (0, 100]"), right("everything"),"#,
        ["rights"], "'everything'";
    service_without_doc: r#"service_of   (place, number, "where it is")"# => r#"service_of(place, number, "")"#,
        ["service-words"], "'place': it is empty";
    argument_with_a_bad_unit: r#"service_of   (place, number, "where it is")"# => r#"service_of(place, number, "where it is"), option_text(of, "belt", "which", "m")"#,
        ["service-arguments"], "'place': 'of' is no number and is in m";
    channel_with_blanks: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); reads(host, "bool", "belt sensor", "", "");"#,
        ["channel-names"], "'belt sensor' is no name";
    safe_value_nan: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); writes(host, "double", "lamp.level", __builtin_nan(""), "", "");"#,
        ["safe-values"], "that of 'lamp.level' is not finite";
    slew_below_zero: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); host->channel(host, &(opengpac_channel){sizeof(opengpac_channel), 1, "lamp.level", "double", "", "", 0.0, -1.0});"#,
        ["slews"], "that of 'lamp.level' is -1";
    other_channels_each_time: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); static int made; reads(host, "double", because("x.y%d", made++), "", "");"#,
        ["channels-stable"], "a second driver has others";
    part_without_channels: r#".name = "belt""# => r#".name = "blet""#,
        ["parts"], "part 'blet' lacks a channel";
    watchdog_too_short: r#"self->exchanges = counter_of(host, "exchanges");"# => r#"self->exchanges = counter_of(host, "exchanges"); watchdog(host, 5);"#,
        ["watchdog"], "it has 5 ns";
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
        ["readings-whole"], "bytes behind it have changed";
    changes_commands: "    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => r#"    self->speed = is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;
    ((uint8_t *)commands)[0] = 1;"#,
        ["commands-kept"], "they are others behind it";
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
        ["creep"], "and nothing commands it";
    ignores_its_effort: "is_engaged(engaged, self->effort) ? self->gain * effort : 0.0;" => "0.0;",
        ["moves"], "the command is ignored, or the reading is frozen";
    reading_freezes: "    set_number(readings, self->position, place);" => "    if (*self->exchanges == 0) set_number(readings, self->position, place);",
        ["moves"], "'belt.position' stays the same while 'belt' is pushed each way";
    velocity_of_the_wrong_sign: "    set_number(readings, self->velocity, self->speed);" => "    set_number(readings, self->velocity, -self->speed);",
        ["velocity-sign"], "while 'belt.velocity' is -";
    velocity_always_zero: "    set_number(readings, self->velocity, self->speed);" => "    set_number(readings, self->velocity, 0.0);",
        ["velocity-sign"], "on average";
    spins: "    count(self->exchanges, 1);" => "    for (volatile int turn = 0; turn < 3000000; turn++);\n    count(self->exchanges, 1);",
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
        ["memory"], "bytes more";
    counter_falls: "    count(self->exchanges, 1);" => "    *self->exchanges = (*self->exchanges + 1) % 50;",
        ["counters-grow"], "'exchanges' goes from 49 to 0";
    no_safe_state: "{ self->speed = 0.0; }" => "{ (void)self; }",
        ["safe-rests"], "within 10 firings";
    guard_without_handles: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", 0, BY_DRIVER | BY_GUARD)"#,
        ["safe-handles"], "it declares the guard and has none";
    device_without_a_watchdog: r#"safe         ("it stands still", 0, BY_DRIVER)"# => r#"safe         ("it stands still", 0, BY_DRIVER | BY_DEVICE)"#,
        ["watchdog-by"], "it has none with these options";
}

/// A real drive may show its velocity only while a whole cycle of its own passes between two readings; no driver can make up for that.
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
