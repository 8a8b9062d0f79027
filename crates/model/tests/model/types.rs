// SPDX-License-Identifier: Apache-2.0
//! C types: parsing, layout, and conversion of values.
use model::refusal::Class;
use model::types::Type;
use model::value::Value;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use std::fmt::Write;

fn read(text: &str) -> Type {
    Type::parse(text, &Default::default()).unwrap_or_else(|refusal| panic!("{refusal}"))
}

fn value(json: serde_json::Value) -> Value {
    serde_json::from_value(json).expect("every JSON but null is a value")
}

#[test]
fn spelling_does_not_count_and_member_names_do() {
    for (text, normalised) in [
        ("double", "double"),
        ("_Bool", "bool"),
        ("unsigned char", "uint8_t"),
        ("int", "int32_t"),
        ("unsigned", "uint32_t"),
        ("long long", "int64_t"),
        ("short", "int16_t"),
        ("double[3][2]", "double[3][2]"),
        (" float [ 4 ] ", "float[4]"),
        ("struct tag { double x; double q[4]; }", "struct { double x; double[4] q; }"),
        ("struct { double[4] q; int a, b[2]; }", "struct { double[4] q; int32_t a; int32_t[2] b; }"),
        ("struct { struct { bool on; } inner; }", "struct { struct { bool on; } inner; }"),
    ] {
        assert_eq!(read(text).normalised(), normalised);
        assert_eq!(read(normalised), read(text));
    }
    assert_eq!(read("struct a { int x; }").hash(), read("struct b { int32_t x; }").hash());
    assert_ne!(read("struct { int x; }").hash(), read("struct { int y; }").hash());
    assert_ne!(read("double[6]").hash(), read("double[7]").hash());
}

#[test]
fn named_structs_are_looked_up() {
    let types = [("pose", "struct { double x; vec q; }"), ("vec", "struct { double v[4]; }"), ("loop", "struct { loop l; }")];
    let types = types.into_iter().map(|(n, d)| (n.to_owned(), d.to_owned())).collect();
    assert_eq!(Type::parse("pose[2]", &types).unwrap().normalised(), "struct { double x; struct { double[4] v; } q; }[2]");
    assert!(Type::parse("loop", &types).unwrap_err().to_string().contains("a type cannot contain itself"));
    assert_eq!(Type::parse_sized("double[n][2]", &types, Some(3)).unwrap().normalised(), "double[3][2]");
}

#[test]
fn what_cannot_be_read_says_why() {
    for (text, why) in [
        ("", "it is empty"),
        ("doubel", "did you mean 'double'?"),
        ("long", "write int64_t"),
        ("size_t", "write uint64_t"),
        ("char", "write int8_t or uint8_t"),
        ("double*", "it is a pointer"),
        ("double[0]", "an array must have at least one element"),
        ("double[n]", "the number of elements 'n' is not a number"),
        ("double[3", "']' is missing at the end"),
        ("double x", "'x' is not expected here"),
        ("struct { }", "a struct must have at least one member"),
        ("struct { int a; int a; }", "the member 'a' appears twice"),
        ("struct { int a }", "';' is expected before '}'"),
        ("double[99999][99999]", "it has more than"),
        ("void", "'void' has no value"),
        ("struct { int; }", "a member's name is missing"),
        ("[3]", "'[' is not a type"),
        ("struct pose", "there is no type 'pose'"),
    ] {
        let refusal = Type::parse(text, &Default::default()).expect_err(text);
        assert_eq!(refusal.class, Class::DefinitionError);
        assert!(refusal.to_string().contains(why), "{text}: {refusal}");
    }
}

