// SPDX-License-Identifier: Apache-2.0
//! Exercises every word of a declaration, in C and in C++.

mod common;
use common::{examples, folder, module, options, write};
use modules::{BuildOptions, LoadedModule, build, load};
use opengpac::read::{Kind, Mode};
use opengpac::trial::{Fault, Trial};

const EVERYTHING: &str = r#"#include <opengpac.h>
TYPE(pose, "Where a body is.", field(double[3], p), field(float, yaw), field(bool, valid));
TYPE(two, "Two of them.", field(pose[2], both), field(int32_t, k));
FUNCTION_BLOCK(everything, "Uses every word.",
    size(n, 1, 16),
    in(double[n], q, "joint positions", "rad"),
    in_default(double, offset, 0.5, "offset"),
    in_async(bool, enable, "a flag"),
    in_ratio(float, slow, 4, "a slow input", "m"),
    in_async_default(pose, where, (1, 2, 3, 0.25f, true), "where it is"),
    in_history(double[2], before, 3, "the last three pairs", "V"),
    out(double[n], shifted, "shifted positions", "rad"),
    out_ratio(double, sum, 3, "every third sum"),
    out_nonfinite(double, reciprocal, "may be infinite"),
    out_async(two, again, "the pose twice"),
    param(double[3], gains, (1, 2, 3), "gains"),
    param(int32_t, mode, (0 + 1) * 0, "mode of the test"),
    state(double[4], memory, 0, "memory"),
    state_keep(int64_t, count, 7, "invocations"),
    device(double, encoder, read, "encoder", "rad"),
    device(double, motor, write, "motor", "N.m"),
    condition(enough, "enough invocations"),
    condition_of(double, above, "sum above its limit"),
    condition_of_default(int32_t, many, 5, "count above its limit"))
{
    self->sum = 0;
    for (uint32_t i = 0; i < n; i++) self->sum += self->q[i];
    for (uint32_t i = 0; i < self->n; i++) self->shifted[i] = self->q[i] + self->offset;
    self->reciprocal = 1.0 / self->encoder;
    self->again.both[0] = self->again.both[1] = self->where;
    self->again.both[1].valid = self->enable;
    self->again.both[1].yaw += self->slow;
    self->motor = self->gains[2] * self->encoder;
    self->count++;
    self->memory[1] = self->before[0][1] + 10 * self->before[1][1] + 100 * self->before[2][1];
    self->memory[0] += self->sum;
    self->memory[3] = (double)invocation->time_ns;
    if (invocation->number == 2) report(enough);
    if (self->sum > self->above) report_value(above, self->memory[0]);
    if (self->mode == 4) report_value(many, (int32_t)self->count);
    if (self->mode == 1) return FAULT(42);
    if (self->mode == 3) self->again.both[1].p[2] = 1e300 * 1e300;
    return OK;
}
FUNCTION_BLOCK(second, "y = u.", in(uint8_t, u, "in"), out(uint8_t, y, "out")) { self->y = self->u; return OK; }
"#;

fn each(test: &str, check: impl Fn(&LoadedModule)) {
    for name in ["everything.c", "everything.cpp"] {
        check(&module(&format!("words-{test}-{name}"), name, EVERYTHING));
    }
}

fn trial(module: &LoadedModule) -> Trial {
    let mut trial = Trial::of(module.block("everything").unwrap().clone());
    trial.set_number("above", 100.0).unwrap();
    trial
}

