// SPDX-License-Identifier: Apache-2.0
//! Refusals: mistakes in a program, their locations, and remedies.
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
    /// Incompatible parts of a composed verb; the refusal names both.
    CompositionConflict,
    /// A word, number or structure that cannot be parsed (also a definition of the wrong form).
    DefinitionError,
    /// An unknown block, port, list, condition, parameter, source or device.
    UnknownName,
    TypeMismatch,
    UnitMismatch,
    /// A data node that is not covered, or covered twice.
    CoverError,
    /// A second writer of an SVV or channel; the refusal names the holder.
    SecondWriter,
    /// Modes, rates, intervals, triggers that cannot hold.
    SchedulingError,
    /// A cycle of synchronous ports.
    SynchronousCycle,
    /// No source, two equally suitable sources, or a device on another RTP.
    PlacementError,
    /// A value that does not fit its type or unit.
    ValueRefused,
    /// A value outside its declared range.
    OutOfRange,
    /// A joint whose position is not known.
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
    /// An existing item of that name that is in use.
    InUse,
    /// A role without the permission; a missing, wrong, expired or revoked token; a request from a foreign page.
    NotAllowed,
    /// Command is held by another session, or by none; the refusal names the holder.
    NotCommanding,
    /// A session that was closed or is considered lost.
    SessionLost,
    /// A limit on number, size or frequency was exceeded.
    LimitExceeded,
    /// A change that must be recorded but cannot be.
    AuditFailed,
}

/// A part of a definition, as identified by a drawing editor. JSON: `{"block": "filter", "port": "u"}`, `{"transition": ["start",
/// "contact"]}`, …
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum Where {
    /// An item of a block; `"outer.inner"` in a nested graph, `""` for the graph that is being defined.
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
    /// A command of a list, numbered from 0.
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

/// End of the binding that a refusal is about.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "RefusalEnd"))]
pub struct End {
    /// Name in the message, for example `output 'servo.effort' (double, N.m)`.
    pub what: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<SourceLocation>,
}

/// A single mistake.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Refusal {
    pub class: Class,
    /// Message in lower case that names both ends: `cannot bind output 'a.y' (double, N.m) to input 'b.u' (float): types differ`.
    pub message: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ends: Vec<End>,
    /// Next step, if known; printed after the message, following a semicolon.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub remedy: String,
    /// Location to check first: the faulty definition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<SourceLocation>,
    /// Parts of the definition concerned, the main one first.
    #[serde(default, rename = "where", skip_serializing_if = "Vec::is_empty")]
    pub about: Vec<Where>,
}

/// Refusals of all mistakes, in the order found. Never empty as an error.
pub type Refusals = Vec<Refusal>;

impl Refusal {
    /// Makes a refusal of this class. Control characters in the message are replaced, even in quoted text. Ends, remedy and place are
    /// added by the methods below.
    pub fn new(class: Class, message: impl Into<String>) -> Refusal {
        Refusal { class, message: printable(message), ends: Vec::new(), remedy: String::new(), place: None, about: Vec::new() }
    }

    /// Adds the next step, which is printed after a semicolon.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Refusal {
        self.remedy = printable(remedy);
        self
    }

    /// Adds an end of the binding concerned.
    pub fn end(mut self, what: impl Into<String>, place: &Option<SourceLocation>) -> Refusal {
        self.ends.push(End { what: what.into(), place: place.clone() });
        self
    }

    /// Sets the location to check first, unless it is already set.
    pub fn at(mut self, place: &Option<SourceLocation>) -> Refusal {
        if self.place.is_none() {
            self.place.clone_from(place);
        }
        self
    }

    /// Adds parts of the definition concerned.
    pub fn about(mut self, parts: impl IntoIterator<Item = Where>) -> Refusal {
        self.about.extend(parts);
        self
    }

    /// Prefixes the message with the purpose of the refused value.
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
