// SPDX-License-Identifier: Apache-2.0
//! Blocks in Rust that exercise each word of the declaration.

use opengpac::trial::{Fault, Trial, TrialError};
use opengpac::{Condition, ConditionOf, FunctionBlock, InPlace, InPlaceMut, Invocation, Outcome, Step, Type};

/// First-order low-pass filter: y += alpha (u - y).
#[derive(FunctionBlock)]
pub struct Lowpass {
    /// raw signal
    #[input]
    u: f64,
    /// filtered signal
    #[output]
    y: f64,
    /// smoothing factor, 0 to 1
    #[param(default = 0.1)]
    alpha: f64,
}
impl Step for Lowpass {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y += self.alpha * (self.u - self.y);
        Outcome::Done
    }
}

/// Position of a body.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
struct Pose {
    p: [f64; 3],
    yaw: f32,
    valid: bool,
}

#[derive(Clone, Copy, Default)]
struct RunningTotal {
    total: f64,
    seen: [u8; 5],
}

/// Uses every word. The rest is silence.
#[derive(FunctionBlock)]
struct Everything {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// joint positions
    #[input(sized, unit = "rad")]
    q: [f64; 16],
    /// offset of all joints
    #[input(default = 0.5)]
    offset: f64,
    /// a flag
    #[input(asynchronous)]
    enable: bool,
    /// a slow input
    #[input(ratio = 4, unit = "m")]
    slow: f32,
    /// position of the body
    #[input(asynchronous, default = Pose { p: [1.0, 2.0, 3.0], yaw: 0.25, valid: true })]
    pose: Pose,
    /// shifted positions
    #[output(sized, unit = "rad")]
    shifted: [f64; 16],
    /// every third sum
    #[output(ratio = 3)]
    sum: f64,
    /// may be infinite
    #[output(nonfinite)]
    reciprocal: f64,
    /// the pose again
    #[output(asynchronous)]
    again: Pose,
    /// gains
    #[param(default = [1.0, 2.0, 3.0])]
    gains: [f64; 3],
    /// mode of the test
    #[param(default = 0)]
    mode: i32,
    /// invocations
    #[state(initial = 7, keep)]
    count: i64,
    /// opaque memory
    #[state(opaque)]
    memory: RunningTotal,
    /// encoder
    #[device(read, unit = "rad")]
    encoder: f64,
    /// motor
    #[device(write, unit = "N.m")]
    motor: f64,
    /// enough invocations
    #[condition]
    enough: Condition,
    /// sum above its limit
    #[condition(preset = 100.0)]
    above: ConditionOf<f64>,
}

impl Step for Everything {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        self.sum = self.q[..n].iter().sum();
        for i in 0..n {
            self.shifted[i] = self.q[i] + self.offset;
        }
        self.reciprocal = 1.0 / self.encoder;
        self.again = self.pose;
        self.again.yaw += self.slow;
        self.again.valid = self.enable;
        self.motor = self.gains[2] * self.encoder;
        self.count += 1;
        self.memory.total += self.sum;
        self.memory.seen[0] += 1;
        if invocation.number == 2 {
            self.enough.report();
        }
        if self.sum > self.above.preset {
            self.above.report(self.memory.total);
        }
        match self.mode {
            1 => Outcome::Fault(42),
            2 => panic!("this text must not appear"),
            3 => {
                self.again.p[1] = f64::NAN;
                Outcome::Done
            }
            _ => Outcome::Done,
        }
    }
}

fn everything() -> Trial {
    Trial::of(opengpac::read::BlockFace::of::<Everything>())
}

#[test]
fn the_lowpass_filters() {
    let mut trial = Trial::new(Lowpass::descriptor());
    trial.set_number("u", 1.0).unwrap();
    for _ in 0..3 {
        trial.run().unwrap();
    }
    assert_eq!(trial.number("y").unwrap(), 0.1 + 0.1 * (1.0 - 0.1) + 0.1 * (1.0 - (0.1 + 0.1 * (1.0 - 0.1))));
}

#[test]
fn a_bad_sample_does_not_poison_the_filter() {
    let mut trial = Trial::new(Lowpass::descriptor());
    trial.set_number("u", 1.0).unwrap();
    trial.run().unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        trial.set_number("u", bad).unwrap();
        assert_eq!(trial.run(), Err(Fault::NonFinite { item: "y".into() }));
        assert_eq!(trial.number("y").unwrap(), 0.1);
    }
    trial.set_number("u", 1.0).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.number("y").unwrap(), 0.1 + 0.1 * (1.0 - 0.1));
    assert_eq!(trial.next_number(), 5, "an invocation that faults has its number too");
}

