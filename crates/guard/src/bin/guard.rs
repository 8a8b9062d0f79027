// SPDX-License-Identifier: Apache-2.0
//! `opengpac-guard`: the guard process. Started by a supervisor; see docs/guard.md.

fn main() -> std::process::ExitCode {
    match guard::run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("opengpac-guard: {problem}");
            std::process::ExitCode::FAILURE
        }
    }
}
