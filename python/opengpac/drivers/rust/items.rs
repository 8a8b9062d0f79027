// SPDX-License-Identifier: Apache-2.0
//! The words of a declaration, as `opengpac_driver.h` has them: options, class, life, safe state, counters, rights, services.
use crate::abi::{Item, class, kind, what};
use std::ffi::CStr;

/// Agents that bring about a safe state, and kinds of a service's answer.
pub use crate::abi::{by, kind as answers};

const fn item(what: u32, name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    let text = c"".as_ptr();
    Item { what, kind: 0, name: name.as_ptr(), doc: doc.as_ptr(), unit: unit.as_ptr(), text, number: 0.0, whole: 0, needed: 0, by: 0 }
}

const fn needed(kind: u32, name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind, needed: 1, ..item(what::OPTION, name, doc, unit) }
}

/// An option that is a number, with its default. Behind a service it is an argument of it, here and below.
pub const fn option_number(name: &'static CStr, default: f64, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind: kind::NUMBER, number: default, ..item(what::OPTION, name, doc, unit) }
}

/// An option that is a whole number.
pub const fn option_whole(name: &'static CStr, default: i64, doc: &'static CStr, unit: &'static CStr) -> Item {
    Item { kind: kind::WHOLE, whole: default, ..item(what::OPTION, name, doc, unit) }
}

/// An option that is true or false.
pub const fn option_bool(name: &'static CStr, default: bool, doc: &'static CStr) -> Item {
    Item { kind: kind::BOOL, whole: default as i64, ..item(what::OPTION, name, doc, c"") }
}

/// An option that is a text.
pub const fn option_text(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::TEXT, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// An option that is a list; its default as JSON.
pub const fn option_list(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::LIST, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// An option that is a table; its default as JSON.
pub const fn option_table(name: &'static CStr, default: &'static CStr, doc: &'static CStr) -> Item {
    Item { kind: kind::TABLE, text: default.as_ptr(), ..item(what::OPTION, name, doc, c"") }
}

/// An option that is a number and must be given.
pub const fn needed_number(name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    needed(kind::NUMBER, name, doc, unit)
}

/// A whole number that must be given.
pub const fn needed_whole(name: &'static CStr, doc: &'static CStr, unit: &'static CStr) -> Item {
    needed(kind::WHOLE, name, doc, unit)
}

/// True or false, and must be given.
pub const fn needed_bool(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::BOOL, name, doc, c"")
}

/// An option that is a text and must be given.
pub const fn needed_text(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::TEXT, name, doc, c"")
}

/// A list that must be given.
pub const fn needed_list(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::LIST, name, doc, c"")
}

/// A table that must be given.
pub const fn needed_table(name: &'static CStr, doc: &'static CStr) -> Item {
    needed(kind::TABLE, name, doc, c"")
}

/// Declares that it exchanges on a thread of its own, and may wait.
pub const fn worker() -> Item {
    Item { kind: class::WORKER, ..item(what::CLASS, c"", c"", c"") }
}

/// Time for which `open` waits for a machine that is not there yet, ns.
pub const fn waits(ns: i64) -> Item {
    Item { whole: ns, ..item(what::WAITS, c"", c"", c"") }
}

/// Time within which a machine that is gone is a device that is lost, ns.
pub const fn lost_within(ns: i64) -> Item {
    Item { whole: ns, ..item(what::LOST_WITHIN, c"", c"", c"") }
}

/// Its safe state, and the time in which the driver has brought it about, ns.
pub const fn safe(doc: &'static CStr, within_ns: i64) -> Item {
    safe_by(doc, within_ns, by::DRIVER)
}

/// Its safe state, brought about by others too: `by::DRIVER | by::GUARD | by::DEVICE | by::END`.
pub const fn safe_by(doc: &'static CStr, within_ns: i64, by: u32) -> Item {
    Item { whole: within_ns, by, ..item(what::SAFE, c"", doc, c"") }
}

/// A counter of the driver.
pub const fn counter(name: &'static CStr, doc: &'static CStr) -> Item {
    item(what::COUNTER, name, doc, c"")
}

/// A right that it needs, and how one gets it.
pub const fn right(doc: &'static CStr) -> Item {
    item(what::RIGHT, c"", doc, c"")
}

/// A service off the cycle; options that stand behind it are its arguments.
pub const fn service(name: &'static CStr, doc: &'static CStr) -> Item {
    service_of(name, answers::NOTHING, doc)
}

/// A service with an answer: `answers::NUMBER`, `WHOLE`, `BOOL`, `TEXT`, `LIST` or `TABLE`.
pub const fn service_of(name: &'static CStr, answer: u32, doc: &'static CStr) -> Item {
    Item { kind: answer, ..item(what::SERVICE, name, doc, c"") }
}

/// A service that moves the machine: refused while an emergency stop is latched.
pub const fn moving_service(name: &'static CStr, doc: &'static CStr) -> Item {
    Item { whole: 1, ..service(name, doc) }
}
