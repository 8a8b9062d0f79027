// SPDX-License-Identifier: Apache-2.0
//! Python methods for the calls. They are the same for a system in this process and for a remote one.
use super::{ordered, wrapped};
use crate::Call;
use schemars::SchemaGenerator;
use serde_json::Value as Json;

const HEAD: &str = "# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501
\"\"\"Calls on a real-time system, generated from their declarations in crates/api: do not edit.

Calls that move bytes at a rate have their own methods, see `realtime.py`.
\"\"\"

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .call_transport import CallTransport

LASTING = frozenset({LASTING})
\"\"\"Calls that may last, and continue in slices.\"\"\"


class Calls(CallTransport):
    \"\"\"Every call as a method. An argument that is None is omitted.\"\"\"

    __slots__ = ()
";

/// Generates the Python module that has a method for each call.
pub fn python<'a>(calls: impl Iterator<Item = &'a Call>) -> String {
    let calls: Vec<&Call> = calls.collect();
    let lasting: Vec<String> = calls.iter().filter(|call| call.lasts).map(|call| format!("\"{}\"", call.name)).collect();
    let methods = calls.into_iter().filter(|call| !call.rated).map(method).collect::<String>();
    HEAD.replace("LASTING})", &format!("{}}})", lasting.join(", "))) + &methods
}

fn method(call: &Call) -> String {
    let arguments = ordered(call);
    let mut parameters = vec!["self".to_owned()];
    parameters.extend(call.whole.map(|(name, _)| format!("{name}: Mapping[str, Any]")));
    for argument in &arguments {
        let of = annotation(&argument.schema);
        let of = if argument.required || of == "Any" || of.ends_with("None") { of } else { format!("{of} | None") };
        parameters.push(if argument.required { format!("{}: {of}", named(&argument.name)) } else { format!("{}: {of} = None", named(&argument.name)) });
    }
    let given = arguments.iter().map(|argument| format!("\"{}\": {}", argument.name, named(&argument.name))).collect::<Vec<_>>().join(", ");
    let given = match call.whole {
        Some((name, _)) if given.is_empty() => format!("self._ask_of(\"{}\", {name})", call.name),
        Some((name, _)) => format!("self._ask_of(\"{}\", {name}, {{{given}}})", call.name),
        None if given.is_empty() => format!("self._ask(\"{}\")", call.name),
        None => format!("self._ask(\"{}\", {{{given}}})", call.name),
    };
    let answer = annotation(&Json::from(call.answer_schema(&mut SchemaGenerator::default())));
    let words = wrapped(&format!("\"\"\"{}\"\"\"", call.words().replace('\\', "\\\\")), "        ", 110);
    format!("\n    def {}({}) -> {answer}:\n{words}        return {given}\n", named(call.name), parameters.join(", "))
}

/// Returns a form of a name that is valid in Python.
fn named(name: &str) -> String {
    if matches!(name, "from" | "in" | "is" | "for" | "with" | "global" | "lambda") { format!("{name}_") } else { name.to_owned() }
}

/// Returns the Python type of a value.
fn annotation(schema: &Json) -> String {
    let one = |name: &str| match name {
        "string" => "str".to_owned(),
        "integer" => "int".to_owned(),
        "number" => "float".to_owned(),
        "boolean" => "bool".to_owned(),
        "null" => "None".to_owned(),
        "array" => format!("list[{}]", annotation(&schema["items"])),
        "object" => "dict[str, Any]".to_owned(),
        _ => "Any".to_owned(),
    };
    match &schema["type"] {
        Json::String(name) => one(name),
        Json::Array(names) => names.iter().filter_map(Json::as_str).map(one).collect::<Vec<_>>().join(" | "),
        _ => "Any".to_owned(),
    }
}
