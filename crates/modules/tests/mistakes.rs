// SPDX-License-Identifier: Apache-2.0
//! A mistake in a declaration is reported in plain words, at the user's line, and only the first.

mod common;
use common::{folder, write};
use modules::{BuildError, BuildOptions, build};

/// Checks a block whose second line is `item`, with correct other lines.
fn check_in(language: &str, name: &str, item: &str, line: u32, message: &str) {
    let text = format!(
        "#include <opengpac.h>\nFUNCTION_BLOCK(block, \"What it does.\",\n    in   (double, u, \"raw\"),\n    {item},\n    out  (double, y, \"filtered\"))\n{{\n    self->y = self->u;\n    return OK;\n}}\n"
    );
    let source = write(&folder(&format!("mistakes-{language}-{name}")), &format!("block.{language}"), &text);
    match build(&[&source], &BuildOptions::default()) {
        Err(BuildError::Failed { message: found, file, line: at }) => {
            assert!(found.contains(message), "{language}: {item}\n gave: {found}\n not: {message}");
            assert_eq!((file, at), (source, line), "{language}: {item}: {found}");
        }
        other => panic!("{language}: {item} gave {other:?}"),
    }
}

fn check(name: &str, item: &str, message: &str) {
    for language in ["c", "cpp"] {
        check_in(language, name, item, 4, message);
    }
}

#[test]
fn an_unknown_word() {
    check("word", "imput(double, v, \"raw\")", "'imput(double, v, \"raw\")' is not an item of a function block: use in, in_async");
}

#[test]
fn a_missing_description() {
    check("in", "in(double, v)", "'in(double, v)' has no description: write word(T, name, \"what it is\")");
    check("param", "param(double, alpha, 0.1)", "'param(double, alpha, 0.1)' has no description");
    check("ratio", "in_ratio(double, v, 4)", "has no description");
    check("device", "device(double, v, read)", "has no description");
    check("condition", "condition(done)", "'condition(done)' has no description");
    check("unquoted", "in(double, v, 5)", "has no description in quotes");
}

#[test]
fn a_name_that_is_taken() {
    let taken = |name: &str, why: &str| {
        let message = format!("'{name}' cannot be the name of an item of block 'block': it is {why}; give it another name");
        check(name, &format!("in(double, {name}, \"raw\")"), &message);
    };
    for name in ["for", "int", "register", "static", "return"] {
        taken(name, "a keyword of C");
    }
    for name in ["NULL", "OK", "linux"] {
        taken(name, "a macro of a header that blocks include");
    }
    check("kind", "param(double[2], switch, (1, 2), \"modes\")", "'switch' cannot be the name of an item of block 'block': it is a keyword of C");
    for name in ["class", "new", "this", "template"] {
        check_in(
            "cpp",
            name,
            &format!("in(double, {name}, \"raw\")"),
            4,
            &format!("'{name}' cannot be the name of an item of block 'block': it is a keyword of C++"),
        );
    }
}

#[test]
fn too_many_arguments() {
    check("many", "in(double, v, \"raw\", \"rad\", \"more\")", "has too many arguments");
}

#[test]
fn brackets_at_the_name() {
    check("brackets", "in(double, q[6], \"joints\", \"rad\")", "'in(double, q[6], \"joints\", \"rad\")': the brackets belong to the type");
    check("one", "in(double, q[1], \"joints\", \"rad\")", "the brackets belong to the type");
}

#[test]
fn a_type_of_no_fixed_width() {
    check("int", "in(int, v, \"raw\")", "the width of this type differs between machines: write int32_t");
}

#[test]
fn a_length_that_is_no_size() {
    check_in("c", "length", "in(double[SIX], v, \"raw\")", 4, "SIX");
    check("constant", "in(double[sizeof(int)], v, \"raw\")", "the brackets hold neither a number nor the name of a size");
}

#[test]
fn a_list_of_another_length() {
    check("list", "param(double[3], k, (1, 2), \"gains\")", "must have as many values as the type has elements");
}

#[test]
fn a_device_without_its_way() {
    check("way", "device(double, v, both, \"motor\")", "declares neither read nor write");
}

#[test]
fn impossible_numbers() {
    check("zero", "in_ratio(double, v, 0, \"slow\")", "the ratio must be 1 or more");
    check("size", "size(n, 4, 2)", "the minimum size must be 1 or more");
}

#[test]
fn a_history_of_no_or_of_any_length() {
    check("history", "in_history(double, v, 0, \"past\")", "a history must hold 1 to 4096 values");
    check("history", "size(n, 1, 4), in_history(double[n], v, 3, \"past\")", "all values of a history must have the same length");
}

#[test]
fn more_than_32_items() {
    let items: Vec<String> = (0..40).map(|i| format!("in(double, v{i}, \"v\")")).collect();
    for language in ["c", "cpp"] {
        check_in(language, "items", &items.join(", "), 2, "at most 32 items");
    }
}

fn first(test: &str, text: &str) -> (String, u32) {
    match build(&[write(&folder(test), "block.c", text)], &BuildOptions::default()) {
        Err(BuildError::Failed { message, line, .. }) => (message, line),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_block_without_a_description() {
    let (message, line) =
        first("undescribed", "#include <opengpac.h>\n\nFUNCTION_BLOCK(block, in(double, u, \"raw\"), out(double, y, \"out\"))\n{ return OK; }\n");
    assert!(message.starts_with("FUNCTION_BLOCK(block, ...) has no description"), "{message}");
    assert_eq!(line, 3);
}

#[test]
fn mistakes_of_the_body() {
    let block =
        |body: &str| format!("#include <opengpac.h>\nFUNCTION_BLOCK(block, \"What.\", in(double, u, \"u\"), out(double, y, \"y\"))\n{{\n    {body}\n}}\n");
    assert_eq!(first("return", &block("self->y = 1;")).1, 5, "a missing return");
    let (message, line) = first("number", &block("return 1;"));
    assert!(message.contains("'int'") && message.contains("'opengpac_outcome'"), "{message}");
    assert_eq!(line, 4);
    let (message, line) = first("field", &block("self->z = 1; return OK;"));
    assert!(message.to_lowercase().contains("no member named 'z'"), "{message}");
    assert_eq!(line, 4);
    assert!(
        first("linker", &format!("double f(double);\n{}", block("self->y = f(self->u); return OK;"))).0.contains("'f' is declared and called but not defined")
    );
    assert!(first("report", &block("report(done); return OK;")).0.contains("opengpac_bit_done"));
}

#[test]
fn one_size_name_for_one_block_of_a_c_file() {
    let block = |name: &str| {
        format!("FUNCTION_BLOCK({name}, \"What.\", size(n, 1, 4), in(double[n], u, \"u\"), out(double, y, \"y\")) {{ self->y = self->u[0]; return OK; }}\n")
    };
    let (message, line) = first("sizes", &format!("#include <opengpac.h>\n{}{}", block("one"), block("two")));
    assert!(message.contains("the size 'n' of block 'two' has the name of another block's size"), "{message}");
    assert_eq!(line, 3);
}
