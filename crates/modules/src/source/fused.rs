// SPDX-License-Identifier: Apache-2.0
//! Fused blocks: one entry for adjacent blocks in C, compiled from their sources. It is a bank entry for different blocks: for each
//! block, it does the same as the block's own entry, in the same order, except for inputs whose value an earlier block has just stored.
//! These values are passed directly, so that the compiler keeps them in registers.

use super::build::{self, BuildError, BuildOptions};
use super::text::{self, Text};
use crate::folder::Folder;
use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
use opengpac::abi::Descriptor;
use opengpac::bank::Bank;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::CStr;
use std::fmt::Write;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

/// Maximum number of blocks in one entry.
pub const FUSED_MAX: usize = 100;

/// Maximum size of an instance. Larger blocks are run by their own entries because, as for banks, the cost of a call is small compared
/// with their work.
const FUSED_SIZE_MAX: u32 = 1024;

const SYMBOL: &str = "opengpac_fused";

/// A block of a fusion.
#[derive(Clone, Debug)]
pub struct Member {
    pub descriptor: &'static Descriptor,
    /// Inputs that read an output that an earlier block stores completely, at each invocation.
    pub wires: Vec<Wire>,
}

/// An input of a block, and the output that it reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Wire {
    /// Index of the input item.
    pub input: usize,
    /// Index of the writing block in the fusion.
    pub from: usize,
    /// Index of the output item.
    pub output: usize,
}

impl PartialEq for Member {
    fn eq(&self, other: &Member) -> bool {
        std::ptr::eq(self.descriptor, other.descriptor) && self.wires == other.wires
    }
}

impl Eq for Member {}

impl Hash for Member {
    fn hash<H: Hasher>(&self, state: &mut H) {
        std::ptr::from_ref(self.descriptor).hash(state);
        self.wires.hash(state);
    }
}

/// Human-readable reason why blocks are not fused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NotFused(pub String);

/// Checks that a block can be fused with others.
///
/// # Errors
/// Fails with the reason if it cannot.
pub fn fit(descriptor: &Descriptor) -> Result<(), NotFused> {
    let why = |text: &str| Err(NotFused(text.to_string()));
    if descriptor.instance_size > FUSED_SIZE_MAX {
        return why(&format!("its instance has {} bytes, but at most {FUSED_SIZE_MAX} are possible", descriptor.instance_size));
    }
    match text::of(descriptor.run) {
        None => why("it was not built here from a source in C"),
        Some(text) => text.fit.clone().map_err(NotFused),
    }
}

/// Creates the entry of these blocks, which runs all of them from the first, whatever range is passed. Like code modules, it is never
/// unloaded. Takes as long as a compiler run.
///
/// # Errors
/// Fails if an included file has changed, the sources are incompatible, or the compiler reports an error.
pub fn fuse(members: &[Member]) -> Result<Bank, NotFused> {
    let mut texts: Vec<Arc<Text>> = Vec::new();
    for member in members {
        fit(member.descriptor)?;
        let text = text::of(member.descriptor.run).expect("it fits");
        match texts.iter().find(|other| other.path == text.path) {
            None => texts.push(text),
            Some(other) if other.source == text.source => {}
            Some(_) => return Err(NotFused(format!("'{}' was changed between two downloads", text.path.display()))),
        }
    }
    unchanged(&texts)?;
    let room = Room::new(&texts).map_err(|error| failed(&error))?;
    let source = room.folder.path().join("opengpac-fused.c");
    std::fs::write(&source, program(&texts, members)).map_err(|error| failed(&error))?;
    if texts.len() > 1 {
        room.together(&texts, &source)?;
    }
    let (object, linked) = (source.with_extension("o"), source.with_extension("so"));
    room.compile(&source, &texts).and_then(|mut command| build::run(command.arg("-o").arg(&object), &source, &room.header)).map_err(|error| failed(&error))?;
    let link = build::link(false, &texts[0].options, &[object], &linked);
    link.and_then(|mut command| build::run(&mut command, &source, &room.header)).map_err(|error| failed(&error))?;
    // They have not been modified in the meantime.
    unchanged(&texts)?;
    // SAFETY: it has the code of modules that are loaded, and what it exports has the type that `program` writes.
    unsafe {
        let library = Library::open(Some(&linked), RTLD_NOW | RTLD_LOCAL).map_err(|error| failed(&error))?;
        let entry = *library.get::<Bank>(SYMBOL.as_bytes()).map_err(|error| failed(&error))?;
        core::mem::forget(library);
        Ok(entry)
    }
}

fn failed(what: &dyn std::fmt::Display) -> NotFused {
    NotFused(format!("it cannot be compiled: {what}"))
}

fn unchanged(texts: &[Arc<Text>]) -> Result<(), NotFused> {
    match texts.iter().find_map(|text| text.changed()) {
        Some(file) => Err(NotFused(format!("'{}' was removed or replaced since it was included", file.display()))),
        None => Ok(()),
    }
}

/// Folder in which the blocks are compiled; contains the original texts, each under its number.
struct Room {
    folder: Folder,
    header: PathBuf,
}

impl Room {
    fn new(texts: &[Arc<Text>]) -> std::io::Result<Room> {
        let folder = Folder::new()?;
        let header = build::write_header(&folder.path().join("include")).map_err(std::io::Error::other)?;
        for (number, text) in texts.iter().enumerate() {
            // Its own references to its path, and the compiler's messages about it, stay the same.
            let named = format!("#line 1 {:?}\n", text.path);
            std::fs::write(folder.path().join(numbered(number)), [named.as_bytes(), &text.source].concat())?;
        }
        Ok(Room { folder, header })
    }

