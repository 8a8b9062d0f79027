// SPDX-License-Identifier: Apache-2.0
//! Refusals: what is wrong with a program, where, and what to do.
use crate::wording::printable;
use serde::{Deserialize, Serialize};

/// Source location of a definition in the user's program.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SourceLocation {
    pub file: String,
    pub line: u32,
}

/// Class of a refusal: the name of the Python exception class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Class {
    /// Parts of a composed verb that do not go together; names both.
    CompositionConflict,
    /// A word, number or structure that cannot be read (also a definition that is not of the right form).
    DefinitionError,
    /// A block, port, list, condition, parameter, source or device of that name is not there.
    UnknownName,
    TypeMismatch,
    UnitMismatch,
    /// A data node that nothing covers, or that two cover.
    CoverError,
    /// A second writer of an SVV or channel; names the holder.
    SecondWriter,
    /// Modes, rates, intervals, triggers that cannot hold.
    SchedulingError,
    /// A cycle of synchronous ports.
    SynchronousCycle,
    /// There is no source, there are two equal candidates, or a device is on another RTP.
    PlacementError,
    /// A value that does not fit its type or unit.
    ValueRefused,
    /// A value outside the range that is declared for it.
    OutOfRange,
    /// A joint that does not know where it is.
    NotHomed,
    /// Wrong call arguments.
    CallError,
    NotEnabled,
    /// A call that the state of the instance or device does not allow.
    InvalidState,
    /// A code module that cannot be loaded or built.
    ModuleError,
    DeviceFailed,
    EmergencyStopped,
    /// A thing of that name exists and is in use.
    InUse,
    /// A role that may not, a token that is missing, wrong, expired or revoked, a request that comes from a foreign page.
    NotAllowed,
    /// Another session commands the system, or none does; names the holder.
    NotCommanding,
    /// A session that was closed or counts as lost.
    SessionLost,
    /// Too many, too large or too often.
    LimitExceeded,
    /// A change that has to be recorded cannot be.
    AuditFailed,
}

/// A part of a definition, as who draws it knows it. JSON: `{"block": "filter", "port": "u"}`, `{"transition": ["start", "contact"]}`, …
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Where {
    /// An item of a block; `"outer.inner"` in a nested graph, `""` for the graph that is defined.
    Port {
        block: String,
        port: String,
    },
    Block {
        block: String,
    },
    /// A wire: a cell, a port of the graph, an instantiation parameter.
    Cell {
        cell: String,
    },
    /// An input parameter.
    Parameter {
        parameter: String,
    },
    /// An output value.
    Output {
        output: String,
    },
    Object {
        object: String,
    },
    /// A command of a list, from 0.
    Command {
        list: String,
        command: usize,
    },
    List {
        list: String,
    },
    Condition {
        condition: String,
    },
    /// Command list and condition.
    Transition {
        transition: (String, String),
    },
}

/// One of the ends that a refusal is about.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RefusalEnd"))]
pub struct End {
    /// Name in the message, for example `output 'servo.effort' (double, N.m)`.
    pub what: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<SourceLocation>,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Refusal {
    pub class: Class,
    /// Lower case, both ends named: `cannot bind output 'a.y' (double, N.m) to input 'b.u' (float): types differ`.
    pub message: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ends: Vec<End>,
    /// The next step if it is known; printed after the message, behind a semicolon.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub remedy: String,
    /// Place to look at first: the definition that is at fault.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<SourceLocation>,
    /// The parts of the definition that it is about, the first one first.
    #[serde(default, rename = "where", skip_serializing_if = "Vec::is_empty")]
    pub about: Vec<Where>,
}

/// Refusals of all that is wrong, in the order found. Never empty where it is an error.
pub type Refusals = Vec<Refusal>;

impl Refusal {
    /// Makes a refusal of this class, whose message controls no terminal, whatever text it repeats; ends, remedy and place are added by the methods below.
    pub fn new(class: Class, message: impl Into<String>) -> Refusal {
        Refusal { class, message: printable(message), ends: Vec::new(), remedy: String::new(), place: None, about: Vec::new() }
    }

    /// Adds the next step; it is printed behind a semicolon.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Refusal {
        self.remedy = printable(remedy);
        self
    }

    /// Adds an end that it is about.
    pub fn end(mut self, what: impl Into<String>, place: &Option<SourceLocation>) -> Refusal {
        self.ends.push(End { what: what.into(), place: place.clone() });
        self
    }

    /// Says where to look first, if nothing said so yet.
    pub fn at(mut self, place: &Option<SourceLocation>) -> Refusal {
        if self.place.is_none() {
            self.place.clone_from(place);
        }
        self
    }

    /// Adds parts of the definition that it is about.
    pub fn about(mut self, parts: impl IntoIterator<Item = Where>) -> Refusal {
        self.about.extend(parts);
        self
    }

    /// Puts words before the message: what the refused value was for.
    pub fn for_what(mut self, what: &str) -> Refusal {
        self.message = format!("{what}: {}", self.message);
        self
    }
}

impl std::fmt::Display for Refusal {
    /// Writes `message; remedy at FILE:LINE`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)?;
        if !self.remedy.is_empty() {
            write!(f, "; {}", self.remedy)?;
        }
        match &self.place {
            Some(place) => write!(f, " at {}:{}", place.file, place.line),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Refusal {}
