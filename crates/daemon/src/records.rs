// SPDX-License-Identifier: Apache-2.0
//! Recordings of callers, who record, read and replay them by plain names in a single folder, which is configured when the daemon starts.
use crate::failure::Failure;
use crate::requests::hex;
use api::RecordArguments;
use model::refusal::Class;
use serde_json::{Map, Value as Json};
use std::path::{Component, Path};

/// Resolves the path of a recording within the folder, and sets the arguments for the folder and the trusted code. Callers cannot choose
/// to continue files of another daemon. Fails if no folder is configured, or if the name is not plain.
pub fn place(folder: Option<&Path>, trust: &[String], takes: &RecordArguments, arguments: &mut Map<String, Json>) -> Result<(), Failure> {
    if let Some(argument) = takes.trust {
        arguments.insert(argument.to_owned(), trust.into());
    }
    if let Some(argument) = takes.resumes {
        arguments.shift_remove(argument);
    }
    let path = takes.path.filter(|path| arguments.contains_key(*path));
    if path.is_none() && takes.folder.is_none() {
        return Ok(());
    }
    let Some(folder) = folder else {
        return Err(Failure::new(Class::NotAllowed, "this daemon has no folder for recordings".to_owned(), "start it with --records FOLDER"));
    };
    if let Some(argument) = takes.folder {
        arguments.insert(argument.to_owned(), Json::String(folder.display().to_string()));
    }
    // The call itself refuses a path that is not a text.
    let Some((argument, name)) = path.and_then(|path| Some((path, arguments.get(path)?.as_str()?))) else { return Ok(()) };
    if !matches!(Path::new(name).components().collect::<Vec<_>>()[..], [Component::Normal(_)]) {
        return Err(Failure::new(Class::CallError, format!("a recording cannot be named {name:?}"), "give a name without folders, for example 'run.mcap'"));
    }
    let path = folder.join(name).display().to_string();
    arguments.insert(argument.to_owned(), Json::String(path));
    Ok(())
}

/// Assigns a new recording its own identity, by which a restarted daemon recognises its files.
pub fn identify(takes: &RecordArguments, arguments: &mut Map<String, Json>) -> Result<(), Failure> {
    if let Some(argument) = takes.identity {
        let mut random = [0_u8; 8];
        getrandom::fill(&mut random).map_err(|why| Failure::new(Class::InvalidState, format!("cannot generate a random number: {why}"), "try again"))?;
        arguments.insert(argument.to_owned(), hex(&random).into());
    }
    Ok(())
}

/// Continues a recording that was in progress when its daemon died, in a new file next to the existing ones: `run-2.mcap` after
/// `run.mcap`.
pub fn go_on(takes: &RecordArguments, arguments: &mut Map<String, Json>) {
    if let Some(argument) = takes.resumes {
        arguments.insert(argument.to_owned(), true.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn asked(folder: Option<&str>, call: &str, mut arguments: Json) -> Result<Json, Failure> {
        let map = arguments.as_object_mut().expect("an object");
        let takes = api::find(call).expect("a call").records;
        place(folder.map(Path::new), &["00ff".to_owned()], &takes, map).map(|()| arguments)
    }

    fn placed(folder: Option<&str>, name: &str) -> Result<String, Failure> {
        asked(folder, "recorded_at", json!({ "path": name })).map(|arguments| arguments["path"].as_str().expect("a text").to_owned())
    }

    #[test]
    fn the_folder_that_is_listed_is_the_daemons_own() {
        let listed = |folder| asked(folder, "recordings", json!({ "folder": "/etc" }));
        assert_eq!(listed(Some("/var/records")).ok(), Some(json!({ "folder": "/var/records" })));
        assert!(listed(None).is_err_and(|why| why.class() == Class::NotAllowed));
        assert_eq!(asked(None, "stop_recording", json!({ "recording": 7 })).ok(), Some(json!({ "recording": 7 })), "has no path");
    }

    #[test]
    fn whose_code_runs_is_not_the_callers_to_say() {
        let asked = asked(Some("/var/records"), "replay", json!({ "path": "run.mcap", "trust": ["ab"] }));
        assert_eq!(asked.ok(), Some(json!({ "path": "/var/records/run.mcap", "trust": ["00ff"] })));
    }

    #[test]
    fn behind_whose_files_a_recording_goes_on_is_not_the_callers_to_say() {
        let asked = asked(Some("/var/records"), "record", json!({ "path": "run.mcap", "resumes": true }));
        assert_eq!(asked.ok(), Some(json!({ "path": "/var/records/run.mcap" })));
    }

    #[test]
    fn only_plain_names_in_the_folder_that_there_is() {
        assert_eq!(placed(Some("/var/records"), "run.mcap").ok().as_deref(), Some("/var/records/run.mcap"));
        for wrong in ["../run.mcap", "/etc/run.mcap", "a/b.mcap", "", ".."] {
            assert!(placed(Some("/var/records"), wrong).is_err_and(|why| why.class() == Class::CallError), "{wrong}");
        }
        assert!(placed(None, "run.mcap").is_err_and(|why| why.class() == Class::NotAllowed));
    }
}
