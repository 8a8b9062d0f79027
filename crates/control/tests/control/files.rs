// SPDX-License-Identifier: Apache-2.0
//! Files supplied by a programming system, and code modules.
use crate::rig::{Rig, class, receive, send};
use api::Role;
use daemon::Files;
use model::refusal::Class;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::os::unix::fs::PermissionsExt;

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Resolves the options of a simulated machine.
fn resolve(files: &Files, options: &mut Value, role: Role) -> Result<(), Class> {
    supervisor::each_reach("mujoco", options, &mut |reached| files.resolve(reached, role)).map_err(|failure| failure.class())
}

#[test]
fn a_reference_becomes_files_beside_each_other() {
    let files = Files::new().expect("a folder");
    let (scene, mesh) = (&b"<mujoco/>"[..], &b"mesh"[..]);
    for content in [scene, mesh, mesh] {
        files.put(&sha256(content), content).expect("room");
    }
    assert_eq!(files.size(&sha256(mesh)), Some(4));
    let mut options = json!({ "timestep": 0.001, "path": { "main": "a/scene.xml", "files": { "a/scene.xml": sha256(scene), "a/m/base.obj": sha256(mesh) } } });
    let mut again = options.clone();
    resolve(&files, &mut options, Role::Configure).expect("all are there");
    resolve(&files, &mut again, Role::Configure).expect("all are there");
    assert_eq!(options, again, "the same files lie in the same place");
    let path = std::path::PathBuf::from(options["path"].as_str().expect("a path"));
    assert_eq!(std::fs::read(&path).expect("it lies there"), scene);
    assert_eq!(std::fs::read(path.with_file_name("m").join("base.obj")).expect("beside it"), mesh);
    let root = path.ancestors().nth(4).expect("the private folder").to_owned();
    assert_eq!(std::fs::metadata(&root).expect("it is there").permissions().mode() & 0o777, 0o700);
    drop(files);
    assert!(!root.exists(), "nothing is left behind");
}

#[test]
fn what_is_no_file_of_the_caller_is_refused() {
    let files = Files::new().expect("a folder");
    let there = sha256(b"x");
    files.put(&there, b"x").expect("room");
    assert_eq!(files.put(&there, b"y").expect_err("another content").class(), Class::CallError);
    assert_eq!(files.put("../x", b"x").expect_err("no digest").class(), Class::CallError);
    assert_eq!(files.size("../content"), None);
    let resolved = |options: Value| resolve(&files, &mut options.clone(), Role::Configure);
    assert_eq!(resolved(json!({ "path": "/etc/passwd" })), Err(Class::NotAllowed));
    assert_eq!(resolved(json!({ "library": "/tmp/evil.so" })), Err(Class::NotAllowed));
    for name in ["../a", "/a", "a/../b", "", "a/./../..", "./a"] {
        assert_eq!(resolved(json!({ "path": { "main": name, "files": { name: there } } })), Err(Class::CallError), "{name:?}");
    }
    assert_eq!(resolved(json!({ "path": { "main": "b", "files": { "a": there } } })), Err(Class::UnknownName));
    assert_eq!(resolved(json!({ "path": { "main": "a", "files": { "a": sha256(b"none") } } })), Err(Class::UnknownName));
    assert_eq!(resolved(json!({ "parts": ["j1"] })), Ok(()));
    for name in ["../a.c", "a/b.c", "", ".", "/a.c"] {
        assert_eq!(files.with(name, b"", |_| ()).expect_err("no plain name").class(), Class::CallError, "{name:?}");
    }
}

const GAIN: &str = r#"#include <opengpac.h>
FUNCTION_BLOCK(gain, "Gain: y = 2 u.", in(double, u, "input"), out(double, y, "output"))
{
    self->y = 2 * self->u;
    return OK;
}
"#;

#[test]
fn a_code_module_comes_as_bytes() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let put = |query: &str, body: &str| {
        let mut stream = rig.connect();
        send(&mut stream, "PUT", &format!("/v1/modules/amp?{query}"), &[("opengpac-session", &session)], body.as_bytes());
        receive(&mut stream)
    };
    let (status, answer) = put(&format!("file=gain.c&sha256={}", sha256(GAIN.as_bytes())), GAIN);
    assert_eq!((status, &answer["result"]["blocks"][0]["name"]), (200, &json!("amp.gain")), "{answer}");
    let (status, answer) = put(&format!("file=gain.c&sha256={}", sha256(b"other")), GAIN);
    assert_eq!((status, class(&answer)), (400, "CallError"));
    let broken = GAIN.replace("return OK;", "return OK");
    let (_, answer) = put(&format!("file=gain.c&sha256={}", sha256(broken.as_bytes())), &broken);
    assert_eq!((class(&answer), &answer["errors"][0]["place"]["file"]), ("ModuleError", &json!("gain.c")), "{answer}");
    let elf = "\x7fELF and more";
    let digest = sha256(elf.as_bytes());
    let (_, answer) = put(&format!("file=gain.so&sha256={digest}&abi=1&target=aarch64-linux"), elf);
    assert!(answer["errors"][0]["message"].as_str().is_some_and(|m| m.contains("'amp' is for aarch64-linux")), "{answer}");
    let (_, answer) = put(&format!("file=gain.so&sha256={digest}&abi=99&target={}-linux", std::env::consts::ARCH), elf);
    assert!(answer["errors"][0]["message"].as_str().is_some_and(|m| m.contains("version 99")), "{answer}");
    let (_, answer) = put(&format!("file=gain.so&sha256={digest}"), elf);
    assert!(answer["errors"][0]["message"].as_str().is_some_and(|m| m.contains("does not name its machine")), "{answer}");
}

#[test]
fn files_are_put_once_and_named_in_the_options_of_a_device() {
    let rig = Rig::new();
    let session = rig.commander("panel");
    let (content, of_session) = ("anything", [("opengpac-session", session.as_str())]);
    let path = format!("/v1/files/{}", sha256(content.as_bytes()));
    assert_eq!(rig.ask("GET", &path, &[], "").0, 404);
    assert_eq!(rig.ask("PUT", &path, &of_session, content).0, 200);
    assert_eq!(rig.ask("GET", &path, &[], "").1["result"]["bytes"], content.len());
}
