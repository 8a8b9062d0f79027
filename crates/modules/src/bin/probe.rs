// SPDX-License-Identifier: Apache-2.0
//! `opengpac-probe FILE`: loads a code module and walks its tables, so that a bad file crashes this process and not the real-time system.
//! Prints one line; see `modules::Probe`.

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use opengpac::abi::{MODULE_SYMBOL, Module};
use opengpac::read::{ModuleFace, Refusal};

const MEMORY_BYTES_MAX: u64 = 8 << 30;

fn main() {
    let Some(file) = std::env::args_os().nth(1) else {
        println!("usage: opengpac-probe FILE");
        std::process::exit(2);
    };
    for (resource, limit) in [(libc::RLIMIT_CORE, 0), (libc::RLIMIT_AS, MEMORY_BYTES_MAX)] {
        let limit = libc::rlimit { rlim_cur: limit, rlim_max: limit };
        // SAFETY: a limit of this process is lowered. If that fails the probe only leaves a core file or takes more memory.
        unsafe { libc::setrlimit(resource, &limit) };
    }
    // SAFETY: loading runs code of the file; that is what this process is for.
    let line = match unsafe { Library::open(Some(&file), RTLD_NOW | RTLD_LOCAL) } {
        Err(error) => format!("noload {error}"),
        // SAFETY: the symbol has this type in every version of the ABI; if the file lies, this process ends.
        Ok(library) => match unsafe { library.get::<unsafe extern "C" fn() -> *const Module>(MODULE_SYMBOL.as_bytes()) } {
            Err(_) => "nosymbol".to_string(),
            // SAFETY: as above; the library is not closed before the process ends.
            Ok(entry) => match unsafe { ModuleFace::read(entry()) } {
                Err(Refusal::AbiVersion { module, .. }) => format!("abi {module}"),
                // Readable; the parent reports its faults in full.
                Ok(_) | Err(_) => "ok".to_string(),
            },
        },
    };
    println!("{}", line.replace('\n', " "));
    use std::io::Write;
    let _ = std::io::stdout().flush();
    // Without running the file's exit handlers. SAFETY: ends this process.
    unsafe { libc::_exit(0) };
}
