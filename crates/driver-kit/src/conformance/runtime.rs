// SPDX-License-Identifier: Apache-2.0
//! Runtime of the real-time sanitizer, as a library that is preloaded into a process. It interposes between a program and the C library,
//! so that neither a driver nor this program need be compiled for it.
use std::env::consts::ARCH;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Calls that the sanitizer permits: transfers on an `O_NONBLOCK` descriptor. A call that blocks nevertheless is detected by the number
/// of times that its thread yields the processor.
const PASSES: [&str; 10] = ["read", "readv", "recv", "recvfrom", "recvmsg", "write", "writev", "send", "sendto", "sendmsg"];
/// Object file that may be linked only into programs, not into a library.
const OF_PROGRAMS: &str = "rtsan_preinit.cpp.o";
/// Replacement for that object file: the C library's functions cannot be resolved before it has run, and a program may allocate memory
/// during its start.
const BEGINS: &str = "void __rtsan_ensure_initialized(void);\n\
    __attribute__((constructor)) static void begin(void) { __rtsan_ensure_initialized(); }\n";

/// Builds the library in a folder from the runtime of a compiler: Rust's, or that of clang 20 or newer. Returns `None` if no installed
/// compiler has it.
pub fn sanitizer_in(folder: &Path) -> Option<PathBuf> {
    let (parts, begins, library) = (folder.join("rtsan.a"), folder.join("begins.c"), folder.join("sanitizer.so"));
    std::fs::write(&begins, BEGINS).ok()?;
    std::fs::copy(of_rust().or_else(of_clang)?, &parts).ok()?;
    let passes: String = PASSES.iter().map(|name| format!("function-name-matches:^{name}$\n")).collect();
    std::fs::write(passes_of(&library), passes).ok()?;
    let is_done = |command: &mut Command| command.output().is_ok_and(|output| output.status.success());
    let made = is_done(Command::new("ar").arg("d").arg(&parts).arg(OF_PROGRAMS))
        && is_done(
            Command::new("cc")
                .args(["-shared", "-fPIC", "-o"])
                .arg(&library)
                .arg(&begins)
                .args(["-Wl,--whole-archive".as_ref(), parts.as_os_str(), "-Wl,--no-whole-archive".as_ref()])
                .args(["-lpthread", "-ldl", "-lm"]),
        );
    made.then_some(library)
}

/// Returns the path of the file that lists the calls permitted by a library.
pub(super) fn passes_of(library: &Path) -> PathBuf {
    library.with_extension("passes")
}

fn of_rust() -> Option<PathBuf> {
    let folder = PathBuf::from(said_by("rustc", "--print=sysroot")?).join(format!("lib/rustlib/{ARCH}-unknown-linux-gnu/lib"));
    let mut files = std::fs::read_dir(folder).ok()?.flatten().map(|file| file.path());
    files.find(|path| path.to_str().is_some_and(|path| path.ends_with("_rt.rtsan.a")))
}

fn of_clang() -> Option<PathBuf> {
    let names = ["libclang_rt.rtsan.a".to_owned(), format!("libclang_rt.rtsan-{ARCH}.a")];
    // If clang does not have the file, it prints the name alone.
    names.iter().filter_map(|name| said_by("clang", &format!("-print-file-name={name}")).map(PathBuf::from)).find(|path| path.is_file())
}

fn said_by(program: &str, asked: &str) -> Option<String> {
    let output = Command::new(program).arg(asked).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
