// SPDX-License-Identifier: Apache-2.0
//! Format of the journal's lines, and a parser for them. All functions are pure.
use api::Role;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json};

/// Format declared in the first line.
pub const FORMAT: &str = "opengpac journal";
/// Version of the lines written and read.
pub const VERSION: u32 = 1;

/// First line of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Format of the file: `opengpac journal`.
    pub format: String,
    /// Version of the lines.
    pub version: u32,
    /// Name of the system on which the calls were made.
    pub system: String,
}

/// Running subject of a line.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Subject {
    /// A verb instance, by its number in the journal; its actual number differs between runs of the daemon.
    Instance(u64),
    /// The own verb of a logical device.
    Device(String),
}

/// State that a subject has reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    Running,
    Suspended,
    Ended,
    Deleted,
}

/// Caller that made a call.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct By {
    /// Caller, as in the audit file.
    pub who: String,
    /// Role of the caller, used when the call is repeated.
    pub role: Role,
    /// Name of the session that owns the instance; empty if there is none or it was closed.
    pub session: String,
    /// Time of the call, s since the Unix epoch.
    pub time: f64,
}

/// Any line of a journal after the first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "line", rename_all = "snake_case", deny_unknown_fields)]
pub enum Line {
    /// A call as made by `POST /v1/call/NAME`.
    Call {
        call: String,
        /// Subject that the call created or started; `instance` is then omitted from the arguments.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        of: Option<Subject>,
        arguments: Map<String, Json>,
        /// Names of secret arguments, which a journal must not contain. Such a call is not repeated.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        withheld: Vec<String>,
        by: By,
    },
    /// A downloaded code module; its bytes are stored next to the journal under their SHA-256 digest.
    Module { module: String, file: String, sha256: String, by: By },
    /// A running subject was stopped or resumed.
    Became { of: Subject, state: State },
    /// The emergency stop was latched for this reason.
    Stopped { reason: String },
    /// The latch was released.
    Reset {},
    /// A session was closed gracefully: its subjects lose their owner and continue.
    Closed { session: String },
}

/// A journal read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct JournalText {
    pub head: Head,
    /// Lines, each with its number in the file, counted from 1.
    pub lines: Vec<(usize, Line)>,
    /// Number of the last line, if it was truncated and dropped.
    pub cut: Option<usize>,
}

/// Damage that makes a journal unreadable.
#[derive(Clone, Debug, PartialEq)]
pub struct Damage {
    /// Number of the line, counted from 1.
    pub line: usize,
    pub why: String,
}

/// Parses a journal. Only an unterminated last line may be invalid, because a crash during a write leaves one.
pub fn read(bytes: &[u8]) -> Result<JournalText, Damage> {
    let (whole, rest) = bytes.split_at(bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1));
    let mut texts = whole.strip_suffix(b"\n").unwrap_or(whole).split(|byte| *byte == b'\n').enumerate().map(|(at, text)| (at + 1, text));
    let head: Head = parsed(1, texts.next().expect("what is split has one part at the least").1)?;
    if head.format != FORMAT {
        return Err(Damage { line: 1, why: format!("its format is {:?}, not {FORMAT:?}", head.format) });
    }
    if head.version != VERSION {
        return Err(Damage { line: 1, why: format!("it has version {} of the journal, but this daemon writes and reads version {VERSION}", head.version) });
    }
    let lines = texts.map(|(number, text)| Ok((number, parsed(number, text)?))).collect::<Result<Vec<_>, Damage>>()?;
    let cut = (!rest.is_empty()).then_some(lines.len() + 2);
    Ok(JournalText { head, lines, cut })
}

fn parsed<T: DeserializeOwned>(line: usize, text: &[u8]) -> Result<T, Damage> {
    serde_json::from_slice(text).map_err(|why| Damage { line, why: why.to_string() })
}

/// Removes the secrets from the arguments of a call; returns their names.
pub fn withhold(call: &str, arguments: &mut Map<String, Json>) -> Vec<String> {
    let secrets = api::find(call).map_or(&[][..], |call| call.journal.secret);
    let secret = |name: &str| secrets.contains(&name);
    let withheld = arguments.keys().filter(|name| secret(name)).cloned().collect();
    arguments.retain(|name, _| !secret(name));
    withheld
}

/// Returns a line with its terminator.
pub fn text(of: &impl Serialize) -> Vec<u8> {
    let mut text = serde_json::to_vec(of).expect("texts, numbers and JSON are JSON");
    text.push(b'\n');
    text
}

/// Returns the JSON Schemas of a journal's lines: `{"version", "head", "line", "$defs"}`, draft 2020-12.
pub fn schema() -> Json {
    let mut generator = schemars::generate::SchemaSettings::draft2020_12().into_generator();
    let (head, line) = (generator.subschema_for::<Head>(), generator.subschema_for::<Line>());
    serde_json::json!({ "version": VERSION, "head": head, "line": line, "$defs": generator.take_definitions(true) })
}
