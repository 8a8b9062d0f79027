// SPDX-License-Identifier: Apache-2.0
//! A typed word of a declaration: an option of a driver, an argument of a service.
use hints::Interval;

/// Kind of an option's value.
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
    /// The option reaches nothing beyond the device.
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

/// Tables in the value of an option, with the words of each. Words are lists of slices, since drivers share some of them.
#[derive(Clone, Copy, Debug)]
pub enum Inside {
    Nothing,
    /// The value is a table with these.
    Fields(&'static [&'static [OptionWord]]),
    /// The value is a list or a table of tables, each with these.
    Entries(&'static [&'static [OptionWord]]),
}

/// An option of a driver.
#[derive(Clone, Copy, Debug)]
pub struct OptionWord {
    pub name: &'static str,
    pub kind: Kind,
    /// Unit of a number, or empty.
    pub unit: &'static str,
    /// Default in words; none: it must be given.
    pub default: Option<&'static str>,
    /// One line.
    pub doc: &'static str,
    pub reach: Reach,
    /// Range of its number, or of each number of its list; none: what is plausible for its unit.
    pub range: Option<Interval>,
    pub inside: Inside,
}

impl Kind {
    /// Kinds, all of them.
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
    /// Makes an option that must be given.
    pub const fn needed(name: &'static str, kind: Kind, doc: &'static str) -> OptionWord {
        OptionWord { name, kind, unit: "", default: None, doc, reach: Reach::Device, range: None, inside: Inside::Nothing }
    }

    /// Makes an option that may be left out; `default` says what it is then.
    pub const fn with_default(name: &'static str, kind: Kind, default: &'static str, doc: &'static str) -> OptionWord {
        OptionWord { default: Some(default), ..OptionWord::needed(name, kind, doc) }
    }

    /// Sets a unit.
    pub const fn unit(self, unit: &'static str) -> OptionWord {
        OptionWord { unit, ..self }
    }

    /// Sets a range from `least` to `most`, of its number or of each number of its list.
    pub const fn within(self, least: f64, most: f64) -> OptionWord {
        OptionWord { range: Some(Interval::closed(least, most)), ..self }
    }

    /// Sets a range above `least`, up to `most`.
    pub const fn above(self, least: f64, most: f64) -> OptionWord {
        OptionWord { range: Some(Interval::above(least, most)), ..self }
    }

    /// Sets a table of these words.
    pub const fn fields(self, words: &'static [&'static [OptionWord]]) -> OptionWord {
        OptionWord { inside: Inside::Fields(words), ..self }
    }

    /// Sets a list or a table of tables of these words.
    pub const fn entries(self, words: &'static [&'static [OptionWord]]) -> OptionWord {
        OptionWord { inside: Inside::Entries(words), ..self }
    }

    /// Declares that its value reaches beyond the device.
    pub const fn reaches(self, reach: Reach) -> OptionWord {
        OptionWord { reach, ..self }
    }
}