    /// Returns the command that compiles one file of this folder, with the include paths of these texts.
    fn compile(&self, source: &Path, texts: &[Arc<Text>]) -> Result<Command, BuildError> {
        let include = texts.iter().flat_map(|text| text.options.include.clone()).collect();
        let mut command = build::compile(source, &BuildOptions { include, ..texts[0].options.clone() }, &self.header)?;
        for folder in texts.iter().filter_map(|text| text.path.parent()) {
            command.arg("-iquote").arg(folder);
        }
        Ok(command)
    }

    /// Fails if a text expands differently after another one than on its own, because a macro in one of them would then change the
    /// computation of the other.
    fn together(&self, texts: &[Arc<Text>], all: &Path) -> Result<(), NotFused> {
        let joined = self.lines_by_file(all, texts)?;
        for (number, text) in texts.iter().enumerate() {
            let alone = self.lines_by_file(&self.folder.path().join(numbered(number)), std::slice::from_ref(text))?;
            if let Some((file, _)) = alone.into_iter().find(|(file, lines)| text.includes(file) && joined.get(file) != Some(lines)) {
                let others: Vec<String> = texts.iter().filter(|other| other.path != text.path).map(|other| format!("'{}'", other.path.display())).collect();
                return Err(NotFused(format!("'{}' expands differently in one file with {}, because they share a macro", file.display(), others.join(", "))));
            }
        }
        Ok(())
    }

    /// Returns the preprocessed text that the compiler reads, grouped by the file that contains it.
    fn lines_by_file(&self, source: &Path, texts: &[Arc<Text>]) -> Result<BTreeMap<PathBuf, Vec<String>>, NotFused> {
        let output = self.compile(source, texts).map_err(|error| failed(&error))?.arg("-E").output().map_err(|error| failed(&error))?;
        if !output.status.success() {
            return Err(failed(&String::from_utf8_lossy(&output.stderr).lines().next().unwrap_or_default()));
        }
        let mut found: BTreeMap<PathBuf, Vec<String>> = BTreeMap::new();
        let mut file = PathBuf::new();
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            // A line marker: # 12 "file" flags.
            let marker = line.strip_prefix("# ").and_then(|rest| rest.split_once(" \"")).and_then(|(_, rest)| rest.rsplit_once('"'));
            if let Some((named, _)) = marker {
                file = PathBuf::from(named);
            } else if !line.trim().is_empty() {
                found.entry(file.clone()).or_default().push(line.trim().to_string());
            }
        }
        Ok(found)
    }
}

/// Returns a file name that no text includes. It must be unused, because files in the folder of a text take precedence in its includes.
fn numbered(number: usize) -> String {
    format!("opengpac-text-{number}.c")
}

/// Returns the text of the entry.
fn program(texts: &[Arc<Text>], members: &[Member]) -> String {
    let mut said = String::new();
    for number in 0..texts.len() {
        writeln!(said, "#include \"{}\"", numbered(number)).expect("a text takes letters");
    }
    said += &head();
    let passed: BTreeSet<(usize, usize)> = members.iter().flat_map(|member| member.wires.iter().map(|wire| (wire.from, wire.output))).collect();
    for &(from, output) in &passed {
        let of = members[from].descriptor;
        let (block, item) = (name(of.name), name(items(of)[output].name));
        writeln!(said, "    __typeof__(((struct opengpac_self_{block} *)0)->{item}) opengpac_{from}_{output};").expect("a text takes letters");
    }
    for (index, member) in members.iter().enumerate() {
        let count = items(member.descriptor).len();
        let given_in = (0..count).map(|item| match member.wires.iter().find(|wire| wire.input == item) {
            Some(wire) => format!("&opengpac_{}_{}", wire.from, wire.output),
            None => "0".to_string(),
        });
        let given_out = (0..count).map(|item| if passed.contains(&(index, item)) { format!("&opengpac_{index}_{item}") } else { "0".to_string() });
        let (given_in, given_out) = (given_in.collect::<Vec<_>>().join(", "), given_out.collect::<Vec<_>>().join(", "));
        let block = name(member.descriptor.name);
        writeln!(
            said,
            "    {{ OG_BEGIN_STEP(opengpac_at, opengpac_from + {index}) const void *const opengpac_in[] = {{{given_in}}}; void *const opengpac_out[] = {{{given_out}}};\n      \
             opengpac_result = opengpac_once_{block}(opengpac_calls[{index}].instance, opengpac_calls[{index}].invocation, opengpac_in, opengpac_out);\n      \
             if (__builtin_expect(opengpac_result != OG_DONE, 0)) return opengpac_result; }}"
        )
        .expect("a text takes letters");
    }
    said + "    return OG_DONE;\n}\n"
}

fn head() -> String {
    let face = format!("uint64_t {SYMBOL}(const opengpac_call *opengpac_calls, uint32_t *opengpac_at, uint32_t opengpac_from, uint32_t opengpac_to)");
    format!(
        "__attribute__((visibility(\"default\"))) {face};\n{face} {{\n    uint64_t opengpac_result;\n    (void)opengpac_to;\n    opengpac_calls += opengpac_from;\n"
    )
}

fn items(of: &'static Descriptor) -> &'static [opengpac::abi::Item] {
    // SAFETY: a descriptor's items are as many as it says, and stay.
    unsafe { std::slice::from_raw_parts(of.items, of.item_count as usize) }
}

fn name(of: *const std::ffi::c_char) -> &'static str {
    // SAFETY: the texts of a descriptor of C are words of its source, and stay.
    unsafe { CStr::from_ptr(of) }.to_str().expect("a name in C is ASCII")
}