#[test]
fn the_face_says_what_was_declared() {
    let trial = everything();
    let face = trial.face();
    assert_eq!((face.name.as_str(), face.doc.as_str()), ("everything", "Uses every word.\nThe rest is silence."));
    let texts: Vec<_> = face.items.iter().map(|item| (item.name.as_str(), item.type_text.as_str(), item.unit.as_str())).collect();
    assert_eq!(texts[1], ("q", "double[n]", "rad"));
    assert_eq!(texts[4], ("slow", "float", "m"));
    assert_eq!(texts[5], ("pose", "pose", ""));
    assert_eq!(texts[13], ("memory", "uint8_t[16]", ""));
    assert_eq!(texts[16], ("enough", "", ""));
    let (_, n) = face.item("n").unwrap();
    assert_eq!((n.limits, n.initial.as_slice()), (Some((1, 16)), 1u32.to_ne_bytes().as_slice()));
    let (_, q) = face.item("q").unwrap();
    assert_eq!((q.sized, q.element, q.size), (true, 8, 128));
    assert!(face.item("offset").unwrap().1.has_default && face.item("count").unwrap().1.keep && face.item("reciprocal").unwrap().1.nonfinite);
    let pose = opengpac::read::TypeFace::read(Everything::types()[0]).unwrap();
    assert_eq!(pose.declaration, "struct { double[3] p; float yaw; bool valid; }");
    assert_eq!((pose.size, pose.align), (32, 8));
}

#[test]
fn a_sized_block_touches_its_n_elements_only() {
    let mut trial = everything();
    trial.set_number("n", 2.0).unwrap();
    assert!(matches!(trial.set_number("n", 17.0), Err(TrialError::SizeOutOfRange { .. })));
    trial.set_numbers("q", &[1.0, 2.0]).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.numbers("shifted").unwrap(), [1.5, 2.5]);
    trial.set_number("n", 4.0).unwrap();
    assert_eq!(trial.numbers("shifted").unwrap(), [1.5, 2.5, 0.0, 0.0]);
}

#[test]
fn a_ratio_output_is_stored_on_every_nth_invocation() {
    let mut trial = everything();
    for (value, stored) in [(1.0, 0.0), (2.0, 0.0), (3.0, 3.0), (4.0, 3.0), (5.0, 3.0), (6.0, 6.0)] {
        trial.set_numbers("q", &[value]).unwrap();
        trial.run().unwrap();
        assert_eq!(trial.number("sum").unwrap(), stored);
    }
}

#[test]
fn conditions_are_reported_with_their_values() {
    let mut trial = everything();
    trial.set_numbers("q", &[60.0]).unwrap();
    trial.set_number("above", 50.0).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.reported(), ["above"]);
    assert_eq!(trial.number("above").unwrap(), 60.0);
    trial.run().unwrap();
    trial.run().unwrap();
    assert_eq!(trial.reported(), ["enough", "above"]);
    assert_eq!(trial.number("above").unwrap(), 180.0);
    trial.set_numbers("q", &[10.0]).unwrap();
    trial.run().unwrap();
    assert!(trial.reported().is_empty(), "a report leaves the preset alone");
}

#[test]
fn a_fault_of_any_kind_changes_nothing() {
    let mut trial = everything();
    trial.set_numbers("q", &[60.0]).unwrap();
    trial.set_number("encoder", 0.5).unwrap();
    trial.run().unwrap();
    let names = ["shifted", "sum", "reciprocal", "again", "count", "memory", "motor", "above"];
    let before: Vec<_> = names.iter().map(|name| trial.get(name).unwrap()).collect();
    trial.set_numbers("q", &[200.0]).unwrap();
    for (mode, fault) in [(1.0, Fault::Returned(42)), (2.0, Fault::Panicked), (3.0, Fault::NonFinite { item: "again".into() })] {
        trial.set_number("mode", mode).unwrap();
        assert_eq!(trial.run(), Err(fault));
        assert!(trial.reported().is_empty());
        assert_eq!(before, names.iter().map(|name| trial.get(name).unwrap()).collect::<Vec<_>>());
    }
    trial.set_number("mode", 0.0).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.number("count").unwrap(), 9.0);
    assert_eq!(trial.number("motor").unwrap(), 1.5);
    trial.set_number("encoder", 0.0).unwrap();
    trial.run().unwrap();
    assert_eq!(trial.number("reciprocal").unwrap(), f64::INFINITY);
}

#[test]
fn mistakes_in_a_trial_name_what_there_is() {
    let mut trial = Trial::new(Lowpass::descriptor());
    assert_eq!(trial.set_number("alfa", 1.0).unwrap_err().to_string(), "block 'lowpass' has no item 'alfa'; it has u, y, alpha");
    assert_eq!(trial.set_numbers("u", &[1.0, 2.0]).unwrap_err().to_string(), "item 'u' (double) takes 1 values, not 2");
    assert_eq!(trial.set_number("y", 1.0).unwrap_err(), TrialError::NotSettable { item: "y".into() });
}

