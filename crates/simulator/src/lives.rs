// SPDX-License-Identifier: Apache-2.0
//! Expected state of each verb instance, to the extent that the calls and the log determine it.
use std::collections::HashMap;

/// A resource that an instance claims.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Claim {
    pub what: String,
    /// True if a second writer is refused.
    pub refuses: bool,
}

/// One start, from its beginning to its end.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    pub begun_ns: i64,
    pub ended_ns: Option<i64>,
}

/// A verb instance, even after its deletion.
#[derive(Clone, Debug, Default)]
pub struct Life {
    pub id: u64,
    pub verb: usize,
    pub claims: Vec<Claim>,
    pub sources: Vec<usize>,
    /// Logical devices on which the instance acts.
    pub devices: Vec<&'static str>,
    /// Number of accepted starts.
    pub accepted: u64,
    /// Number of starts in the log; `ended` is the number of ends in the log.
    pub started: u64,
    pub ended: u64,
    /// Tags of the instance's starts, in order, including runs that are in progress.
    pub tags: Vec<i64>,
    pub is_deleted: bool,
    /// True if the instance is queued for its turn.
    pub is_queued: bool,
    /// True if the instance's log entries were lost and the world did not create it; it is no longer tracked.
    pub is_lost: bool,
    /// Number of end reports.
    pub reports: u64,
}

impl Life {
    /// Returns true if the instance has been started and has not ended.
    pub fn is_busy(&self) -> bool {
        self.started > self.ended
    }

    /// Returns true if the instance has begun to run, so that it holds its claims.
    pub fn runs(&self) -> bool {
        self.is_busy() && !self.is_queued
    }

    pub fn has_claim(&self, what: &str) -> bool {
        self.claims.iter().any(|claim| claim.what == what)
    }
}

/// All instances by name, and the time of each run by tag.
#[derive(Default)]
pub struct Lives {
    pub of: indexmap::IndexMap<String, Life>,
    pub runs: HashMap<i64, (String, Option<Run>)>,
    /// Sources for which the log has reported losses since the last reset.
    pub lost: Vec<String>,
}

impl Lives {
    /// Processes a log entry. Fails if the entry is impossible.
    pub fn read(&mut self, entry: &supervisor::Entry) -> Result<(), String> {
        let time_ns = (entry.time_s * 1e9).round() as i64;
        if entry.kind == "processor_lost" {
            self.lost.push(entry.about.clone());
        }
        if !matches!(entry.kind, "start" | "admission" | "end") {
            return Ok(());
        }
        let life = self.of.entry(entry.about.clone()).or_default();
        if life.is_lost {
            return Ok(());
        }
        match entry.kind {
            "start" => {
                if life.is_busy() {
                    return Err(format!("'{}' starts a second time before its end", entry.about));
                }
                life.started += 1;
                life.is_queued = !entry.text.is_empty();
            }
            "admission" if !life.is_queued => return Err(format!("'{}' is admitted, and did not wait", entry.about)),
            "admission" => life.is_queued = false,
            _ if !life.is_busy() => return Err(format!("'{}' ends a second time: {}", entry.about, entry.text)),
            _ => {
                life.ended += 1;
                life.is_queued = false;
            }
        }
        // The starts and their tags are in the same order.
        let tag = life.tags.get(life.started.saturating_sub(1) as usize).copied();
        let (runs, is_over) = (life.runs(), !life.is_busy());
        if let Some(tag) = tag
            && let Some((_, run)) = self.runs.get_mut(&tag)
        {
            match run {
                None if runs => *run = Some(Run { begun_ns: time_ns, ended_ns: None }),
                Some(run) if is_over => run.ended_ns = Some(time_ns),
                _ => {}
            }
        }
        Ok(())
    }

    /// Handles lost log entries: derives their content from the states.
    pub fn lose(&mut self, state: impl Fn(u64) -> &'static str) {
        for (name, life) in self.of.iter_mut().filter(|(_, life)| !life.is_deleted) {
            if life.id == 0 {
                life.is_lost = true;
                continue;
            }
            let state = state(life.id);
            let under_way = matches!(state, "queued" | "running" | "suspended");
            life.started = life.accepted;
            life.ended = life.accepted - u64::from(under_way && life.accepted > 0);
            life.is_queued = state == "queued";
            // The times of these runs are unknown.
            let runs = self.runs.values_mut().filter(|(of, _)| of == name);
            runs.for_each(|(_, run)| *run = Some(Run { begun_ns: i64::MIN / 2, ended_ns: None }));
        }
    }

    /// Returns a claim that two running instances both hold, if any.
    pub fn shared_claim(&self) -> Option<String> {
        let running: Vec<(&String, &Life)> = self.of.iter().filter(|(_, life)| life.runs()).collect();
        for (index, (name, life)) in running.iter().enumerate() {
            for (other, beside) in &running[..index] {
                if let Some(claim) = life.claims.iter().find(|claim| beside.has_claim(&claim.what)) {
                    return Some(format!("'{name}' and '{other}' both run, and both write {}", claim.what));
                }
            }
        }
        None
    }
}
