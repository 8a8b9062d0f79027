// SPDX-License-Identifier: Apache-2.0
//! Items of a declaration, as in `opengpac_driver.h`: options, class, life, safe state, counters, rights, services.
use crate::abi::{Item, class, kind, what};
use std::ffi::CStr;

/// Agents that bring about a safe state, and kinds of answers of a service.
pub use crate::abi::{by, kind as answers};

const fn item(what: u32, name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    let text = c"".as_ptr();
    Item { what, kind: 0, name: name.as_ptr(), doc: doc.as_ptr(), unit: unit.as_ptr(), text, number: 0.0, whole: 0, needed: 0, by: 0 }
}

const fn needed(kind: u32, name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind, needed: 1, ..item(what::OPTION, name, doc, unit) }
}

/// Declares an option that is a number, with its default. After a service it declares an argument of that service, here and below.
pub const fn option_number(name: &'static CStr, default: f64, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind: kind::NUMBER, number: default, ..item(what::OPTION, name, doc, unit) }
}

/// Declares an option that is an integer, with its default.
pub const fn option_whole(name: &'static CStr, default: i64, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind: kind::WHOLE, whole: default, ..item(what::OPTION, name, doc, unit) }
}

/// Declares an option that is true or false, with its default.
pub const fn option_bool(name: &'static CStr, default: bool, doc: &'static CStr) -> Item {
    Item { kind: kind::BOOL, whole: default as i64, ..item(what::OPTION, name, doc, c"") }
}

/// Declares an option that is a text, with its default.
pub const fn option_text(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::TEXT, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// Declares an option that is a list, with its default as JSON.
pub const fn option_list(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::LIST, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// Declares an option that is a table, with its default as JSON.
pub const fn option_table(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::TABLE, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// Declares a required option that is a number.
pub const fn needed_number(name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    needed(kind::NUMBER, name, doc, unit)
}

/// Declares a required option that is an integer.
pub const fn needed_whole(name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    needed(kind::WHOLE, name, doc, unit)
}

/// Declares a required option that is true or false.
pub const fn needed_bool(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::BOOL, name, doc, c"")
}

/// Declares a required option that is a text.
pub const fn needed_text(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::TEXT, name, doc, c"")
}

/// Declares a required option that is a list.
pub const fn needed_list(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::LIST, name, doc, c"")
}

/// Declares a required option that is a table.
pub const fn needed_table(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::TABLE, name, doc, c"")
}

/// Declares that the driver exchanges on a thread of its own, and may wait.
pub const fn worker() -> Item {
    Item { kind: class::WORKER, ..item(what::CLASS, c"", c"", c"") }
}

/// Declares how long `open` waits for a machine that is not present yet, ns.
pub const fn waits(ns: i64) -> Item {
    Item { whole: ns, ..item(what::WAITS, c"", c"", c"") }
}

/// Declares the maximum time from the last answer of a machine until its device is reported as lost, ns.
pub const fn lost_within(ns: i64) -> Item {
    Item { whole: ns, ..item(what::LOST_WITHIN, c"", c"", c"") }
}

/// Declares the safe state, and the time within which the driver brings it about, ns.
pub const fn safe(doc: &'static CStr, within_ns: i64) -> Item {
    safe_by(doc, within_ns, by::DRIVER)
}

/// Declares a safe state that other agents bring about too: `by::DRIVER | by::GUARD | by::DEVICE | by::END`.
pub const fn safe_by(doc: &'static CStr, within_ns: i64, by: u32) -> Item {
    Item { whole: within_ns, by, ..item(what::SAFE, c"", doc, c"") }
}

/// Declares a counter of the driver.
pub const fn counter(name: &'static CStr, doc: &'static CStr) -> Item {
    item(what::COUNTER, name, doc, c"")
}

/// Declares a right that the driver needs, and how to obtain it.
pub const fn right(doc: &'static CStr) -> Item {
    item(what::RIGHT, c"", doc, c"")
}

/// Declares a service off the cycle; the options after it are its arguments.
pub const fn service(name: &'static CStr, doc: &'static CStr) -> Item {
    service_of(name, answers::NOTHING, doc)
}

/// Declares a service with an answer: `answers::NUMBER`, `WHOLE`, `BOOL`, `TEXT`, `LIST` or `TABLE`.
pub const fn service_of(name: &'static CStr, answer: u32, doc: &'static CStr) -> Item {
    Item { kind: answer, ..item(what::SERVICE, name, doc, c"") }
}

/// Declares a service that moves the machine, which is refused while an emergency stop is latched.
pub const fn moving_service(name: &'static CStr, doc: &'static CStr) -> Item {
    Item { whole: 1, ..service(name, doc) }
}
