// SPDX-License-Identifier: Apache-2.0
//! Typed word of a declaration: an option of a driver, or an argument of a service.
use hints::Interval;

/// Kind of an option's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Text,
    Number,
    /// Integer.
    Whole,
    Bool,
    List,
    /// Table of names and values.
    Table,
}

/// Extent to which an option's value reaches beyond its device. An interface for other clients uses this to decide who may set the
/// option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// The option does not reach beyond the device.
    Device,
    /// File on this machine, which is read or written.
    File,
    /// Code to be executed: a program, a module, a library, or a folder that is searched for them.
    Code,
    /// A nested driver: a table with its `kind` and its `options`.
    Driver,
    /// A list or table of tables, with the reach of the named values in each of them.
    Entries(&'static [(&'static str, Reach)]),
}

/// Tables in the value of an option, with the declared words of each. Words are lists of slices, because drivers share some of them.
#[derive(Clone, Copy, Debug)]
pub enum Inside {
    Nothing,
    /// The value is a table with these words.
    Fields(&'static [&'static [OptionWord]]),
    /// The value is a list or a table of tables, each with these words.
    Entries(&'static [&'static [OptionWord]]),
}

/// An option of a driver.
#[derive(Clone, Copy, Debug)]
pub struct OptionWord {
    pub name: &'static str,
    pub kind: Kind,
    /// Unit of a number, or empty if none.
    pub unit: &'static str,
    /// Description of the default; `None` if the option is required.
    pub default: Option<&'static str>,
    /// Description, one line.
    pub doc: &'static str,
    pub reach: Reach,
    /// Range of the number, or of each number in the list; `None` for the plausible range of its unit.
    pub range: Option<Interval>,
    pub inside: Inside,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 6] = [Kind::Text, Kind::Number, Kind::Whole, Kind::Bool, Kind::List, Kind::Table];

    /// Returns the name of the kind as used in a manual.
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
    /// Creates a required option.
    pub const fn needed(name: &'static str, kind: Kind, doc: &'static str) -> OptionWord {
        OptionWord { name, kind, unit: "", default: None, doc, reach: Reach::Device, range: None, inside: Inside::Nothing }
    }

    /// Creates an option that may be omitted; `default` describes its value in that case.
    pub const fn with_default(name: &'static str, kind: Kind, default: &'static str, doc: &'static str) -> OptionWord {
        OptionWord { default: Some(default), ..OptionWord::needed(name, kind, doc) }
    }

    /// Sets the unit.
    pub const fn unit(self, unit: &'static str) -> OptionWord {
        OptionWord { unit, ..self }
    }

    /// Sets a range from `least` to `most`, for the number or for each number in the list.
    pub const fn within(self, least: f64, most: f64) -> OptionWord {
        OptionWord { range: Some(Interval::closed(least, most)), ..self }
    }

    /// Sets a range above `least`, up to and including `most`.
    pub const fn above(self, least: f64, most: f64) -> OptionWord {
        OptionWord { range: Some(Interval::above(least, most)), ..self }
    }

    /// Declares the value to be a table with these words.
    pub const fn fields(self, words: &'static [&'static [OptionWord]]) -> OptionWord {
        OptionWord { inside: Inside::Fields(words), ..self }
    }

    /// Declares the value to be a list or a table of tables with these words.
    pub const fn entries(self, words: &'static [&'static [OptionWord]]) -> OptionWord {
        OptionWord { inside: Inside::Entries(words), ..self }
    }

    /// Declares that the value reaches beyond the device.
    pub const fn reaches(self, reach: Reach) -> OptionWord {
        OptionWord { reach, ..self }
    }
}
