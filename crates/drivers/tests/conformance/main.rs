// SPDX-License-Identifier: Apache-2.0
//! The conformance kit: every driver of this crate passes it, and each faulty one is refused by the intended check, with its cause.
mod faulty;
mod ours;

use driver_kit::conformance::{Outcome, Report, Settings, Verdict, sanitizer_in};
use serde_json::Value;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

/// Returns the build folder, which exists as long as this program runs.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("conformance-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for tests can be made");
        path
    })
}

/// Builds a shared object from this source.
fn built(name: &str, source: &str) -> PathBuf {
    let file = folder().join(format!("{name}.c"));
    std::fs::write(&file, source).expect("a file for tests can be written");
    modules::build(&[file], &Default::default()).unwrap_or_else(|why| panic!("{name}: {why}"))
}

fn settings() -> Settings {
    static COUNTING: OnceLock<PathBuf> = OnceLock::new();
    static SANITIZER: OnceLock<Option<PathBuf>> = OnceLock::new();
    Settings {
        command: vec![env!("CARGO_BIN_EXE_drivers-check").into()],
        exchanges: 20_000,
        counting: Some(COUNTING.get_or_init(|| built("counting", Settings::COUNTING)).clone()),
        sanitizer: SANITIZER.get_or_init(|| sanitizer_in(folder())).clone(),
        limit: Duration::from_secs(120),
    }
}

fn checked(kind: &str, options: &Value) -> Report {
    drivers::check_conformance(kind, options, &settings(), &mut |_| ControlFlow::Continue(()))
}

/// Returns the report up to the first failing check, as `opengpac driver check` makes it.
fn checked_until_it_fails(kind: &str, options: &Value, limit: Duration) -> Report {
    let mut hear = |outcome: &Outcome| if matches!(outcome.verdict, Verdict::Failed(_)) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    drivers::check_conformance(kind, options, &Settings { limit, ..settings() }, &mut hear)
}
