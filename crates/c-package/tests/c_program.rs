// SPDX-License-Identifier: Apache-2.0
//! A programming system in C: `examples/ps_in_c` is compiled by the system's compiler, linked with this package, and run.
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the shared library: cargo places it in the test's own folder.
fn library() -> PathBuf {
    let folder = std::env::current_exe().expect("this test is a file").parent().expect("in a folder").to_path_buf();
    assert!(folder.join("libopengpac_ps.so").exists(), "libopengpac_ps.so is in {}", folder.display());
    folder
}

/// Compiles a C file against the package as its author would, and returns the program.
fn compile(source: &Path, name: &str) -> PathBuf {
    let program = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let folder = library();
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-I"]).arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("include"));
    compiler.arg(source).arg("-L").arg(&folder).arg("-lopengpac_ps").arg(format!("-Wl,-rpath,{}", folder.display())).arg("-o").arg(&program);
    let output = compiler.output().expect("there is a C compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    program
}

fn run(program: &Path) -> String {
    let output = Command::new(program).output().expect("it runs");
    assert!(output.status.success(), "{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it prints text")
}

#[test]
fn r126_a_c_program_configures_a_system_and_runs_a_verb() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/ps_in_c/servo.c");
    let printed = run(&compile(&source, "servo"));
    let after = |what: &str| -> Vec<&str> { printed.lines().filter_map(|line| line.strip_prefix(what)).collect() };
    assert_eq!(after("refused: "), ["UnknownName: there is no verb 'brings'; did you mean 'bring'?"], "{printed}");
    let reports: Vec<Json> = after("report: ").iter().map(|text| serde_json::from_str(text).expect("a report is JSON")).collect();
    assert_eq!(reports.len(), 2);
    for (report, goal) in reports.iter().zip([0.5, -0.25]) {
        assert_eq!((&report["verb"], &report["condition"]), (&"bring".into(), &"there".into()));
        assert!((report["outputs"]["reached"].as_f64().expect("a number") - goal).abs() < 1e-6, "{report}");
    }
    let sensed: Json = serde_json::from_str(after("sensed: ")[1]).expect("a snapshot is JSON");
    assert!((sensed["values"]["sensed"]["value"].as_f64().expect("a number") + 0.25).abs() < 1e-6, "{sensed}");
}

#[test]
fn r013_a_programming_system_may_be_another_language() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/ps_in_c/servo.c");
    let program = compile(&source, "servo_twice");
    assert_eq!(run(&program), run(&program), "no clock of the host is in what it prints");
}

#[test]
fn the_header_is_cplusplus_too_and_every_misuse_is_a_sentence() {
    let source = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("misuse.c");
    let text = r#"
        #include <opengpac_ps.h>
        #include <stdio.h>
        int main(void) {
            if (opengpac_open("x", "sundial", "{}")) return 1;
            printf("%s\n", opengpac_error());
            if (opengpac_open("x", "virtual", "{")) return 2;
            printf("%s\n", opengpac_error());
            if (opengpac_call(NULL, "now", "")) return 3;
            printf("%s\n", opengpac_error());
            if (opengpac_ended_fd(NULL) != -1) return 4;
            opengpac_system *x = opengpac_open("x", "virtual", NULL);
            if (opengpac_call(x, "sing", "{}")) return 5;
            printf("%s\n", opengpac_error());
            if (opengpac_call(x, "processor", "{\"name\": \"a\", \"cores\": 2}")) return 6;
            printf("%s\n", opengpac_error());
            if (opengpac_call(x, "state", "{}")) return 7;
            printf("%s\n", opengpac_error());
            if (opengpac_call(x, "now", "\xff")) return 8;
            printf("%s\n%s\n", opengpac_error(), opengpac_error_json());
            char *now = opengpac_call(x, "now", NULL);
            printf("%s|%s\n", now, opengpac_error());
            opengpac_free(now);
            opengpac_free(NULL);
            opengpac_close(x);
            opengpac_close(NULL);
            return 0;
        }"#;
    std::fs::write(&source, text).expect("it can be written");
    let printed = run(&compile(&source, "misuse"));
    let expected = [
        "there is no clock 'sundial'",
        "this does not have the right form",
        "there is no system",
        "there is no call 'sing'",
        "call 'processor' has no argument 'cores'",
        "argument 'instance' of call 'state'",
        "the arguments: not UTF-8",
        "\"class\":\"CallError\"",
        "0|",
    ];
    let lines: Vec<&str> = printed.lines().collect();
    assert_eq!(lines.len(), expected.len(), "{printed}");
    for (line, part) in lines.iter().zip(expected) {
        assert!(line.contains(part), "{line:?} says {part:?}");
    }
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/opengpac_ps.h");
    let checked =
        Command::new("c++").args(["-std=c++17", "-Wall", "-Werror", "-fsyntax-only", "-x", "c++"]).arg(&header).output().expect("there is a C++ compiler");
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
}
