// SPDX-License-Identifier: Apache-2.0
//! Items of a declaration, as in `opengpac_driver.h`: options, class, life cycle, safe state, counters, privileges, services.
use crate::abi::{Item, class, kind, what};
use std::ffi::CStr;

/// Agents that bring a device to its safe state, and kinds of answers of a service.
pub use crate::abi::{by, kind as answers};

const fn item(what: u32, name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    let text = c"".as_ptr();
    Item { what, kind: 0, name: name.as_ptr(), doc: doc.as_ptr(), unit: unit.as_ptr(), text, number: 0.0, whole: 0, needed: 0, by: 0 }
}

const fn needed(kind: u32, name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind, needed: 1, ..item(what::OPTION, name, doc, unit) }
}

/// Declares a number option with its default. After a service, this and the functions below declare arguments of that service.
pub const fn option_number(name: &'static CStr, default: f64, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind: kind::NUMBER, number: default, ..item(what::OPTION, name, doc, unit) }
}

/// Declares an integer option with its default.
pub const fn option_whole(name: &'static CStr, default: i64, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind: kind::WHOLE, whole: default, ..item(what::OPTION, name, doc, unit) }
}

/// Declares a Boolean option with its default.
pub const fn option_bool(name: &'static CStr, default: bool, doc: &'static CStr) -> Item {
    Item { kind: kind::BOOL, whole: default as i64, ..item(what::OPTION, name, doc, c"") }
}

/// Declares a text option with its default.
pub const fn option_text(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::TEXT, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// Declares a list option with its default as JSON.
pub const fn option_list(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::LIST, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// Declares a table option with its default as JSON.
pub const fn option_table(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::TABLE, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// Declares a required number option.
pub const fn needed_number(name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    needed(kind::NUMBER, name, doc, unit)
}

/// Declares a required integer option.
pub const fn needed_whole(name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    needed(kind::WHOLE, name, doc, unit)
}

/// Declares a required Boolean option.
pub const fn needed_bool(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::BOOL, name, doc, c"")
}

/// Declares a required text option.
pub const fn needed_text(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::TEXT, name, doc, c"")
}

/// Declares a required list option.
pub const fn needed_list(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::LIST, name, doc, c"")
}

/// Declares a required table option.
pub const fn needed_table(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::TABLE, name, doc, c"")
}

/// Declares that the driver exchanges on a separate thread, and may block.
pub const fn worker() -> Item {
    Item { kind: class::WORKER, ..item(what::CLASS, c"", c"", c"") }
}

/// Declares the time for which `open` waits for a machine that is not present yet, ns.
pub const fn waits(ns: i64) -> Item {
    Item { whole: ns, ..item(what::WAITS, c"", c"", c"") }
}

/// Declares the maximum time from the last response of a machine until its device is reported as lost, ns.
pub const fn lost_within(ns: i64) -> Item {
    Item { whole: ns, ..item(what::LOST_WITHIN, c"", c"", c"") }
}

/// Declares the safe state, and the maximum time within which the driver reaches it, ns.
pub const fn safe(doc: &'static CStr, within_ns: i64) -> Item {
    safe_by(doc, within_ns, by::DRIVER)
}

/// Declares a safe state that other agents can also establish: `by::DRIVER | by::GUARD | by::DEVICE | by::END`.
pub const fn safe_by(doc: &'static CStr, within_ns: i64, by: u32) -> Item {
    Item { whole: within_ns, by, ..item(what::SAFE, c"", doc, c"") }
}

/// Declares a counter of the driver.
pub const fn counter(name: &'static CStr, doc: &'static CStr) -> Item {
    item(what::COUNTER, name, doc, c"")
}

/// Declares a privilege that the driver requires, and the way to grant it.
pub const fn right(doc: &'static CStr) -> Item {
    item(what::RIGHT, c"", doc, c"")
}

/// Declares a service that runs outside the cycle; the options that follow are its arguments.
pub const fn service(name: &'static CStr, doc: &'static CStr) -> Item {
    service_of(name, answers::NOTHING, doc)
}

/// Declares a service with an answer: `answers::NUMBER`, `WHOLE`, `BOOL`, `TEXT`, `LIST` or `TABLE`.
pub const fn service_of(name: &'static CStr, answer: u32, doc: &'static CStr) -> Item {
    Item { kind: answer, ..item(what::SERVICE, name, doc, c"") }
}

/// Declares a service that moves the machine. Such a service is refused while an emergency stop is latched.
pub const fn moving_service(name: &'static CStr, doc: &'static CStr) -> Item {
    Item { whole: 1, ..service(name, doc) }
}
