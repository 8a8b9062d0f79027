// SPDX-License-Identifier: Apache-2.0
//! Drivers in C: the bytes that both sides share, a driver from source to exchange, and files that are not drivers.
use device::{Class, Driver, Slot};
use driver_kit::foreign::abi;
use modules::BuildOptions;
use serde_json::{Value, json};
use std::fmt::Write;
use std::mem::offset_of;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder in which a test builds; deleted on drop.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("opengpac-foreign-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("temporary files can be written");
        Folder(path)
    }

    /// Builds a driver from this source.
    fn built(&self, name: &str, source: &str) -> String {
        let file = self.0.join(format!("{name}.c"));
        std::fs::write(&file, source).expect("temporary files can be written");
        modules::build(&[file], &BuildOptions::default()).expect("it compiles").display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn example() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/drivers/conveyor.c")).expect("the example is there")
}

fn open(kind: &str, options: &Value) -> Result<(Box<dyn Driver>, Value), String> {
    driver_kit::lend();
    device::open(kind, options).map_err(|why| why.to_string())
}

macro_rules! layout {
    ($($rust:ident as $c:literal { $($member:ident $(as $name:literal)?),* })*) => {
        [$(($c, vec![$(([$($name,)? stringify!($member)][0], offset_of!(abi::$rust, $member))),*], size_of::<abi::$rust>())),*]
    };
}

#[test]
fn every_offset_is_the_same() {
    let structs = layout! {
        Item as "opengpac_driver_item" { what, kind, name, doc, unit, text, number, whole, needed, by }
        Slot as "opengpac_slot" { offset, index }
        Channel as "opengpac_channel" { size, is_written, name, type_text as "type", doc, unit, safe, slew_max }
        Part as "opengpac_part" { size, is_slide, by_position, reserved, name, range_min, range_max, effort_max, speed_max, home, kp, kd }
        Handle as "opengpac_handle" { size, latches, descriptor, length, offset, bytes }
        Host as "opengpac_host" { abi, size, at, number, whole, text, json, length, number_at, text_at, channel, part, counter, watchdog, handle, answer, found }
        Driver as "opengpac_driver" { size, line, name, doc, file, items, item_size, item_count, instance_size, make, open, read, write, safe_state, close, handles, service, scan, taken }
        Module as "opengpac_driver_module" { abi, size, drivers, count, reserved, target, compiler }
    };
    let constants = [
        ("OPENGPAC_DRIVER_ABI", abi::ABI),
        ("OGD_OPTION", abi::what::OPTION),
        ("OGD_CLASS", abi::what::CLASS),
        ("OGD_WAITS", abi::what::WAITS),
        ("OGD_LOST_WITHIN", abi::what::LOST_WITHIN),
        ("OGD_SAFE", abi::what::SAFE),
        ("OGD_COUNTER", abi::what::COUNTER),
        ("OGD_RIGHT", abi::what::RIGHT),
        ("OGD_SERVICE", abi::what::SERVICE),
        ("OGD_NOTHING", abi::kind::NOTHING),
        ("OGD_NUMBER", abi::kind::NUMBER),
        ("OGD_WHOLE", abi::kind::WHOLE),
        ("OGD_BOOL", abi::kind::BOOL),
        ("OGD_TEXT", abi::kind::TEXT),
        ("OGD_LIST", abi::kind::LIST),
        ("OGD_TABLE", abi::kind::TABLE),
        ("OGD_INLINE", abi::class::INLINE),
        ("OGD_WORKER", abi::class::WORKER),
        ("BY_DRIVER", abi::by::DRIVER),
        ("BY_GUARD", abi::by::GUARD),
        ("BY_DEVICE", abi::by::DEVICE),
        ("BY_END", abi::by::END),
    ];
    let mut program = String::from("#include <opengpac_driver.h>\nint main(void) {\n");
    let mut expected = String::new();
    for (name, members, size) in structs {
        for (member, offset) in members {
            writeln!(program, "printf(\"{name}.{member} %zu\\n\", offsetof({name}, {member}));").unwrap();
            writeln!(expected, "{name}.{member} {offset}").unwrap();
        }
        writeln!(program, "printf(\"{name} %zu\\n\", sizeof({name}));").unwrap();
        writeln!(expected, "{name} {size}").unwrap();
    }
    for (name, value) in constants {
        writeln!(program, "printf(\"{name} %u\\n\", (unsigned){name});").unwrap();
        writeln!(expected, "{name} {value}").unwrap();
    }
    program.push_str("return 0;\n}\n");
    let folder = Folder::new("offsets");
    let (source, binary) = (folder.0.join("offsets.c"), folder.0.join("offsets"));
    std::fs::write(&source, program).unwrap();
    modules::write_header(&folder.0).unwrap();
    let compiler = modules::compiler(false, None).unwrap();
    let built = Command::new(&compiler[0]).args(&compiler[1..]).arg("-I").arg(&folder.0).arg(&source).arg("-o").arg(&binary).status().unwrap();
    assert!(built.success());
    let printed = Command::new(&binary).output().unwrap();
    assert_eq!(String::from_utf8(printed.stdout).unwrap(), expected);
}