#[test]
fn the_interface_is_read_back() {
    each("face", |module| {
        assert_eq!(module.name, "everything");
        let names: Vec<_> = module.blocks.iter().map(|block| block.name.as_str()).collect();
        assert_eq!(names, ["everything", "second"]);
        let block = module.block("everything").unwrap();
        assert_eq!((block.doc.as_str(), block.line), ("Uses every word.", 4));
        let item = |name| block.item(name).unwrap().1;
        let port = |name| (item(name).kind, item(name).mode, item(name).type_text.as_str(), item(name).unit.as_str());
        assert_eq!(port("q"), (Kind::Input, Mode::Synchronous, "double[n]", "rad"));
        assert_eq!(port("enable"), (Kind::Input, Mode::Asynchronous, "bool", ""));
        assert_eq!(port("slow"), (Kind::Input, Mode::Ratio(4), "float", "m"));
        assert_eq!(port("where"), (Kind::Input, Mode::Asynchronous, "pose", ""));
        assert_eq!(port("before"), (Kind::Input, Mode::Asynchronous, "double[2]", "V"));
        assert_eq!((item("before").history, item("before").element, item("before").size), (3, 16, 48));
        assert_eq!(port("sum"), (Kind::Output, Mode::Ratio(3), "double", ""));
        assert_eq!(port("motor"), (Kind::DeviceWrite, Mode::Synchronous, "double", "N.m"));
        assert_eq!(port("enough"), (Kind::Condition, Mode::Synchronous, "", ""));
        assert_eq!((item("n").limits, item("q").sized, item("q").element, item("q").size), (Some((1, 16)), true, 8, 128));
        assert!(item("offset").has_default && item("where").has_default && !item("q").has_default && item("count").keep && item("reciprocal").nonfinite);
        assert_eq!(item("gains").initial, [1.0f64, 2.0, 3.0].map(f64::to_ne_bytes).concat());
        assert_eq!(item("many").initial, 5i32.to_ne_bytes());
        let types: Vec<_> = module.types.iter().map(|ty| (ty.name.as_str(), ty.declaration.as_str(), ty.size)).collect();
        assert_eq!(types, [("pose", "struct { double[3] p; float yaw; bool valid; }", 32), ("two", "struct { pose[2] both; int32_t k; }", 72)]);
    });
}

#[test]
fn sized_ratio_and_default_items() {
    each("ports", |module| {
        let mut trial = trial(module);
        trial.set_number("n", 2.0).unwrap();
        for (q, sum) in [(1.0, 0.0), (2.0, 0.0), (3.0, 5.0), (4.0, 5.0)] {
            trial.set_numbers("q", &[q, 2.0]).unwrap();
            trial.run().unwrap();
            assert_eq!(trial.numbers("shifted").unwrap(), [q + 0.5, 2.5]);
            assert_eq!(trial.number("sum").unwrap(), sum);
        }
        trial.set_number("n", 3.0).unwrap();
        assert_eq!(trial.numbers("shifted").unwrap(), [4.5, 2.5, 0.0], "elements beyond n are never touched");
        assert_eq!(trial.numbers("memory").unwrap()[3], 3e6, "running time of the fourth invocation");
        assert_eq!(trial.number("reciprocal").unwrap(), f64::INFINITY);
    });
}

#[test]
fn a_history_is_oldest_first_and_begins_with_its_first_value() {
    each("history", |module| {
        let mut trial = trial(module);
        for (value, seen) in [(1.0, 111.0), (2.0, 211.0), (3.0, 321.0), (4.0, 432.0)] {
            trial.set_numbers("before", &[0.0, value]).unwrap();
            trial.run().unwrap();
            assert_eq!(trial.numbers("memory").unwrap()[1], seen);
        }
        trial.set_numbers("before", &[0.0, 7.0, 0.0, 8.0, 0.0, 9.0]).unwrap();
        trial.run().unwrap();
        assert_eq!(trial.numbers("memory").unwrap()[1], 987.0);
    });
}

#[test]
fn conditions_and_their_values() {
    each("conditions", |module| {
        let mut trial = trial(module);
        trial.set_numbers("q", &[60.0]).unwrap();
        trial.run().unwrap();
        assert!(trial.reported().is_empty());
        trial.set_number("above", 50.0).unwrap();
        trial.run().unwrap();
        assert_eq!((trial.reported(), trial.number("above").unwrap()), (vec!["above".to_string()], 120.0));
        trial.set_number("mode", 4.0).unwrap();
        trial.run().unwrap();
        assert_eq!(trial.reported(), ["enough", "above", "many"]);
        assert_eq!((trial.number("above").unwrap(), trial.number("many").unwrap()), (180.0, 10.0));
        trial.set_numbers("q", &[50.0]).unwrap();
        trial.set_number("mode", 0.0).unwrap();
        trial.run().unwrap();
        assert!(trial.reported().is_empty(), "the presets are as they were");
    });
}

