// SPDX-License-Identifier: Apache-2.0
//! Checks that `opengpac.h` and `abi.rs` describe the same bytes.

use opengpac::abi::{Descriptor, Header, Invocation, Item, Module, TypeDescriptor, flag, kind, mode, outcome};
use std::fmt::Write;
use std::mem::offset_of;
use std::path::Path;
use std::process::Command;

macro_rules! layout {
    ($($rust:ident as $c:literal { $($member:ident),* })*) => {
        [$((
            $c,
            vec![$((stringify!($member), offset_of!($rust, $member))),*],
            size_of::<$rust>(),
        )),*]
    };
}

#[test]
fn every_offset_is_the_same() {
    let structs = layout! {
        Invocation as "Invocation" { number, time_ns, now_ns }
        Header as "opengpac_header" { number, activated }
        Item as "opengpac_item" { kind, mode, flags, ratio, name, type_text, unit, doc, offset, size, address, report, element, reserved }
        Descriptor as "opengpac_descriptor" { abi, item_count, name, doc, items, image, instance_size, instance_align, run, file, line, reserved }
        TypeDescriptor as "opengpac_type_descriptor" { name, declaration, doc, size, align }
        Module as "opengpac_module_table" { abi, block_count, blocks, type_count, reserved, types, target, compiler }
    };
    let constants = [
        ("OPENGPAC_ABI", u64::from(opengpac::abi::ABI)),
        ("OG_DONE", outcome::DONE),
        ("OG_FAULT", outcome::FAULT),
        ("OG_NONFINITE", outcome::NONFINITE),
        ("OG_NONE", u64::from(opengpac::abi::NONE)),
        ("OG_INPUT", u64::from(kind::INPUT)),
        ("OG_OUTPUT", u64::from(kind::OUTPUT)),
        ("OG_DEVICE_READ", u64::from(kind::DEVICE_READ)),
        ("OG_DEVICE_WRITE", u64::from(kind::DEVICE_WRITE)),
        ("OG_CONDITION", u64::from(kind::CONDITION)),
        ("OG_PARAMETER", u64::from(kind::PARAMETER)),
        ("OG_STATE", u64::from(kind::STATE)),
        ("OG_SIZE", u64::from(kind::SIZE)),
        ("OG_SYNCHRONOUS", u64::from(mode::SYNCHRONOUS)),
        ("OG_RATIO", u64::from(mode::RATIO)),
        ("OG_ASYNCHRONOUS", u64::from(mode::ASYNCHRONOUS)),
        ("OG_DEFAULT", u64::from(flag::DEFAULT)),
        ("OG_MAY_BE_NONFINITE", u64::from(flag::NONFINITE)),
        ("OG_KEEP", u64::from(flag::KEEP)),
        ("OG_SIZED", u64::from(flag::SIZED)),
        ("OG_HISTORY", u64::from(flag::HISTORY)),
    ];
    let mut program = String::from("#include <opengpac.h>\n#include <stdio.h>\nint main(void) {\n");
    let mut expected = String::new();
    for (name, members, size) in structs {
        for (member, offset) in members {
            writeln!(program, "printf(\"{name}.{member} %zu\\n\", offsetof({name}, {member}));").unwrap();
            writeln!(expected, "{name}.{member} {offset}").unwrap();
        }
        writeln!(program, "printf(\"{name} %zu\\n\", sizeof({name}));").unwrap();
        writeln!(expected, "{name} {size}").unwrap();
    }
    for (name, value) in constants {
        writeln!(program, "printf(\"{name} %llu\\n\", (unsigned long long){name});").unwrap();
        writeln!(expected, "{name} {value}").unwrap();
    }
    program.push_str("return 0; }\n");
    for (compiler, ending, standard) in [("cc", "c", "-std=c11"), ("c++", "cpp", "-std=c++17")] {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let (source, binary) = (folder.join(format!("layout.{ending}")), folder.join(format!("layout-{ending}")));
        std::fs::write(&source, &program).unwrap();
        let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
        let output =
            Command::new(compiler).args([standard, "-Wall", "-Wextra", "-Werror", "-I"]).arg(&header).arg(&source).arg("-o").arg(&binary).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let printed = String::from_utf8(Command::new(&binary).output().unwrap().stdout).unwrap();
        assert_eq!(printed, expected, "{compiler}");
    }
}
