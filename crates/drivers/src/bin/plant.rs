// SPDX-License-Identifier: Apache-2.0
//! `opengpac-plant`: a plant in a process of its own. The driver `plant_process` starts it; see docs/guard.md.

fn main() -> std::process::ExitCode {
    match drivers::run_process() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("opengpac-plant: {problem}");
            std::process::ExitCode::FAILURE
        }
    }
}