#[test]
fn a_fault_changes_nothing() {
    each("faults", |module| {
        let mut trial = trial(module);
        trial.set_number("encoder", 0.5).unwrap();
        trial.set_numbers("q", &[60.0]).unwrap();
        trial.run().unwrap();
        let names = ["shifted", "sum", "reciprocal", "again", "count", "memory", "motor", "above"];
        let before: Vec<_> = names.iter().map(|name| trial.get(name).unwrap()).collect();
        trial.set_numbers("q", &[200.0]).unwrap();
        for (mode, encoder, fault) in
            [(1.0, 0.5, Fault::Returned(42)), (3.0, 0.5, Fault::NonFinite { item: "again".into() }), (0.0, f64::NAN, Fault::NonFinite { item: "motor".into() })]
        {
            trial.set_number("mode", mode).unwrap();
            trial.set_number("encoder", encoder).unwrap();
            assert_eq!(trial.run(), Err(fault));
            assert!(trial.reported().is_empty());
            assert_eq!(before, names.iter().map(|name| trial.get(name).unwrap()).collect::<Vec<_>>());
        }
        trial.set_number("encoder", 0.5).unwrap();
        trial.run().unwrap();
        assert_eq!((trial.number("count").unwrap(), trial.number("motor").unwrap(), trial.next_number()), (9.0, 1.5, 5));
    });
}

#[test]
fn the_guard_of_the_examples() {
    let module = load(&examples().join("blocks/force_guard.c"), &options()).unwrap();
    let mut trial = Trial::of(module.blocks[0].clone());
    trial.set_number("n", 2.0).unwrap();
    trial.set_numbers("effort", &[30.0, 40.0]).unwrap();
    trial.set_number("exceeded", 49.0).unwrap();
    let reports: Vec<usize> = (0..4)
        .map(|_| {
            trial.run().unwrap();
            trial.reported().len()
        })
        .collect();
    assert_eq!(reports, [0, 0, 1, 1]);
    assert_eq!(trial.number("exceeded").unwrap(), 50.0);
}

#[test]
fn several_files_make_one_module() {
    let folder = folder("words-several");
    let one = write(
        &folder,
        "one.c",
        "#include <opengpac.h>\ndouble half(double x);\nFUNCTION_BLOCK(one, \"y = u / 2.\", in(double, u, \"in\"), out(double, y, \"out\")) { self->y = half(self->u); return OK; }\n",
    );
    let two = write(
        &folder,
        "two.cpp",
        "#include <opengpac.h>\nextern \"C\" double half(double x) { return x / 2; }\nFUNCTION_BLOCK(two, \"y = 2 u.\", in(float, u, \"in\"), out(float, y, \"out\")) { self->y = 2 * self->u; return OK; }\n",
    );
    let path = build(&[one, two], &BuildOptions { output: Some(folder.join("both.so")), ..BuildOptions::default() }).unwrap();
    let module = load(&path, &options()).unwrap();
    let names: Vec<_> = module.blocks.iter().map(|block| block.name.as_str()).collect();
    assert_eq!((module.name.as_str(), names), ("both", vec!["one", "two"]));
    let mut trial = Trial::of(module.blocks[0].clone());
    trial.set_number("u", 3.0).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.number("y").unwrap(), 1.5);
}

#[test]
fn a_block_compiles_without_a_warning() {
    let folder = folder("words-warnings");
    modules::write_header(&folder).unwrap();
    for (name, cxx, standard) in [("everything.c", false, "-std=c11"), ("everything.cpp", true, "-std=c++17")] {
        let source = write(&folder, name, EVERYTHING);
        let compiler = modules::compiler(cxx, None).unwrap();
        for level in ["-O0", "-O2"] {
            let output = std::process::Command::new(&compiler[0])
                .args(&compiler[1..])
                .args([standard, level, "-Wall", "-Wextra", "-Werror", "-fPIC", "-c", "-o", "/dev/null", "-I"])
                .arg(&folder)
                .arg(&source)
                .output()
                .unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
    }
}
