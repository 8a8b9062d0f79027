// SPDX-License-Identifier: Apache-2.0
//! Compaction: definitions and modules that later ones have replaced are dropped, unless they are still used when the daemon restarts.
use crate::journal::ledger::Ledger;
use crate::journal::lines::Line;
use serde_json::{Map, Value as Json};
use std::collections::{HashMap, HashSet};

/// Kind and name of a definition.
type Key = (&'static str, String);

/// Definition that a line creates, if any, and all names that occur in the line.
struct NamesOfLine {
    defines: Option<Key>,
    names: HashSet<String>,
}

impl Ledger {
    /// Drops each definition and module that was replaced by a later one with the same name, unless a line between the two refers to it.
    /// Returns the number of lines dropped. Works backwards, because the names in a dropped line no longer count.
    pub fn leave_old_definitions(&mut self) -> usize {
        let mut lines: Vec<Option<NamesOfLine>> = self.lines().map(|kept| Some(NamesOfLine::of(&kept.line))).collect();
        // For each definition: the line that replaces it, going backwards.
        let mut later: HashMap<Key, usize> = HashMap::new();
        for at in (0..lines.len()).rev() {
            let Some(key) = lines[at].as_ref().and_then(|line| line.defines.clone()) else { continue };
            let Some(replaced_by) = later.get(&key).copied() else {
                later.insert(key, at);
                continue;
            };
            let is_used = lines[at + 1..replaced_by].iter().flatten().any(|line| line.names.contains(&key.1));
            if is_used {
                later.insert(key, at);
            } else {
                lines[at] = None;
            }
        }
        let mut kept = lines.iter().map(Option::is_some);
        let count = lines.len();
        self.retain(|_| kept.next().unwrap_or(true));
        count - self.lines().count()
    }
}

impl NamesOfLine {
    fn of(line: &Line) -> NamesOfLine {
        match line {
            Line::Module { module, .. } => NamesOfLine { defines: Some(("module", module.clone())), names: HashSet::new() },
            Line::Call { call, arguments, .. } => {
                let definition = api::find(call).and_then(|call| Some((call.name, arguments.get(call.defines?)?.as_str()?.to_owned())));
                let mut names = HashSet::new();
                collect(arguments, &mut names);
                NamesOfLine { defines: definition, names }
            }
            _ => NamesOfLine { defines: None, names: HashSet::new() },
        }
    }
}

/// Collects all strings in a call, and the part of each before the first dot: `gain.fast` refers to the module `gain`.
fn collect(arguments: &Map<String, Json>, names: &mut HashSet<String>) {
    let mut left: Vec<&Json> = arguments.values().collect();
    let mut take = |text: &str| {
        names.extend(text.split_once('.').map(|(module, _)| module.to_owned()));
        names.insert(text.to_owned());
    };
    arguments.keys().for_each(|key| take(key));
    while let Some(value) = left.pop() {
        match value {
            Json::String(text) => take(text),
            Json::Array(list) => left.extend(list),
            Json::Object(table) => {
                table.keys().for_each(|key| take(key));
                left.extend(table.values());
            }
            _ => {}
        }
    }
}
