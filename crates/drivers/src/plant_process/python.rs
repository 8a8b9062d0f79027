// SPDX-License-Identifier: Apache-2.0
//! A driver in Python, in a process of its own. The process runs the driver [`OBJECT`], which is registered by the program that embeds
//! Python. Process, memory and life cycle are those of a plant, except that the process brings its outputs to their safe state and exits
//! when the process that commands it does.
use super::driver::Bounds;
use super::plant_messages::PlantOrigin;
use super::starting::opened;
use device::{Class, Declaration, DriverError, GivenOptions, Kind, Life, OpenedDriver, OptionWord, Reach, SafeBy, SafeState, interpreter};
use serde::Deserialize;
use serde_json::Value;

const KIND: &str = "python";
/// Kind of driver that the process runs.
const OBJECT: &str = "python_object";
const PERIOD_NS: i64 = 10_000_000;
/// Module of the package to be run as the process.
const PROCESS: &str = "opengpac.driver.process";

pub(crate) static DRIVER: Declaration = Declaration {
    class: Class::Process,
    life: Life { waits_ns: 0, lost_within_ns: 10 * PERIOD_NS },
    safe_state: SafeState {
        doc: "each output carries its safe value, and its safe_state() was called",
        by: &[SafeBy::Driver, SafeBy::Guard],
        within_ns: 2 * PERIOD_NS,
    },
    in_virtual_time: Some(in_place),
    ..Declaration::new(KIND, "a driver written in Python, in a separate process", &OPTIONS, open)
};

const OPTIONS: [OptionWord; 8] = [
    OptionWord::with_default("path", Kind::Text, "none: module is given", "file that contains its class").reaches(Reach::Code),
    OptionWord::with_default("module", Kind::Text, "none: path is given", "module that contains its class").reaches(Reach::Code),
    OptionWord::with_default("class", Kind::Text, "the only one in it", "name of its class"),
    OptionWord::with_default("options", Kind::Table, "none", "what the class declares as Option"),
    OptionWord::with_default("paths", Kind::List, "those of its interpreter", "further folders in which its process looks for modules").reaches(Reach::Code),
    OptionWord::with_default("period_ns", Kind::Whole, "10 ms", "period of its exchange()").unit("ns").within(1e5, 6e10),
    OptionWord::with_default(
        "age_max_ns",
        Kind::Whole,
        "10 periods, at least 100 ms; it may then deliver nothing new for a long time",
        "maximum age of a reading: with older ones the device is lost",
    )
    .unit("ns")
    .within(2e5, 3.6e12),
    OptionWord::with_default("timeout_ns", Kind::Whole, "none", "its watchdog: after this time without new commands it is made safe, and lost")
        .unit("ns")
        .within(1e6, 3.6e12),
];

#[derive(Deserialize)]
struct Options {
    period_ns: Option<i64>,
    age_max_ns: Option<i64>,
    timeout_ns: Option<i64>,
    /// Options of the driver that the process runs; they have already been checked.
    #[serde(flatten)]
    object: serde_json::Map<String, Value>,
}

/// Returns the driver for virtual time: the same class in this process.
fn in_place(options: &Value) -> Option<(String, Value)> {
    let options: Options = serde_json::from_value(options.clone()).ok()?;
    let mut object = options.object;
    if let Some(timeout_ns) = options.timeout_ns {
        object.insert("timeout_ns".to_owned(), timeout_ns.into());
    }
    Some((OBJECT.to_owned(), Value::Object(object)))
}

fn open(given: &GivenOptions<'_>) -> Result<OpenedDriver, DriverError> {
    let options: Options = given.read()?;
    device::find(OBJECT)?;
    let period_ns = options.period_ns.unwrap_or(PERIOD_NS);
    let age_max_ns = options.age_max_ns.unwrap_or((10 * period_ns).max(10 * PERIOD_NS));
    if age_max_ns < 2 * period_ns {
        return Err(given.wrong("age_max_ns", format!("give at least two periods, {} ms", 2.0 * period_ns as f64 * 1e-6)));
    }
    let made = PlantOrigin {
        kind: OBJECT.to_owned(),
        options: Value::Object(options.object),
        step_ns: Some(period_ns),
        linger_ns: 0,
        timeout_ns: options.timeout_ns,
        rest_ns: Some(age_max_ns),
        name: None,
    };
    let command = [interpreter(), "-m".into(), PROCESS.into()].into();
    let bounds = Bounds { silent_ns: age_max_ns, taken_max_ns: options.age_max_ns, timeout_ns: options.timeout_ns };
    opened(given, KIND, made, command, bounds, None)
}
