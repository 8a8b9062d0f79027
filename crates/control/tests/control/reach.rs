// SPDX-License-Identifier: Apache-2.0
//! Driver options that name files or code, from callers who may supply neither.
use crate::rig::{Rig, class};
use api::Role;
use daemon::tokens;
use device::{Kind, OptionWord, Reach};
use serde_json::{Value as Json, json};

const SECRET: &str = "root:*:19000:0:99999:7:::";

/// A served system with a token for a caller of this role, who has command, and a file that the caller may not read.
struct Door {
    rig: Rig,
    session: String,
    token: String,
    secret: String,
}

impl Door {
    fn of(role: Role) -> Door {
        let mut token = String::new();
        let rig = Rig::with("virtual", |options, folder| {
            token = tokens::add(&folder.file("tokens.json"), "caller", role, None).expect("a token");
            options.tokens = Some(folder.file("tokens.json"));
            std::fs::write(folder.file("secret"), format!("{SECRET}\n[DeviceInfo]\n")).expect("ours");
        });
        let secret = rig.folder.file("secret").display().to_string();
        let mut door = Door { rig, session: String::new(), token, secret };
        let (status, answer) = door.ask("/v1/sessions", &json!({ "name": "caller" }));
        assert_eq!(status, 200, "{answer}");
        answer["result"]["session"].as_str().expect("an ID").clone_into(&mut door.session);
        assert_eq!(door.ask("/v1/command", &json!({})).0, 200);
        door
    }

    fn ask(&self, path: &str, body: &Json) -> (u16, Json) {
        let bearer = format!("Bearer {}", self.token);
        let mut headers = vec![("authorization", bearer.as_str())];
        if !self.session.is_empty() {
            headers.push(("opengpac-session", &self.session));
        }
        self.rig.ask("POST", path, &headers, &body.to_string())
    }

    /// Tries to open a device, and checks that the answer contains nothing of the file.
    fn opens(&self, kind: &str, options: &Json) -> (u16, Json) {
        let device = json!({ "processor": "rtp0", "name": "d", "kind": kind, "options": options, "source": "rtp0.fast" });
        self.answered("/v1/call/physical_device", &device)
    }

    fn answered(&self, path: &str, body: &Json) -> (u16, Json) {
        let (status, answer) = self.ask(path, body);
        assert!(status < 500 && !answer.to_string().contains("19000"), "{body}: {status} {answer}");
        (status, answer)
    }

    fn refuses(&self, kind: &str, options: &Json) {
        let found = self.answered("/v1/call/scan_devices", &json!({ "kind": kind, "options": options }));
        for (status, answer) in [self.opens(kind, options), found] {
            assert_eq!((status, class(&answer)), (403, "NotAllowed"), "{kind} {options}: {answer}");
        }
    }
}

/// Returns values of an option that name this path, in each form that the option accepts.
fn naming(word: &OptionWord, path: &str) -> Json {
    match (word.reach, word.kind) {
        (Reach::Entries(words), _) => json!([words.iter().map(|(name, _)| ((*name).to_owned(), json!(path))).collect::<serde_json::Map<_, _>>()]),
        (_, Kind::List) => json!([path]),
        (_, Kind::Table) => json!({ "a": path }),
        _ => json!(path),
    }
}

#[test]
fn no_option_of_any_driver_reads_a_file_or_runs_code_for_who_may_not_bring_it() {
    let door = Door::of(Role::Configure);
    let inside = |options: Json| json!({ "kind": "plant_process", "options": { "driver": options } });
    for of in drivers::declarations() {
        for word in device::options_of(of).into_iter().filter(|word| word.reach != Reach::Driver) {
            let mut options = json!({ word.name: naming(word, &door.secret) });
            if word.reach == Reach::Device {
                if of.kind == "ur" && word.name != "wait_ns" {
                    // There is no controller to wait for.
                    options["wait_ns"] = json!(1);
                }
                door.opens(of.kind, &options);
                continue;
            }
            let once = json!({ "driver": { "kind": of.kind, "options": options } });
            let twice = json!({ "driver": inside(json!({ "kind": of.kind, "options": options })) });
            for (kind, options) in [(of.kind, &options), ("plant_process", &once), ("plant_process", &twice)] {
                door.refuses(kind, options);
            }
        }
    }
}

#[test]
fn what_was_open_once_is_shut() {
    let door = Door::of(Role::Configure);
    let secret = &door.secret;
    let axis = json!({ "name": "x", "node": 1, "counts": 1000, "eds": secret });
    door.refuses("canopen", &json!({ "interface": "emulated", "axes": [axis] }));
    door.refuses("canopen", &json!({ "interface": "emulated", "modules": [{ "name": "io", "node": 2, "channels": {}, "eds": secret }] }));
    door.refuses("feetech", &json!({ "port": "/dev/null", "calibration": secret }));
    door.refuses("mujoco", &json!({ "path": secret }));
    door.refuses("python", &json!({ "module": "this" }));
    door.refuses("plant_process", &json!({ "driver": { "kind": "loopback", "options": { "parts": ["j"] } }, "command": ["/bin/sh", "-c", "true"] }));
    for file in ["x@/tmp/evil.so", "x@/tmp/evil.py", "@"] {
        door.refuses(file, &json!({}));
        door.refuses("plant_process", &json!({ "driver": { "kind": file } }));
    }
    let (status, answer) = door.ask("/v1/call/physical_device", &json!({ "processor": "rtp0", "name": "d", "kind": "x@/tmp/evil.so", "source": "rtp0.fast" }));
    assert_eq!((status, class(&answer)), (403, "NotAllowed"), "without options too: {answer}");
    let (status, answer) = door.ask(
        "/v1/call/physical_device",
        &json!({ "processor": "rtp0", "name": "d", "kind": "loopback", "options": { "parts": ["j"] }, "source": "rtp0.fast" }),
    );
    assert_eq!(status, 200, "what names neither is opened as ever: {answer}");
}

#[test]
fn who_brings_code_may_name_a_file_of_that_machine() {
    let door = Door::of(Role::Download);
    let (status, answer) = door.opens("mujoco", &json!({ "path": "/nowhere/arm.xml" }));
    assert_eq!((status, class(&answer)), (400, "DeviceFailed"), "{answer}");
}