#[test]
fn the_example_moves_counts_and_answers() {
    let folder = Folder::new("example");
    let kind = format!("conveyor@{}", folder.built("conveyor", &example()));
    let of = {
        driver_kit::lend();
        device::find(&kind).expect("it declares itself")
    };
    assert_eq!((of.kind, of.class, of.safe_state.doc), ("conveyor", Class::Inline, "it stands still"));
    assert_eq!((of.options[0].name, of.options[0].unit, of.options[0].default), ("gain", "m/s", Some("1.0")));
    let (mut driver, about) = open(&kind, &json!({ "gain": 2 })).expect("its options are right");
    assert_eq!((&about["parts"][0]["name"], &about["parts"][0]["unit"], &about["parts"][0]["effort_max"]), (&json!("belt"), &json!("m"), &json!(1e6)));
    let names: Vec<_> = driver.channels().iter().map(|channel| (channel.name.as_str(), channel.offset, channel.unit.as_str())).collect();
    assert_eq!(names, [("belt.position", 0, "m"), ("belt.velocity", 8, "m/s"), ("belt.bias", 16, "N"), ("belt.effort", 0, "N")]);
    let mut readings = [0; 24];
    assert!(driver.read(0, &mut readings).is_err(), "it is not open");
    driver.open(1_000).expect("it is there");
    driver.read(1_000, &mut readings).expect("it answers");
    driver.write(1_000, &0.5_f64.to_ne_bytes(), &[true]).expect("it takes commands");
    driver.read(1_000_001_000, &mut readings).expect("it answers");
    assert_eq!(Slot { offset: 0, len: 8 }.double(&readings, 0), 1.0);
    let services = driver.services().expect("it declares one");
    assert_eq!(services.call("place", &json!({})).map_err(|why| why.message), Ok(json!(1.0)));
    assert!(services.call("plcae", &json!({})).is_err_and(|why| why.message.contains("did you mean 'place'?")));
    assert_eq!(driver.counters().expect("it declares one").get(0_usize), 2);
    let lost = driver.write(5, &f64::NAN.to_ne_bytes(), &[true]).expect_err("it is no number");
    assert_eq!(lost.message, "at 5 ns its effort is not a number");
    driver.safe_state();
    driver.read(2_000_001_000, &mut readings).expect("it answers");
    assert_eq!(Slot { offset: 0, len: 8 }.double(&readings, 0), 1.0, "it stands still");
    assert!(driver.open(0).is_err_and(|why| why.message.contains("open the device again")));
    driver.close();
    assert!(services.call("place", &json!({})).is_err_and(|why| why.message == "the device is closed"));
    assert!(open(&kind, &json!({ "gain": -1 })).err().expect("refused").contains("option 'gain': it cannot be -1 m/s: its range is above 0 m/s to 100 m/s"));
    assert!(open(&kind, &json!({ "gain": "fast" })).err().expect("refused").contains("option 'gain': it must be a number in m/s"));
}

#[test]
fn a_service_that_moves_the_machine_says_so() {
    let folder = Folder::new("moving");
    let source = r#"
#include <opengpac_driver.h>
struct lift {
    int floor;
};
DRIVER(lift, "A lift.",
    service(look, "looks where it is"),
    moving_service(home, "goes to the ground floor"),
    option_number(speed, 1.0, "how fast", "m/s"))
const char *lift_make(struct lift *self, opengpac_host *host) {
    (void)self, (void)host;
    return OK;
}
const char *lift_read(struct lift *self, int64_t release_ns, uint8_t *readings) {
    (void)self, (void)release_ns, (void)readings;
    return OK;
}
const char *lift_service(struct lift *self, opengpac_host *host, const char *name) {
    (void)self, (void)host, (void)name;
    return OK;
}
"#;
    let kind = format!("lift@{}", folder.built("lift", source));
    driver_kit::lend();
    let services = device::find(&kind).expect("it declares itself").services;
    assert_eq!(services.iter().map(|of| (of.name, of.moves, of.arguments.len())).collect::<Vec<_>>(), [("look", false, 0), ("home", true, 1)]);
    let (driver, _) = open(&kind, &json!({})).expect("it has no options");
    let services = driver.services().expect("it has two");
    assert!(services.call_moving("home", &json!({}), &|| false).is_ok_and(|answer| answer.is_null()));
    assert!(services.call_moving("home", &json!({}), &|| true).is_err_and(|why| why.message == device::under_a_stop("home").message));
}

