// SPDX-License-Identifier: Apache-2.0
//! Process in which the conformance kit checks a driver, for tests.

fn main() -> std::process::ExitCode {
    match drivers::run_check() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("drivers-check: {problem}");
            std::process::ExitCode::FAILURE
        }
    }
}
