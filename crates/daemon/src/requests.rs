// SPDX-License-Identifier: Apache-2.0
//! Decodes requests, using only pure functions of bytes.
use crate::failure::Failure;
use model::refusal::Class;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json};
use std::time::Duration;

/// Maximum slice of a lasting call.
pub const SLICE_MAX: Duration = Duration::from_secs(1);

/// A call request, decoded from a body.
#[derive(Clone, Debug, PartialEq)]
pub struct CallRequest {
    pub arguments: Map<String, Json>,
    /// Maximum duration of the request.
    pub slice: Duration,
    /// Time at which the call was issued, on the daemon's clock, ms; `None` if the client does not specify it.
    pub as_of_ms: Option<u64>,
}

/// Parses the body of a call: a JSON object, or an empty body. `slice_ms` (1 to 1,000) belongs to the request, not to the call.
pub fn asked(body: &[u8], lasts: bool) -> Result<CallRequest, Failure> {
    let mut arguments: Map<String, Json> = object(body)?;
    let slice = match arguments.remove("slice_ms") {
        None => SLICE_MAX,
        Some(given) if lasts => match given.as_u64().filter(|ms| (1..=1_000).contains(ms)) {
            Some(ms) => Duration::from_millis(ms),
            None => return Err(wrong(format!("slice_ms cannot be {given}"), "give 1 to 1,000 ms")),
        },
        Some(_) => return Err(wrong("this call does not wait, so it has no slice_ms".to_owned(), "leave it out")),
    };
    Ok(CallRequest { arguments, slice, as_of_ms: None })
}

/// Parses a body of a given type; an empty body counts as `{}`.
pub fn object<T: DeserializeOwned>(body: &[u8]) -> Result<T, Failure> {
    let body = if body.iter().all(u8::is_ascii_whitespace) { b"{}" } else { body };
    serde_json::from_slice(body).map_err(|why| wrong(format!("the body does not have the right form: {why}"), "see docs/control.md and GET /v1/schema"))
}

/// Creates the failure of a malformed request.
pub fn wrong(message: String, remedy: &str) -> Failure {
    Failure::new(Class::CallError, message, remedy)
}

/// Maximum number of blocks in a definition that is checked for a caller, maximum nesting depth of its graphs, and maximum number of
/// values of any kind.
pub const BLOCKS_MAX: usize = 4_096;
pub const NESTED_MAX: usize = 16;
pub const VALUES_MAX: usize = 100_000;

/// Size of a definition.
#[derive(Default)]
struct Extent {
    blocks: usize,
    nested: usize,
    values: usize,
}

impl Extent {
    fn add(&mut self, of: &Json, depth: usize) {
        self.values += 1;
        match of {
            Json::Object(members) => self.add_members(members, depth),
            Json::Array(values) => values.iter().for_each(|value| self.add(value, depth)),
            _ => {}
        }
    }

    fn add_members(&mut self, members: &Map<String, Json>, depth: usize) {
        for (name, value) in members {
            let is_graph = name == "graph" && value.is_object();
            self.nested = self.nested.max(depth + usize::from(is_graph));
            if name == "blocks" {
                self.blocks += value.as_object().map_or(0, Map::len);
            }
            self.add(value, depth + usize::from(is_graph));
        }
    }
}

/// Refuses a definition that would take too long to check, before any processing.
pub fn check_extent(arguments: &Map<String, Json>) -> Result<(), Failure> {
    let mut of = Extent::default();
    of.add_members(arguments, 0);
    let bounds = [
        (of.blocks, BLOCKS_MAX, format!("{} blocks", of.blocks)),
        (of.nested, NESTED_MAX, format!("graphs nested {} deep", of.nested)),
        (of.values, VALUES_MAX, format!("{} values", of.values)),
    ];
    match bounds.into_iter().find(|(is, most, _)| is > most) {
        None => Ok(()),
        Some((_, most, has)) => {
            let message = format!("the definition has {has}, but at most {most} are checked for a caller");
            Err(Failure::new(Class::LimitExceeded, message, "check its parts one by one"))
        }
    }
}

