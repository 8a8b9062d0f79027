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
    /// Incompatible parts of a composed verb; names both parts.
    CompositionConflict,
    /// A word, number or structure that cannot be parsed (or a definition with the wrong structure).
    DefinitionError,
    /// An unknown block, port, list, condition, parameter, source or device.
    UnknownName,
    TypeMismatch,
    UnitMismatch,
    /// A data node that is not covered or is covered twice.
    CoverError,
    /// A second writer of an SVV or channel; names the holder.
    SecondWriter,
    /// Modes, rates, intervals or triggers that cannot hold.
    SchedulingError,
    /// A cycle of synchronous ports.
    SynchronousCycle,
    /// No source, two equally suitable sources, or a device on another RTP.
    PlacementError,
    /// A value that does not match its type or unit.
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
    /// A name or other item that is already in use.
    InUse,
    /// The role lacks the permission; the token is missing, wrong, expired or revoked; or the request comes from a page of another
    /// origin.
    NotAllowed,
    /// A call that requires command, which is held by another session or by no session; names the holder.
    NotCommanding,
    /// A session that was closed or is considered lost.
    SessionLost,
    /// A number, size or rate that exceeds its limit.
    LimitExceeded,
    /// A change that must be recorded but cannot be.
    AuditFailed,
}

/// Part of a definition, as a drawing editor identifies it. JSON: `{"block": "filter", "port": "u"}`, `{"transition": ["start",
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
    /// A wire: a cell, a port of the graph, or an instantiation parameter.
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
    /// A transition, by its command list and condition.
    Transition {
        transition: (String, String),
    },
}

/// One end of the binding to which a refusal refers.
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
    /// Location to check first: that of the faulty definition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<SourceLocation>,
    /// Parts of the definition involved, the main one first.
    #[serde(default, rename = "where", skip_serializing_if = "Vec::is_empty")]
    pub about: Vec<Where>,
}

/// Refusals for all mistakes, in the order found; never empty when returned as an error.
pub type Refusals = Vec<Refusal>;

impl Refusal {
    /// Creates a refusal of this class. Control characters in the message are replaced, even in quoted text. The methods below add ends,
    /// remedy and location.
    pub fn new(class: Class, message: impl Into<String>) -> Refusal {
        Refusal { class, message: printable(message), ends: Vec::new(), remedy: String::new(), place: None, about: Vec::new() }
    }

    /// Adds the next step, which is printed after a semicolon.
    pub fn remedy(mut self, remedy: impl Into<String>) -> Refusal {
        self.remedy = printable(remedy);
        self
    }

    /// Adds an end of the binding involved.
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

    /// Adds parts of the definition that are involved.
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
