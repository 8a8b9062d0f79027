// SPDX-License-Identifier: Apache-2.0
//! Sources from which blocks in C were compiled, kept with their code so that they can be recompiled together with others.

use super::build::{BuildOptions, CompiledSource};
use super::languages::is_cxx;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags};
use opengpac::abi::Run;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Arc, RwLock};

/// A source file as it was when its module was built.
#[derive(Debug)]
pub(crate) struct Text {
    /// Original path; the file may have been deleted or changed since.
    pub(crate) path: PathBuf,
    pub(crate) source: Vec<u8>,
    pub(crate) options: BuildOptions,
    /// User files that the source includes, each with a digest of its bytes.
    included: Vec<(PathBuf, u64)>,
    /// `Ok` if the source can be compiled again; otherwise the reason why it cannot.
    pub(crate) fit: Result<(), String>,
}

static TEXTS: RwLock<Option<HashMap<usize, Arc<Text>>>> = RwLock::new(None);

/// Keeps this text as the source of the blocks whose entry is `run`.
pub(crate) fn keep(run: Run, text: &Arc<Text>) {
    TEXTS.write().expect("nobody panics with the lock held").get_or_insert_default().insert(run as usize, text.clone());
}

/// Returns the source of the blocks whose entry is `run`, if they were built from a source in this process.
pub(crate) fn of(run: Run) -> Option<Arc<Text>> {
    TEXTS.read().expect("nobody panics with the lock held").as_ref()?.get(&(run as usize)).cloned()
}

impl Text {
    /// Returns the text of a source that has just been compiled.
    pub(crate) fn of(CompiledSource { path, source, object, read, ours }: CompiledSource, options: &BuildOptions) -> Text {
        let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let included = dependencies(&read).into_iter().filter(|file| *file != path && !file.starts_with(&ours));
        let included = included.map(|file| digest(&file).map(|digest| (whole(&file), digest))).collect::<Option<Vec<_>>>();
        let is_plain = |file: &Path| file.to_str().is_some_and(|name| !name.contains(['"', '\\']) && !name.contains(char::is_control));
        let fit = match &included {
            _ if is_cxx(&path) => Err("it is written in C++".to_string()),
            Some(files) if !files.iter().map(|(file, _)| file.as_path()).chain([path.as_path()]).all(is_plain) => {
                Err("the path of its file has quotation marks".to_string())
            }
            Some(_) if std::fs::read(&path).is_ok_and(|now| now == source) => has_no_state(&object),
            _ => Err("its file was changed while it was built".to_string()),
        };
        let options = BuildOptions { include: options.include.iter().map(|folder| whole(folder)).collect(), output: None, ..options.clone() };
        Text { path: whole(&path), source, options, included: included.unwrap_or_default(), fit }
    }

    /// Returns the first included file that has changed.
    pub(crate) fn changed(&self) -> Option<&Path> {
        self.included.iter().find(|(file, before)| digest(file) != Some(*before)).map(|(file, _)| file.as_path())
    }

    /// Returns true if `file` is the source itself or a file that it includes.
    pub(crate) fn includes(&self, file: &Path) -> bool {
        file == self.path || self.included.iter().any(|(own, _)| own == file)
    }
}

fn digest(file: &Path) -> Option<u64> {
    let mut hasher = DefaultHasher::new();
    std::fs::read(file).ok()?.hash(&mut hasher);
    Some(hasher.finish())
}

/// Returns the files listed in a rule for make, as written by `-MMD`: after the colon, with blanks in names escaped by a backslash and
/// `$` doubled.
fn dependencies(rule: &str) -> Vec<PathBuf> {
    let files = rule.split_once(": ").map_or("", |(_, files)| files).replace("\\\n", " ");
    let (mut found, mut name) = (Vec::new(), String::new());
    let mut letters = files.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' if letters.peek().is_some_and(|next| " #".contains(*next)) => name.extend(letters.next()),
            '$' if letters.peek() == Some(&'$') => name.extend(letters.next()),
            letter if letter.is_whitespace() => found.push(std::mem::take(&mut name)),
            letter => name.push(letter),
        }
    }
    found.push(name);
    found.into_iter().filter(|name| !name.is_empty()).map(PathBuf::from).collect()
}

/// Checks that an object has no variables. A second compilation would have separate copies of them, so that blocks that share a variable,
/// or keep state in one, would behave differently.
fn has_no_state(object: &[u8]) -> Result<(), String> {
    let unread = |error: object::Error| format!("its object file cannot be read: {error}");
    let file = object::File::parse(object).map_err(unread)?;
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else { return Err("its object file is not for this system".to_string()) };
        let name = section.name().map_err(unread)?;
        let is_constant = name.starts_with(".data.rel.ro") || name.starts_with("opengpac_");
        if sh_flags & u64::from(object::elf::SHF_WRITE) == 0 || is_constant || section.size() == 0 {
            continue;
        }
        if !name.starts_with(".data") && !name.starts_with(".bss") {
            return Err(format!("its file has a section '{name}'"));
        }
        let own = file.symbols().filter(|symbol| symbol.section_index() == Some(section.index()) && symbol.size() > 0);
        let variable = own.filter_map(|symbol| symbol.name().ok()).find(|name| !name.contains("opengpac_module_here"));
        if let Some(variable) = variable {
            let variable = variable.split('.').next().unwrap_or(variable);
            return Err(format!("its file has a static variable, '{variable}'"));
        }
    }
    match file.symbols().find(|symbol| symbol.is_common()).and_then(|symbol| symbol.name().ok()) {
        Some(variable) => Err(format!("its file has a static variable, '{variable}'")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_a_rule_are_read_with_blanks_and_dollars() {
        let rule = "0.o: /tmp/a\\ b.c /tmp/x/opengpac.h \\\n ../c$$d.h\n";
        assert_eq!(dependencies(rule), ["/tmp/a b.c", "/tmp/x/opengpac.h", "../c$d.h"].map(PathBuf::from));
        assert!(dependencies("").is_empty());
    }
}