#[test]
fn what_is_wrong_with_a_driver_is_said() {
    let folder = Folder::new("wrong");
    let refused = |name: &str, source: &str| {
        let text = format!("#include <opengpac_driver.h>\nstruct d {{ int x; }};\n{source}");
        open(&format!("d@{}", folder.built(name, &text)), &json!({})).err().expect("it is refused")
    };
    let make = "const char *d_make(struct d *s, opengpac_host *h) { (void)s; (void)h; MAKE; return OK; }
        const char *d_read(struct d *s, int64_t t, uint8_t *r) { (void)s; (void)t; (void)r; return OK; }\n";
    let with = |body: &str| make.replace("MAKE", body);
    for (name, source, words) in [
        ("none", String::new(), "it has no driver: declare one with DRIVER"),
        ("unmade", "DRIVER(d, \"a d\")".to_owned(), "driver 'd' has no function d_make"),
        ("list", format!("DRIVER(d, \"a d\", option_list(ids, \"[1\", \"ids\"))\n{}", with("")), "the default of option 'ids', '[1', is not a list"),
        (
            "twice",
            format!("DRIVER(d, \"a d\")\n{}", with("reads(h, \"double\", \"a.b\", \"\", \"\"); reads(h, \"bool\", \"a.b\", \"\", \"\")")),
            "channel 'a.b' is declared twice",
        ),
        ("type", format!("DRIVER(d, \"a d\")\n{}", with("reads(h, \"int\", \"a.b\", \"\", \"\")")), "channel 'a.b': there is no type 'int'"),
        ("option", format!("DRIVER(d, \"a d\")\n{}", with("given_number(h, \"gan\")")), "it asks for 'gan', which it does not declare"),
        ("unsafe", format!("DRIVER(d, \"a d\")\n{}", with("writes(h, \"double\", \"a.b\", 0, \"\", \"\")")), "no function d_write or d_safe_state"),
        ("service", format!("DRIVER(d, \"a d\", service(home, \"goes home\"))\n{}", with("")), "declares services but has no function d_service"),
        ("cause", format!("DRIVER(d, \"a d\")\n{}", with("return because(\"no board %d\", 3)")), "driver 'd': no board 3"),
    ] {
        let said = refused(name, &source);
        assert!(said.contains(words), "{name}: {said}");
    }
    let block = "#include <opengpac.h>\nFUNCTION_BLOCK(gain, \"y\", out(double, y, \"y\")) { return OK; }\n";
    assert!(
        open(&format!("d@{}", folder.built("block", block)), &json!({})).err().expect("refused").contains("include opengpac_driver.h and declare a DRIVER")
    );
    let later = example().replace("#include <opengpac_driver.h>", "#include <opengpac_driver.h>\n#undef OPENGPAC_DRIVER_ABI\n#define OPENGPAC_DRIVER_ABI 2");
    let header = opengpac::DRIVER_HEADER.replace("#define OPENGPAC_DRIVER_ABI 1", "#define OPENGPAC_DRIVER_ABI 2");
    std::fs::write(folder.0.join("later.h"), header).unwrap();
    let later = folder.built("later", &later.replace("#include <opengpac_driver.h>", "#include \"later.h\""));
    assert!(open(&format!("conveyor@{later}"), &json!({})).err().expect("refused").contains("it has version 2 of the driver interface, but this system has 1"));
    let known = folder.built("known", &example());
    assert!(open(&format!("convyor@{known}"), &json!({})).err().expect("refused").contains("there is no driver 'convyor' in"));
    assert!(open("conveyor@/no/such.so", &json!({})).err().expect("refused").contains("'/no/such.so'"));
    assert!(open("conveyor@/no/such.xyz", &json!({})).err().expect("refused").contains("files that end in .so"));
}