/// Slope of the last values: y = (u[2] - u[0]) / 2.
#[derive(FunctionBlock)]
struct Slope {
    /// values, oldest first
    #[input(history, unit = "m")]
    u: [f64; 3],
    /// pairs
    #[input(history)]
    pairs: [[i32; 2]; 4],
    /// slope
    #[output]
    y: f64,
    /// the oldest pair
    #[output]
    oldest: [i32; 2],
}
impl Step for Slope {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = (self.u[2] - self.u[0]) / 2.0;
        self.oldest = self.pairs[0];
        Outcome::Done
    }
}

#[test]
fn a_history_holds_the_last_values() {
    let mut trial = Trial::new(Slope::descriptor());
    let face = |name| trial.face().item(name).unwrap().1.clone();
    let (u, pairs) = (face("u"), face("pairs"));
    assert_eq!((u.history, u.type_text.as_str(), u.element, u.size), (3, "double", 8, 24));
    assert_eq!((pairs.history, pairs.type_text.as_str(), pairs.element, pairs.size), (4, "int32_t[2]", 8, 32));
    for (u, y) in [(5.0, 0.0), (6.0, 0.5), (8.0, 1.5), (8.0, 1.0)] {
        trial.set_number("u", u).unwrap();
        trial.set_numbers("pairs", &[u, -u]).unwrap();
        trial.run().unwrap();
        assert_eq!(trial.number("y").unwrap(), y);
    }
    assert_eq!(trial.numbers("oldest").unwrap(), [5.0, -5.0]);
}

/// Running sums where they lie: sums[k] = values[0] + … + values[k].
#[derive(FunctionBlock)]
struct Sums {
    /// numbers
    #[input(asynchronous, in_place)]
    values: InPlace<[f64; 5000]>,
    /// their sums
    #[output(in_place)]
    sums: InPlaceMut<[f64; 5000]>,
    /// number of values to add, a fault where there are fewer
    #[param(default = 5000)]
    count: u32,
}

impl Step for Sums {
    fn step(&mut self, _: &Invocation) -> Outcome {
        let mut sum = 0.0;
        for k in 0..self.count as usize {
            let Some(value) = self.values.get(k) else { return Outcome::Fault(1) };
            sum += value;
            self.sums[k] = sum;
        }
        Outcome::Done
    }
}

#[test]
fn a_port_in_place_is_not_copied_and_what_is_written_stays() {
    let mut trial = Trial::new(Sums::descriptor());
    let instance = trial.face().instance_size;
    assert!(instance < 200, "the instance has no copy of the tables: {instance} bytes");
    trial.set_numbers("values", &[1.0; 5000]).expect("an input");
    trial.run().expect("no fault");
    assert_eq!(trial.numbers("sums").expect("numbers")[4999], 5000.0);
    trial.set_numbers("values", &[2.0; 5000]).expect("an input");
    trial.set("count", &5001u32.to_ne_bytes()).expect("a parameter");
    assert_eq!(trial.run(), Err(Fault::Returned(1)));
    assert_eq!(trial.numbers("sums").expect("numbers")[4999], 10_000.0, "an invocation that faults takes nothing back there");
    assert!(matches!(trial.set_numbers("sums", &[0.0; 5000]), Err(TrialError::NotSettable { .. })));
}

/// Value with padding after its last member.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
struct PaddedValue {
    number: f64,
    flag: bool,
}

/// Value with padding of its own, and in its members.
#[derive(Clone, Copy, Debug, PartialEq, Type)]
#[repr(C)]
struct NestedValue {
    first: u8,
    inner: [PaddedValue; 2],
    last: u16,
}

/// Stores values whose padding is not zero before they are stored.
#[derive(FunctionBlock)]
struct Padding {
    /// number of elements
    #[size(1, 3)]
    n: u32,
    /// one value
    #[output]
    one: NestedValue,
    /// several values
    #[output(sized)]
    several: [PaddedValue; 3],
}

impl Step for Padding {
    fn step(&mut self, _: &Invocation) -> Outcome {
        // SAFETY: a byte of 1 is valid in each member.
        unsafe {
            (&raw mut self.one).write_bytes(1, 1);
            (&raw mut self.several).write_bytes(1, 1);
        }
        Outcome::Done
    }
}

#[test]
fn the_padding_of_stored_values_is_zero() {
    let mut trial = Trial::of(opengpac::read::BlockFace::of::<Padding>());
    trial.set("n", &2u32.to_ne_bytes()).expect("a size");
    trial.run().expect("no fault");
    let padded = [[1_u8; 9].to_vec(), vec![0; 7]].concat();
    let nested = [vec![1], vec![0; 7], padded.repeat(2), vec![1, 1], vec![0; 6]].concat();
    assert_eq!(trial.get("one").expect("an output"), nested);
    assert_eq!(trial.get("several").expect("an output"), padded.repeat(2));
}