/// Body of `POST /v1/sessions`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenSession {
    /// Name chosen by the caller: letters, digits, `.`, `_` and `-`, at most 64.
    pub name: String,
    /// Time without a sign of life after which the session is considered lost, ms, 1,000 to 60,000.
    #[serde(default = "lost_after_ms")]
    pub lost_after_ms: u64,
    /// True to take over a live session with that name, which must belong to the same caller.
    #[serde(default)]
    pub take_up: bool,
    /// Name of the person, which is shown to others; at most 64 characters. If omitted, an existing session keeps its person.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<String>,
}

fn lost_after_ms() -> u64 {
    5_000
}

impl OpenSession {
    /// Refuses invalid names and bounds.
    pub fn checked(self) -> Result<OpenSession, Failure> {
        let is_letter = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
        if self.name.is_empty() || self.name.len() > 64 || !self.name.chars().all(is_letter) {
            return Err(wrong(format!("a session cannot be named {:?}", self.name), "use letters, digits, '.', '_' and '-', at most 64"));
        }
        if !(1_000..=60_000).contains(&self.lost_after_ms) {
            return Err(wrong(format!("lost_after_ms cannot be {}", self.lost_after_ms), "give 1,000 to 60,000 ms"));
        }
        if let Some(person) = &self.person {
            said("person", person, PERSON_MAX)?;
        }
        Ok(self)
    }
}

/// Body of `POST /v1/command`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TakeCommand {
    /// True to take command from the holder; requires the role `configure`.
    #[serde(default)]
    pub force: bool,
}

/// Maximum length of a person's name, and of the text of a request, characters.
const PERSON_MAX: usize = 64;
const REASON_MAX: usize = 200;

/// Refuses a text that is shown to other people if it is empty, too long, or contains control characters.
fn said(what: &str, text: &str, most: usize) -> Result<(), Failure> {
    if text.trim().is_empty() || text.chars().count() > most || text.chars().any(char::is_control) {
        return Err(wrong(format!("{what} cannot be {text:?}"), &format!("write 1 to {most} characters on one line, or leave it out")));
    }
    Ok(())
}

/// Body of `POST /v1/command/request`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AskForCommand {
    /// Purpose, shown to the holder.
    #[serde(default)]
    pub reason: String,
    /// Time for which the request waits for an answer, ms, 1,000 to 600,000.
    #[serde(default = "wait_ms")]
    pub wait_ms: u64,
}

fn wait_ms() -> u64 {
    60_000
}

impl AskForCommand {
    /// Refuses invalid bounds.
    pub fn checked(self) -> Result<AskForCommand, Failure> {
        if !(1_000..=600_000).contains(&self.wait_ms) {
            return Err(wrong(format!("wait_ms cannot be {}", self.wait_ms), "give 1,000 to 600,000 ms"));
        }
        Ok(AskForCommand { reason: reason(self.reason)?, ..self })
    }
}

/// Body of `DELETE /v1/command/request`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WithdrawRequest {
    /// Human-readable reason.
    #[serde(default)]
    pub reason: String,
}

/// Body of `POST /v1/command/decline`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DeclineRequest {
    /// Session that made the request.
    pub name: String,
    /// Human-readable reason.
    #[serde(default)]
    pub reason: String,
}

/// Refuses a reason that cannot be displayed.
pub fn reason(given: String) -> Result<String, Failure> {
    if !given.is_empty() {
        said("reason", &given, REASON_MAX)?;
    }
    Ok(given)
}

/// Body of `POST /v1/command/hand_over`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HandOver {
    /// Session that receives command.
    pub to: String,
}

/// Returns true if a text is a SHA-256 digest: 64 lower-case hexadecimal digits.
pub fn is_sha256(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

/// Encodes bytes as lower-case hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        use std::fmt::Write;
        write!(text, "{byte:02x}").expect("a String takes everything");
        text
    })
}
