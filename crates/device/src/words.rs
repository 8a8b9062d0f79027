// SPDX-License-Identifier: Apache-2.0
//! A typed word of a declaration: an option of a driver, an argument of a service.

/// What the value of an option is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Text,
    Number,
    /// A whole number.
    Whole,
    Bool,
    List,
    /// Names with values.
    Table,
}

/// Reach of an option's value beyond its device. A door to other callers decides by it who may give the option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Nothing.
    Device,
    /// A file of this machine, which is read or written.
    File,
    /// Code that runs: a program, a module, a library, or a folder in which they are looked for.
    Code,
    /// Another driver: a table of its `kind` and its `options`.
    Driver,
    /// A list or table of tables, with the reach of the values by these names in each.
    Entries(&'static [(&'static str, Reach)]),
}

/// An option of a driver.
#[derive(Clone, Copy, Debug)]
pub struct OptionWord {
    pub name: &'static str,
    pub kind: Kind,
    /// Unit of a number, or empty.
    pub unit: &'static str,
    /// What it is where it is left out, in words; none: it must be given.
    pub default: Option<&'static str>,
    /// One line.
    pub doc: &'static str,
    pub reach: Reach,
}

impl Kind {
    /// Each of them.
    pub const ALL: [Kind; 6] = [Kind::Text, Kind::Number, Kind::Whole, Kind::Bool, Kind::List, Kind::Table];

    /// Its name in a manual.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Text => "text",
            Kind::Number => "number",
            Kind::Whole => "whole",
            Kind::Bool => "bool",
            Kind::List => "list",
            Kind::Table => "table",
        }
    }
}

impl OptionWord {
    /// One that must be given.
    pub const fn needed(name: &'static str, kind: Kind, doc: &'static str) -> OptionWord {
        OptionWord { name, kind, unit: "", default: None, doc, reach: Reach::Device }
    }

    /// One that may be left out; `default` says what it is then.
    pub const fn with_default(name: &'static str, kind: Kind, default: &'static str, doc: &'static str) -> OptionWord {
        OptionWord { name, kind, unit: "", default: Some(default), doc, reach: Reach::Device }
    }

    /// With a unit.
    pub const fn unit(self, unit: &'static str) -> OptionWord {
        OptionWord { unit, ..self }
    }

    /// With a value that reaches beyond the device.
    pub const fn reaches(self, reach: Reach) -> OptionWord {
        OptionWord { reach, ..self }
    }
}
