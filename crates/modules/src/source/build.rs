// SPDX-License-Identifier: Apache-2.0
//! Builds code modules from C or C++ with the system's compiler.

use super::diagnosis::{Diagnosis, first_error};
use super::languages::is_cxx;
use crate::folder::Folder;
use crate::native::seal;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Reason why a module could not be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// First error, with its line in the user's file.
    #[error("{message}, at {}:{line}", file.display())]
    Failed { message: String, file: PathBuf, line: u32 },
    #[error("there is no source file '{}'", path.display())]
    NotFound { path: PathBuf },
    #[error("nothing to build: give at least one C or C++ file")]
    NoSources,
    #[error("there is no C compiler (tried {tried}): install one (on Debian: apt install gcc), set CC, or: pip install ziglang")]
    NoCompiler { tried: String },
    #[error("'{}' cannot be written: {what}", path.display())]
    Unwritable { path: PathBuf, what: String },
}

/// Options of a build.
#[derive(Clone, Debug, Default)]
pub struct BuildOptions {
    /// Path of the module; defaults to the path of the first source, with the extension `.so`.
    pub output: Option<PathBuf>,
    /// Additional folders for `#include`.
    pub include: Vec<PathBuf>,
    /// Interpreter that has the `ziglang` wheel; `python3` unless set.
    pub python: Option<OsString>,
}

/// Flags that make blocks bit-identical on every machine: no contraction, no reassociation. A missing `return` is an error, and an
/// undefined function is an error at link time; there is no lazy binding.
const COMPILE: [&str; 9] =
    ["-c", "-O2", "-fPIC", "-ffp-contract=off", "-fno-fast-math", "-fno-math-errno", "-fvisibility=hidden", "-fmax-errors=1", "-Werror=return-type"];
const C_ONLY: [&str; 3] = ["-Werror=implicit-function-declaration", "-Werror=incompatible-pointer-types", "-Werror=int-conversion"];
const CXX_ONLY: [&str; 1] = ["-std=gnu++17"];
const LINK: [&str; 5] = ["-shared", "-Wl,-z,defs", "-Wl,-z,now", "-Wl,-Bsymbolic", "-lm"];

/// Writes `opengpac.h` and `opengpac_driver.h` into a folder, for an editor or another build; returns the path of the first.
///
/// # Errors
/// Fails if the folder cannot be written.
pub fn write_header(folder: &Path) -> Result<PathBuf, BuildError> {
    let unwritable = |path: &Path, error: std::io::Error| BuildError::Unwritable { path: path.to_path_buf(), what: error.to_string() };
    std::fs::create_dir_all(folder).map_err(|error| unwritable(folder, error))?;
    let [path, driver] = [("opengpac.h", opengpac::HEADER), ("opengpac_driver.h", opengpac::DRIVER_HEADER)].map(|(name, text)| (folder.join(name), text));
    for (path, text) in [&path, &driver] {
        std::fs::write(path, text).map_err(|error| unwritable(path, error))?;
    }
    Ok(path.0)
}