#[test]
fn values_that_do_not_fit_say_why() {
    for (text, json, why) in [
        ("uint8_t", serde_json::json!(300), "300 does not fit uint8_t (0 to 255)"),
        ("int8_t", serde_json::json!(-129), "-129 does not fit int8_t (-128 to 127)"),
        ("int32_t", serde_json::json!(1.5), "int32_t takes a whole number, not 1.5"),
        ("float", serde_json::json!(1e300), "is out of range for float"),
        ("bool", serde_json::json!(1), "bool takes true or false, not 1"),
        ("double", serde_json::json!(true), "double takes a number, not true"),
        ("double", serde_json::json!("20 ms"), "the dimensions differ"),
        ("double[3]", serde_json::json!([1, 2]), "double[3] takes 3 values, not 2; give a list of 3"),
        ("double[3]", serde_json::json!(1), "double[3] takes a list of 3, not 1"),
        ("double[2]", serde_json::json!([1, "x"]), "element 1: 'x' is not a number"),
        ("struct { int x; int y; }", serde_json::json!({"x": 1}), "the member 'y' of struct { int32_t x; int32_t y; } is missing"),
        ("struct { int x; int y; }", serde_json::json!({"x": 1, "y": 2, "yy": 3}), "has no member 'yy'; did you mean 'y'?"),
        ("struct { int x; }", serde_json::json!({"x": 0.5}), "member 'x': int32_t takes a whole number, not 0.5"),
    ] {
        let refusal = read(text).encode(&value(json), "rad").expect_err(text);
        assert!(refusal.to_string().contains(why), "{text}: {refusal}");
    }
    assert_eq!(read("double").encode(&value("180 deg".into()), "rad").unwrap(), std::f64::consts::PI.to_le_bytes());
    assert_eq!(read("int64_t").encode(&value("20 ms".into()), "ns").unwrap(), 20_000_000_i64.to_le_bytes());
}

/// Generates random types, at most three levels deep.
fn any_type() -> impl Strategy<Value = Type> {
    let scalars = ["double", "float", "bool", "int8_t", "uint8_t", "int16_t", "uint16_t", "int32_t", "uint32_t", "int64_t", "uint64_t"];
    let scalar = prop::sample::select(scalars.to_vec()).prop_map(read);
    scalar.prop_recursive(3, 24, 4, |inner| {
        prop_oneof![
            (inner.clone(), 1_usize..4).prop_map(|(element, count)| Type::Array(Box::new(element), count)),
            prop::collection::vec(inner, 1..5).prop_map(|types| {
                let members = types.into_iter().enumerate();
                Type::Struct(members.map(|(at, member_type)| model::types::Member { name: format!("m{at}"), member_type }).collect())
            }),
        ]
    })
}

/// Returns a C declaration of `name`.
fn c_declaration(of: &Type, name: &str) -> String {
    match of {
        Type::Scalar(scalar) => format!("{} {name}", scalar.name()),
        Type::Array(element, count) => c_declaration(element, &format!("{name}[{count}]")),
        Type::Struct(members) => {
            let members: String = members.iter().map(|m| format!("{}; ", c_declaration(&m.member_type, &m.name))).collect();
            format!("struct {{ {members}}} {name}")
        }
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(of in any_type(), seed in any::<u64>()) {
        prop_assert_eq!(&read(&of.normalised()), &of);
        let mut bytes = Vec::new();
        let mut state = seed;
        for _ in 0..of.size() {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            bytes.push((state >> 57) as u8);
        }
        let decoded = of.decode(&bytes);
        let encoded = of.encode(&decoded, "").unwrap();
        prop_assert_eq!(of.decode(&encoded), decoded);
        prop_assert_eq!(encoded.len(), of.size());
        prop_assert_eq!(of.size() % of.align(), 0);
    }

    #[test]
    fn no_text_makes_the_reader_fail_badly(text in "[a-z_{}\\[\\];, 0-9*]{0,40}") {
        if let Ok(of) = Type::parse(&text, &Default::default()) {
            prop_assert!(of.size() > 0);
        }
    }
}

#[test]
fn the_c_compiler_lays_types_out_the_same() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut source = String::from("#include <stdint.h>\n#include <stdbool.h>\n#include <stddef.h>\n");
    for at in 0..200 {
        let of = any_type().new_tree(&mut runner).expect("the strategy rejects nothing").current();
        writeln!(source, "typedef {};", c_declaration(&of, &format!("t{at}"))).unwrap();
        writeln!(source, "_Static_assert(sizeof(t{at}) == {} && _Alignof(t{at}) == {}, \"t{at}\");", of.size(), of.align()).unwrap();
        if let Type::Struct(members) = &of {
            for (member, offset) in members.iter().zip(of.offsets()) {
                writeln!(source, "_Static_assert(offsetof(t{at}, {}) == {offset}, \"t{at}\");", member.name).unwrap();
            }
        }
    }
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("layout.c");
    std::fs::write(&file, source).unwrap();
    let output = std::process::Command::new("cc").args(["-std=c11", "-fsyntax-only"]).arg(&file).output().expect("there is a C compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
