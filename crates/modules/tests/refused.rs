// SPDX-License-Identifier: Apache-2.0
//! Invalid files are refused by name, and this process survives.

mod common;
use common::{GAIN, built, folder, options, refusal, write};
use modules::{LoadError, LoadOptions, PYTHON_PROBE, Probe, load};
use opengpac::trial::Trial;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Size of the mark and checksum that `build` appends.
const SEAL_BYTES: usize = 31;

/// Builds a shared object from this source without our header's macros.
fn shared(test: &str, text: &str) -> PathBuf {
    let folder = folder(test);
    let (source, object) = (write(&folder, "source.c", text), folder.join("object.so"));
    let compiler = modules::compiler(false, None).unwrap();
    let status = Command::new(&compiler[0]).args(&compiler[1..]).args(["-shared", "-fPIC", "-o"]).arg(&object).arg(&source).status().unwrap();
    assert!(status.success());
    object
}

fn works(path: &Path) {
    let module = load(path, &options()).unwrap();
    let mut trial = Trial::of(module.blocks[0].clone());
    trial.set_number("u", 21.0).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.number("y").unwrap(), 42.0);
}

#[test]
fn a_file_that_is_not_there() {
    assert!(matches!(refusal(Path::new("nowhere/at/all.so")), LoadError::NotFound { .. }));
}

#[test]
fn a_file_that_is_no_shared_object() {
    let path = write(&folder("refused-text"), "text.so", "this is a text");
    assert!(matches!(refusal(&path), LoadError::Damaged { what, .. } if what == "it is not a shared object"));
}

#[test]
fn a_shared_object_that_is_no_module() {
    let error = refusal(&shared("refused-other", "int f(void) { return 1; }"));
    assert!(matches!(error, LoadError::NotAModule { .. }), "{error}");
}

#[test]
fn another_abi_version() {
    let object = shared("refused-abi", "static const unsigned table[32] = {77}; const void *opengpac_module(void) { return table; }");
    for probe in [options().probe, Probe::python("python3")] {
        let error = load(&object, &LoadOptions { probe, ..options() }).unwrap_err();
        assert!(matches!(error, LoadError::AbiVersion { module: 77, here: opengpac::abi::ABI, .. }), "{error}");
    }
}

#[test]
fn a_module_without_a_block() {
    let object = built("refused-empty", "#include <opengpac.h>\n");
    let error = refusal(&object);
    assert!(matches!(error, LoadError::NoBlocks { .. }), "{error}");
}

#[test]
fn two_blocks_of_one_name() {
    let folder = folder("refused-twice");
    let sources = [write(&folder, "one.c", GAIN), write(&folder, "two.c", GAIN)];
    let path = modules::build(&sources, &Default::default()).unwrap();
    let error = refusal(&path);
    assert!(matches!(&error, LoadError::Invalid { block, what, .. } if block == "gain" && what.contains("two blocks of this name")), "{error}");
}

#[test]
fn two_items_of_one_name_do_not_compile() {
    let source = write(
        &folder("refused-items"),
        "twice.c",
        "#include <opengpac.h>\nFUNCTION_BLOCK(b, \"What.\", in(double, u, \"in\"), out(double, u, \"out\")) { return OK; }\n",
    );
    let error = refusal(&source);
    assert!(matches!(&error, LoadError::BuildFailed { line: 2, .. }), "{error}");
}

#[test]
fn a_module_whose_initialisation_crashes_or_never_ends() {
    let crash = format!("{GAIN}volatile int *nowhere;\n__attribute__((constructor)) static void start(void) {{ *nowhere = 1; }}");
    let error = refusal(&built("refused-crash", &crash));
    assert!(matches!(error, LoadError::Crashed { signal: 11, .. }), "{error}");
    let hang = format!("{GAIN}__attribute__((constructor)) static void start(void) {{ for (volatile int i = 0;; i++) {{}} }}");
    let mut options = options();
    options.probe.limit = Duration::from_millis(300);
    let error = load(&built("refused-hang", &hang), &options).unwrap_err();
    assert!(matches!(error, LoadError::TimedOut { .. }), "{error}");
}

#[test]
fn a_foreign_machine_is_named() {
    let good = std::fs::read(built("refused-foreign", GAIN)).unwrap();
    let folder = folder("refused-foreign-files");
    let foreign = |name: &str, at: &[(usize, u8)], have: &str| {
        let mut bytes = good[..good.len() - SEAL_BYTES].to_vec();
        for (offset, byte) in at {
            bytes[*offset] = *byte;
        }
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        match refusal(&path) {
            LoadError::ForeignTarget { have: found, .. } => assert_eq!(found, have),
            other => panic!("{other}"),
        }
    };
    let (other, name) = if cfg!(target_arch = "aarch64") { (62, "x86_64-linux") } else { (183, "aarch64-linux") };
    foreign("machine.so", &[(18, other)], name);
    foreign("bits.so", &[(4, 1), (18, 40)], "arm-linux");
    foreign("windows.so", &[(0, b'M'), (1, b'Z')], "a Windows module");
}

#[test]
fn a_truncated_module_at_any_length() {
    let good = std::fs::read(built("refused-short", GAIN)).unwrap();
    let path = folder("refused-short-files").join("short.so");
    for part in 0..40 {
        std::fs::write(&path, &good[..(good.len() - SEAL_BYTES) * part / 40]).unwrap();
        let error = refusal(&path);
        assert!(matches!(error, LoadError::Damaged { .. }), "{part}/40: {error}");
    }
    std::fs::write(&path, &good).unwrap();
    works(&path);
}