/// Returns the command that compiles C (or C++): `$CC` (`$CXX`), `cc`, `gcc`, `clang`, or otherwise the `ziglang` wheel of `python`.
///
/// # Errors
/// Fails if none of them exists.
pub fn compiler(cxx: bool, python: Option<&OsString>) -> Result<Vec<OsString>, BuildError> {
    let (variable, names) = if cxx { ("CXX", ["c++", "g++", "clang++"]) } else { ("CC", ["cc", "gcc", "clang"]) };
    if let Some(given) = std::env::var_os(variable).filter(|given| !given.is_empty()) {
        // "gcc-12 -m64" is a command with an argument, as in make.
        return Ok(given.to_string_lossy().split_whitespace().map(OsString::from).collect());
    }
    let runs = |command: &[OsString]| {
        let (program, arguments) = command.split_first().expect("commands here have a program");
        let status = Command::new(program).args(arguments).arg("--version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    };
    let python = python.cloned().unwrap_or_else(|| "python3".into());
    let zig: Vec<OsString> = vec![python, "-m".into(), "ziglang".into(), if cxx { "c++" } else { "cc" }.into()];
    let candidates = names.iter().map(|name| vec![OsString::from(name)]).chain([zig]);
    candidates.into_iter().find(|command| runs(command)).ok_or_else(|| BuildError::NoCompiler { tried: format!("${variable}, {}, ziglang", names.join(", ")) })
}

/// Builds one code module from C and C++ sources; returns its path.
///
/// # Errors
/// Fails with the first error of the first faulty source, or with the reason why it could not be built.
pub fn build<P: AsRef<Path>>(sources: &[P], options: &BuildOptions) -> Result<PathBuf, BuildError> {
    build_told(sources, options).map(|(path, _)| path)
}

/// A compiled source.
pub(super) struct CompiledSource {
    pub path: PathBuf,
    pub source: Vec<u8>,
    pub object: Vec<u8>,
    /// Files that the compiler read, as listed by the compiler; those in `ours` do not belong to the user.
    pub read: String,
    pub ours: PathBuf,
}

/// Builds a code module; returns its path and its compiled sources.
pub(super) fn build_told<P: AsRef<Path>>(sources: &[P], options: &BuildOptions) -> Result<(PathBuf, Vec<CompiledSource>), BuildError> {
    let Some(first) = sources.first() else { return Err(BuildError::NoSources) };
    let output = options.output.clone().unwrap_or_else(|| first.as_ref().with_extension("so"));
    let unwritable = |path: &Path, error: std::io::Error| BuildError::Unwritable { path: path.to_path_buf(), what: error.to_string() };
    let folder = Folder::new().map_err(|error| unwritable(&std::env::temp_dir(), error))?;
    let header = write_header(&folder.path().join("include"))?;
    let (mut objects, mut compiled) = (Vec::new(), Vec::new());
    for (index, source) in sources.iter().map(AsRef::as_ref).enumerate() {
        if !source.is_file() {
            return Err(BuildError::NotFound { path: source.to_path_buf() });
        }
        let object = folder.path().join(format!("{index}.o"));
        let read = object.with_extension("d");
        let before = std::fs::read(source).map_err(|error| unwritable(source, error))?;
        let mut command = compile(source, options, &header)?;
        command.arg("-MMD").arg("-MF").arg(&read).arg("-o").arg(&object);
        run(&mut command, source, &header)?;
        let of = std::fs::read(&object).map_err(|error| unwritable(&object, error))?;
        let read = std::fs::read_to_string(&read).map_err(|error| unwritable(&read, error))?;
        compiled.push(CompiledSource { path: source.to_path_buf(), source: before, object: of, read, ours: folder.path().to_path_buf() });
        objects.push(object);
    }
    let linked = folder.path().join("linked.so");
    let cxx = sources.iter().any(|source| is_cxx(source.as_ref()));
    run(&mut link(cxx, options, &objects, &linked)?, first.as_ref(), &header)?;
    let bytes = std::fs::read(&linked).map_err(|error| unwritable(&linked, error))?;
    // Never written in place, because a module of this name may be in use.
    let fresh = output.with_extension(format!("so.{}", std::process::id()));
    std::fs::write(&fresh, seal::sealed(bytes)).map_err(|error| unwritable(&fresh, error))?;
    std::fs::rename(&fresh, &output).map_err(|error| unwritable(&output, error))?;
    Ok((output, compiled))
}

/// Returns the command that compiles a source, without the output option.
pub(super) fn compile(source: &Path, options: &BuildOptions, header: &Path) -> Result<Command, BuildError> {
    let mut command = start(&compiler(is_cxx(source), options.python.as_ref())?);
    command.args(COMPILE).args(if is_cxx(source) { &CXX_ONLY[..] } else { &C_ONLY[..] });
    for include in header.parent().into_iter().chain(options.include.iter().map(PathBuf::as_path)) {
        command.arg("-I").arg(include);
    }
    command.arg(source);
    Ok(command)
}

/// Returns the command that links objects.
pub(super) fn link(cxx: bool, options: &BuildOptions, objects: &[PathBuf], linked: &Path) -> Result<Command, BuildError> {
    let mut command = start(&compiler(cxx, options.python.as_ref())?);
    command.args(objects).arg("-o").arg(linked).args(LINK);
    Ok(command)
}

fn start(command: &[OsString]) -> Command {
    let (program, arguments) = command.split_first().expect("commands here have a program");
    let mut started = Command::new(program);
    started.args(arguments).env("LC_ALL", "C").stdin(Stdio::null());
    started
}

pub(super) fn run(command: &mut Command, source: &Path, header: &Path) -> Result<(), BuildError> {
    let output = command.output().map_err(|error| BuildError::NoCompiler { tried: format!("{}: {error}", command.get_program().display()) })?;
    if output.status.success() {
        return Ok(());
    }
    let Diagnosis { message, file, line } = first_error(&String::from_utf8_lossy(&output.stderr), source, header);
    Err(BuildError::Failed { message, file, line })
}
