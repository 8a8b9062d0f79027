// SPDX-License-Identifier: Apache-2.0
//! Blocks that can be fused, and those that are refused with a reason. `fused.rs` of the kernel shows that fused blocks compute the same.
mod common;
use common::{folder, options, write};
use modules::fused::{Member, NotFused, Wire, fit, fuse};
use modules::load;
use opengpac::abi::Descriptor;
use std::fs;
use std::path::Path;

/// Returns the block of a file with this text.
fn block_of(folder: &Path, name: &str, text: &str) -> &'static Descriptor {
    block(&write(folder, name, text))
}

fn block(path: &Path) -> &'static Descriptor {
    load(path, &options()).unwrap().blocks[0].descriptor
}

/// Returns a block that multiplies by the expression `by`.
fn gain(name: &str, before: &str, by: &str) -> String {
    let items = "in(double, u, \"value\"), out(double, y, \"product\")";
    format!("#include <opengpac.h>\n{before}\nFUNCTION_BLOCK({name}, \"y = k u.\", {items}) {{ self->y = {by} * self->u; return OK; }}\n")
}

/// Returns two members; the second reads the first one's output.
fn pair(first: &'static Descriptor, second: &'static Descriptor) -> [Member; 2] {
    [Member { descriptor: first, wires: vec![] }, Member { descriptor: second, wires: vec![Wire { input: 0, from: 0, output: 1 }] }]
}

fn why<T>(fused: Result<T, NotFused>) -> String {
    match fused {
        Ok(_) => panic!("it was fused"),
        Err(NotFused(why)) => why,
    }
}

#[test]
fn blocks_of_one_file_and_of_several_are_fused() {
    let folder = folder("fused-several");
    write(&folder, "twice.h", "#ifndef TWICE\n#define TWICE\nstatic inline double twice(double x) { return 2 * x; }\n#endif\n");
    let first = block_of(&folder, "first.c", &gain("first", "#include \"twice.h\"\n#include <math.h>", "twice(sqrt(2.0))"));
    let second = block_of(&folder, "a second.c", &gain("second", "#include \"twice.h\"\nstatic const double K[] = {1.5, 2.5};", "twice(K[1])"));
    fuse(&pair(first, first)).unwrap();
    fuse(&pair(first, second)).unwrap();
}

#[test]
fn a_source_is_fused_as_it_was_when_it_was_downloaded() {
    let folder = folder("fused-gone");
    let first = block_of(&folder, "first.c", &gain("first", "", "2.0"));
    let other = block_of(&folder, "first.c", &gain("other", "", "3.0"));
    fs::remove_file(folder.join("first.c")).unwrap();
    fuse(&pair(first, first)).unwrap();
    let said = why(fuse(&pair(first, other)));
    assert!(said.ends_with("first.c' was changed between two downloads"), "{said}");
}

#[test]
fn a_header_that_has_changed_is_told() {
    let folder = folder("fused-changed");
    write(&folder, "k.h", "#define K 2.0\n");
    let of = block_of(&folder, "first.c", &gain("first", "#include \"k.h\"", "K"));
    fuse(&pair(of, of)).unwrap();
    write(&folder, "k.h", "#define K 3.0\n");
    let said = why(fuse(&pair(of, of)));
    assert!(said.contains("k.h' was removed or replaced since it was included"), "{said}");
}

#[test]
fn macros_of_one_source_change_no_other() {
    let folder = folder("fused-macros");
    let first = block_of(&folder, "first.c", &gain("first", "#define K 2.0", "K"));
    let second = block_of(&folder, "second.c", &gain("second", "#ifndef K\n#define K 3.0\n#endif", "K"));
    let said = why(fuse(&pair(first, second)));
    assert!(said.contains("second.c' expands differently in one file with '") && said.ends_with("first.c', because they share a macro"), "{said}");
}

#[test]
fn names_that_two_sources_have_are_told_as_the_compiler_tells_them() {
    let folder = folder("fused-names");
    let of = |name: &str| block_of(&folder, &format!("{name}.c"), &gain(name, "static double k(void) { return 2.0; }", "k()"));
    let said = why(fuse(&pair(of("first"), of("second"))));
    assert!(said.starts_with("it cannot be compiled: ") && said.contains("redefinition of") && said.contains("second.c:2"), "{said}");
}

#[test]
fn what_keeps_something_or_was_not_built_here_is_not_fused() {
    let folder = folder("fused-state");
    for (before, by, said) in [
        ("static int count;", "(double)count++", "its file has a static variable, 'count'"),
        ("static double k = 2.0;", "(k += 1.0)", "its file has a static variable, 'k'"),
        ("double shared;", "(shared += 1.0)", "its file has a static variable, 'shared'"),
        ("static _Thread_local int count;", "(double)count++", "its file has a section '.tbss'"),
        ("static double once(void) { static double k; return k += 1.0; }", "once()", "its file has a static variable, 'k'"),
        ("__attribute__((constructor)) static void begin(void) { volatile int here = 0; (void)here; }", "2.0", "its file has a section '.init_array'"),
    ] {
        assert_eq!(fit(block_of(&folder, "kept.c", &gain("kept", before, by))), Err(NotFused(said.to_string())), "{before}");
    }
    assert_eq!(why(fit(block_of(&folder, "plus.cpp", &gain("plus", "", "2.0")))), "it is written in C++");
    let large = "#include <opengpac.h>\nFUNCTION_BLOCK(large, \"zeros\", out(double[200], y, \"zeros\")) { self->y[0] = 0; return OK; }\n";
    assert_eq!(why(fit(block_of(&folder, "large.c", large))), "its instance has 1632 bytes, but at most 1024 are possible");
    let object = modules::build(&[write(&folder, "built.c", &gain("built", "", "2.0"))], &options().build).unwrap();
    assert_eq!(why(fit(block(&object))), "it was not built here from a source in C");
}
