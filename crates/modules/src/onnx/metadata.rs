// SPDX-License-Identifier: Apache-2.0
//! Metadata that trainers write into a file. It is used if the declaration omits a value, and compared with the value otherwise.
//!
//! mjlab and the exporters of whole-body tracking for Isaac Lab write comma-separated lists: `joint_names`, `default_joint_pos`,
//! `action_scale`, `observation_names`, `observation_history_lengths`, with numbers rounded to three decimals. `period`,
//! `observation_units` and `action_units` are additions of this project, for exporters that support them.
use super::meaning::{Meaning, Term};
use std::collections::BTreeMap;

type Metadata = BTreeMap<String, String>;

/// Half of the last decimal place that exporters write, with a margin.
const ROUNDING: f64 = 5.1e-4;

/// Compares the declaration with the file's metadata, and fills in omitted values.
///
/// # Errors
/// Fails if they differ; the message contains both values.
pub fn compare(meaning: &mut Meaning, file: &Metadata) -> Result<(), String> {
    if let Some(period) = file.get("period") {
        let seconds: f64 = period.trim().parse().map_err(|_| format!("metadata 'period' is '{period}', not a number of seconds"))?;
        let theirs = (seconds * 1e9).round() as i64;
        let ours = *meaning.period_ns.get_or_insert(theirs);
        if ours != theirs {
            return Err(differ("period", &format!("{} s", ours as f64 / 1e9), &format!("{seconds} s")));
        }
    }
    let observed: Vec<Vec<&mut Term>> = meaning.inputs.values_mut().map(|terms| terms.iter_mut().collect()).collect();
    if let [terms] = &mut observed.into_iter().collect::<Vec<_>>()[..] {
        observations(terms, file)?;
    }
    let joints = list(file, "joint_names");
    for term in meaning.inputs.values_mut().flatten() {
        let is_position = term.trained_as().starts_with("joint_pos");
        let is_joint = is_position || term.trained_as().starts_with("joint_vel");
        joint_order(term, &joints, is_joint)?;
        if is_position {
            same(term, "offset", "default_joint_pos", file)?;
        }
    }
    let mut actions: Vec<&mut Term> = meaning.outputs.values_mut().flatten().collect();
    units(&mut actions, file, "action_units")?;
    if let [term] = &mut actions[..] {
        joint_order(term, &joints, true)?;
        same(term, "scale", "action_scale", file)?;
        if term.unit == "rad" && file.contains_key("action_scale") {
            same(term, "offset", "default_joint_pos", file)?;
        }
    }
    Ok(())
}

fn observations(terms: &mut [&mut Term], file: &Metadata) -> Result<(), String> {
    let names = list(file, "observation_names");
    let ours: Vec<String> = terms.iter().map(|term| term.trained_as().to_string()).collect();
    if !names.is_empty() && names != ours {
        return Err(differ("order of observations", &ours.join(", "), &names.join(", ")));
    }
    let lengths = list(file, "observation_history_lengths");
    for (term, theirs) in terms.iter().zip(&lengths) {
        // Some exporters write 0 for no history.
        let (ours, theirs) = (term.history.max(1), theirs.parse::<usize>().unwrap_or(0).max(1));
        if ours != theirs {
            return Err(differ(&format!("history of '{}'", term.trained_as()), &ours.to_string(), &theirs.to_string()));
        }
    }
    units(terms, file, "observation_units")
}

fn units(terms: &mut [&mut Term], file: &Metadata, key: &str) -> Result<(), String> {
    for (term, theirs) in terms.iter_mut().zip(list(file, key)) {
        if term.unit.is_empty() {
            term.unit = theirs;
        } else if term.unit != theirs && !theirs.is_empty() {
            return Err(differ(&format!("unit of '{}'", term.trained_as()), &term.unit, &theirs));
        }
    }
    Ok(())
}

fn joint_order(term: &mut Term, joints: &[String], is_joint: bool) -> Result<(), String> {
    if joints.is_empty() || !is_joint {
        return Ok(());
    }
    if term.names.is_empty() && joints.len() == term.size {
        term.names = joints.to_vec();
    } else if term.names != joints {
        return Err(differ(&format!("joints of '{}' and their order", term.trained_as()), &term.names.join(", "), &joints.join(", ")));
    }
    Ok(())
}

fn same(term: &mut Term, what: &str, key: &str, file: &Metadata) -> Result<(), String> {
    let theirs = list(file, key);
    if theirs.is_empty() {
        return Ok(());
    }
    let theirs: Vec<f64> = theirs.iter().map(|x| x.parse()).collect::<Result<_, _>>().map_err(|_| format!("metadata '{key}' is not a list of numbers"))?;
    let theirs = if theirs.len() == 1 { vec![theirs[0]; term.size] } else { theirs };
    let of = format!("{what} of '{}'", term.trained_as());
    let ours = if what == "scale" { &mut term.scale } else { &mut term.offset };
    let given = ours.get_or_insert_with(|| theirs.clone());
    let fits = given.len() == theirs.len() && given.iter().zip(&theirs).all(|(a, b)| (a - b).abs() <= ROUNDING);
    if fits { Ok(()) } else { Err(differ(&of, &format!("{given:?}"), &format!("{theirs:?} ('{key}')"))) }
}

fn list(file: &Metadata, key: &str) -> Vec<String> {
    let text = file.get(key).map_or("", String::as_str).trim_matches(['[', ']']);
    if text.is_empty() { Vec::new() } else { text.split(',').map(|part| part.trim().trim_matches(['\'', '"']).to_string()).collect() }
}

fn differ(what: &str, ours: &str, theirs: &str) -> String {
    format!("{what}: the declaration has {ours}, but the file has {theirs}; correct the declaration, or leave it out if the file contains it")
}