#[test]
fn a_flipped_byte_breaks_the_seal() {
    let good = std::fs::read(built("refused-sealed", GAIN)).unwrap();
    let path = folder("refused-sealed-files").join("flipped.so");
    for seed in 0..64u64 {
        let mut bytes = good.clone();
        let at = (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 20) as usize % (bytes.len() - SEAL_BYTES);
        bytes[at] ^= 1 << (seed % 8);
        std::fs::write(&path, bytes).unwrap();
        let error = refusal(&path);
        assert!(matches!(error, LoadError::Damaged { .. }), "byte {at}: {error}");
    }
}

#[test]
fn a_module_without_a_seal_kills_a_child_at_most() {
    let good = std::fs::read(built("refused-unsealed", GAIN)).unwrap();
    let good = &good[..good.len() - SEAL_BYTES];
    let path = folder("refused-unsealed-files").join("flipped.so");
    // The tables that a loader follows: damage there is the most dangerous.
    let section = |name: &str| {
        let object = |at: usize| u64::from_le_bytes(good[at..at + 8].try_into().unwrap()) as usize;
        let half = |at: usize| u16::from_le_bytes(good[at..at + 2].try_into().unwrap()) as usize;
        let word = |at: usize| u32::from_le_bytes(good[at..at + 4].try_into().unwrap()) as usize;
        let header = |index: usize| object(0x28) + index * half(0x3a);
        let names = object(header(half(0x3e)) + 24);
        let index = (0..half(0x3c)).find(|index| good[names + word(header(*index))..].starts_with(format!("{name}\0").as_bytes())).unwrap();
        object(header(index) + 24)..object(header(index) + 24) + object(header(index) + 32)
    };
    let mut refused = 0;
    for (name, seeds) in [(".dynamic", 0..40u64), (".dynstr", 40..50), (".dynsym", 50..64), (".rela.dyn", 64..90)] {
        let range = section(name);
        for seed in seeds {
            let mut bytes = good.to_vec();
            let at = range.start + (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 24) as usize % range.len();
            bytes[at] ^= 0xa5;
            std::fs::write(&path, bytes).unwrap();
            // Some damage is harmless; the module must then work.
            if load(&path, &options()).is_err() {
                refused += 1;
            }
        }
    }
    assert!(refused >= 10, "{refused}");
    std::fs::write(&path, good).unwrap();
    works(&path);
}

#[test]
fn a_rebuilt_module_is_loaded_beside_the_old_one() {
    let folder = folder("refused-rebuilt");
    let path = write(&folder, "gain.c", GAIN);
    let old = load(&path, &options()).unwrap();
    write(&folder, "gain.c", &GAIN.replace("self->k * self->u", "-self->k * self->u"));
    let new = load(&path, &options()).unwrap();
    let y = |module: &modules::LoadedModule| {
        let mut trial = Trial::of(module.blocks[0].clone());
        trial.set_number("u", 1.0).unwrap();
        trial.run().unwrap();
        trial.number("y").unwrap()
    };
    assert_eq!((y(&old), y(&new)), (2.0, -2.0));
}

/// Shell as a probe: it appends a line to a file, and reports that the module is sound.
fn counted(count: &Path) -> LoadOptions {
    let script = format!("echo >> '{}'; echo ok", count.display());
    LoadOptions { probe: Probe::of(["sh".into(), "-c".into(), script.into()]), ..options() }
}

#[test]
fn the_same_bytes_are_tried_once_by_a_process() {
    let (object, folder) = (built("refused-again", GAIN), folder("refused-again-count"));
    let count = folder.join("count");
    let tried = || std::fs::read(&count).map_or(0, |lines| lines.len());
    let _ = std::fs::remove_file(&count);
    for _ in 0..3 {
        load(&object, &counted(&count)).unwrap();
        assert_eq!(tried(), 1, "known bytes");
    }
    load(&built("refused-again-other", &GAIN.replace("2.0", "3.0")), &counted(&count)).unwrap();
    assert_eq!(tried(), 2, "other bytes");
    load(&object, &options()).unwrap();
    assert!(load(&object, &LoadOptions { probe: Probe::of(["/nowhere/probe".into()]), ..options() }).is_err(), "another probe");
    let wrong = shared("refused-again-wrong", "int f(void) { return 1; }");
    for times in 3..5 {
        assert!(matches!(load(&wrong, &counted(&count)), Err(LoadError::NotAModule { .. })));
        assert_eq!(tried(), times, "a file that is refused is tried again");
    }
}

#[test]
fn a_process_that_receives_what_was_tried_starts_no_child() {
    let module = load(&built("refused-unneeded", GAIN), &LoadOptions { probe: Probe::unneeded(), ..options() }).unwrap();
    assert_eq!(module.blocks[0].name, "gain");
}

#[test]
fn the_python_probe_does_the_same() {
    assert!(PYTHON_PROBE.contains(&format!("if u32(table) != {}:", opengpac::abi::ABI)), "the probe knows this version of the ABI");
    let options = LoadOptions { probe: Probe::python("python3"), ..options() };
    let module = load(&built("refused-python", GAIN), &options).unwrap();
    assert_eq!(module.blocks[0].name, "gain");
    let error = load(&shared("refused-python-other", "int f(void) { return 1; }"), &options).unwrap_err();
    assert!(matches!(error, LoadError::NotAModule { .. }), "{error}");
}
