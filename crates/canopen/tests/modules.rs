// SPDX-License-Identifier: Apache-2.0
//! I/O modules by CiA 401, and electronic data sheets.
mod common;
use canopen::emulator::{Bus, NodeOptions, Terminals};
use common::{COUNTS, OPERATION_ENABLED, Rig, X};
use device::Direction;
use serde_json::{Value, json};
use std::path::PathBuf;

const IO: u8 = 7;

fn bus() -> Bus {
    bus_with(false)
}

fn bus_with(short_error_values: bool) -> Bus {
    let all = Terminals { inputs: 16, outputs: 12, analog_inputs: 6, analog_outputs: 5, short_error_values };
    let module = NodeOptions { name: "terminals".into(), node: IO, module: Some(all), ..NodeOptions::default() };
    Bus::new(&[NodeOptions { name: "drive".into(), node: X, ..NodeOptions::default() }, module])
}

fn rig() -> Rig {
    rig_on(bus())
}

fn rig_on(bus: Bus) -> Rig {
    let channels = json!({
        "door": { "input": 0 }, "start": { "input": 11 },
        "lamp": { "output": 3 }, "vent": { "output": 9, "safe": true },
        "pressure": { "analog_input": 5, "scale": 0.01, "offset": -1.0, "unit": "bar" },
        "valve": { "analog_output": 4, "scale": 0.5, "unit": "V", "safe": 2.0 },
    });
    let axes = json!([{ "name": "x", "node": X, "counts": COUNTS }]);
    Rig::on(bus, axes, json!({ "modules": [{ "name": "io", "node": IO, "channels": channels }] }))
}

/// Exchanges with these outputs of the module.
fn switch(rig: &mut Rig, lamp: bool, vent: bool, valve: f64) {
    let mut commands = vec![0; 64];
    for channel in rig.driver.channels().iter().filter(|channel| channel.direction == Direction::Write) {
        let bytes = match channel.name.as_str() {
            "io.lamp" => vec![lamp.into()],
            "io.vent" => vec![vent.into()],
            "io.valve" => valve.to_ne_bytes().to_vec(),
            _ => channel.safe.clone(),
        };
        commands[channel.offset..channel.offset + channel.len].copy_from_slice(&bytes);
    }
    rig.raw(&commands, &[false, true, true, true]).unwrap();
}

fn outputs(rig: &Rig) -> (Option<i64>, Option<i64>, Option<i64>) {
    rig.bus.with(|bus| (bus.terminal(IO, "output", 3), bus.terminal(IO, "output", 9), bus.terminal(IO, "analog_output", 4)))
}

#[test]
fn terminals_are_channels_with_units() {
    let mut rig = rig();
    assert_eq!(outputs(&rig), (Some(0), Some(1), Some(4)), "safe from the first exchange on");
    rig.bus.with(|bus| {
        bus.put(IO, "input", 11, 1);
        bus.put(IO, "analog_input", 5, -250);
    });
    switch(&mut rig, true, false, 5.0);
    switch(&mut rig, true, false, 5.0);
    assert_eq!((rig.byte("io.door"), rig.byte("io.start"), rig.double("io.pressure")), (0, 1, -3.5));
    assert_eq!(outputs(&rig), (Some(1), Some(0), Some(10)));
    switch(&mut rig, true, false, 1e9);
    assert_eq!(outputs(&rig).2, Some(i64::from(i16::MAX)), "no further than it has counts");
    switch(&mut rig, true, false, f64::NAN);
    assert_eq!(outputs(&rig).2, Some(4), "what is no number is the safe value");
    let pressure = rig.driver.channels().iter().find(|channel| channel.name == "io.pressure").unwrap();
    assert_eq!((pressure.unit.as_str(), pressure.doc.as_str()), ("bar", "analog input 5"));
}

#[test]
fn outputs_are_safe_by_the_driver_by_the_guard_and_by_the_module() {
    let mut rig = rig();
    let safe = (Some(0), Some(1), Some(4));
    switch(&mut rig, true, false, 5.0);
    rig.driver.safe_state();
    assert_eq!(outputs(&rig), safe, "by the driver");
    switch(&mut rig, true, false, 5.0);
    let handle = rig.driver.safe_handles().remove(0);
    let socket = std::os::unix::net::UnixDatagram::from(handle.descriptor);
    for (_, frame) in &handle.writes {
        socket.send(frame).unwrap();
    }
    rig.now_ns += 1;
    rig.driver.read(rig.now_ns, &mut rig.readings).unwrap();
    assert_eq!(outputs(&rig), safe, "by the guard");
    switch(&mut rig, true, false, 5.0);
    rig.now_ns += 150_000_000;
    let lost = rig.exchange(&[]).unwrap_err().message;
    assert!(lost.starts_with("its nodes stopped by themselves"), "{lost}");
    assert_eq!((outputs(&rig), rig.bus.with(|bus| bus.state(IO))), (safe, "stopped".to_owned()), "by the module");
}

#[test]
fn error_values_of_16_bits_are_told_too() {
    let mut rig = rig_on(bus_with(true));
    switch(&mut rig, true, false, 5.0);
    rig.now_ns += 150_000_000;
    rig.exchange(&[]).unwrap_err();
    assert_eq!(outputs(&rig), (Some(0), Some(1), Some(4)), "by the module");
}

#[test]
fn a_module_that_is_gone_is_named_and_its_emergencies_are_a_channel() {
    let mut rig = rig();
    rig.exchange(&[]).unwrap();
    rig.bus.with(|bus| bus.fail(IO, 0x5030));
    rig.exchange(&[]).unwrap();
    rig.exchange(&[]).unwrap();
    assert_eq!(rig.word("io.error"), 0x5030, "no axis is lost for it");
    let asked = |service: &str| rig.call(service, json!({ "axis": "io" })).unwrap_err();
    assert_eq!(asked("home"), "'io' is a module: it has no axis");
    assert_eq!(rig.call("read_object", json!({ "axis": "io", "index": 0x6000 })).unwrap()["number"], 2);
    rig.bus.with(|bus| bus.power(IO, false));
    assert_eq!(rig.lost(&[]).1, "node 7 (module 'io') sent no process data for 3 cycles: its cable is unplugged, or it has no power");
    rig.bus.with(|bus| bus.power(IO, true));
    rig.reset();
    assert_eq!(outputs(&rig), (Some(0), Some(1), Some(4)));
}

#[test]
fn a_scan_says_what_is_a_module() {
    let rig = rig();
    let found = device::scan("canopen", &json!({ "interface": rig.interface })).unwrap();
    assert!(found[1].what.starts_with("node 7: 'terminals', profile 401"), "{}", found[1].what);
    assert_eq!(found[1].options["modules"][0]["node"], IO);
}

fn refused(module: Value) -> String {
    let mut of = json!({ "name": "io", "node": IO, "channels": {} });
    of.as_object_mut().unwrap().extend(module.as_object().unwrap().clone());
    common::opened("emulated", &json!([]), &json!({ "modules": [of] })).err().expect("refused")
}

#[test]
fn wrong_terminals_are_refused_with_what_they_can_be() {
    assert!(refused(json!({ "channels": { "a": {} } })).contains("channel 'a' must be one of input, output, analog_input and analog_output"));
    assert!(refused(json!({ "channels": { "a": { "input": 64 } } })).contains("channels.a.input': it cannot be 64: its range is 0 to 63"));
    assert!(refused(json!({ "channels": { "a": { "analog_input": 12 } } })).contains("its range is 0 to 11"));
    assert!(refused(json!({ "channels": { "a": { "input": 1 }, "b": { "input": 1 } } })).contains("'a' and 'b' are both digital input 1"));
    assert!(refused(json!({ "channels": { "a": { "output": 1, "scale": 2.0 } } })).contains("it cannot have a scale, offset or unit"));
    assert!(refused(json!({ "channels": { "a": { "output": 1, "safe": 1.5 } } })).contains("give true or false for an output of one bit"));
    assert!(refused(json!({ "channels": { "a": { "input": 1, "safe": true } } })).contains("it cannot have a safe value"));
    assert!(refused(json!({ "channels": { "a": { "analog_input": 1, "scale": 0.0 } } })).contains("counts × scale + offset"));
    assert!(refused(json!({ "node": 127 })).contains("127 is the number of this controller"));
    let rig = rig();
    let channels = json!({ "far": { "analog_input": 6 } });
    let far = common::opened(&rig.interface, &json!([]), &json!({ "modules": [{ "name": "io", "node": IO, "channels": channels }] })).err().unwrap();
    assert_eq!(far, "node 7 (module 'io') has 6 analog inputs (object 0x6401:0), but a channel needs number 7");
    let drive = common::opened(&rig.interface, &json!([]), &json!({ "modules": [{ "name": "io", "node": X, "channels": {} }] })).err().unwrap();
    assert_eq!(drive, "node 5 (module 'io') is not a CiA 401 module: its profile is 402");
}

/// Writes the data sheet of a drive with this product number and mappability of its torque.
fn data_sheet(name: &str, product: u32, is_torque_mappable: bool) -> PathBuf {
    let mut text = format!("[DeviceInfo]\nVendorNumber=0x6A1C\nProductNumber={product}\n");
    for (index, kind, mappable, of) in [
        ("6040", 6, true, "Controlword"),
        ("6041", 6, true, "Statusword"),
        ("6060", 2, true, "Modes of operation"),
        ("6061", 2, true, "Modes of operation display"),
        ("6064", 4, true, "Position actual value"),
        ("6065", 7, false, "Following error window"),
        ("606C", 4, true, "Velocity actual value"),
        ("6077", 3, is_torque_mappable, "Torque actual value"),
        ("607A", 4, true, "Target position"),
    ] {
        text += &format!("[{index}]\nParameterName={of}\nDataType={kind}\nPDOMapping={}\n", u8::from(mappable));
    }
    let path = std::env::temp_dir().join(format!("opengpac-{}-{name}.eds", std::process::id()));
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn objects_are_found_by_the_names_of_an_eds_file() {
    let path = data_sheet("names", 0x402, false);
    let axes = json!([{ "name": "x", "node": X, "counts": -COUNTS, "eds": path }]);
    let mut rig = Rig::on(bus(), axes, json!({}));
    rig.until(&[Some(3.0)], "there", |rig| rig.double("x.position") == 3.0);
    let read = |rig: &Rig, object: &str| rig.call("read_object", json!({ "axis": "x", "object": object }));
    assert_eq!(read(&rig, "position actual value").unwrap()["number"], -3000, "a signed number");
    rig.call("write_object", json!({ "axis": "x", "object": "Following error window", "value": 777 })).unwrap();
    assert_eq!(read(&rig, "Following error window").unwrap()["number"], 777);
    assert_eq!(
        read(&rig, "Position of the moon").unwrap_err(),
        "its EDS file contains no object 'Position of the moon'; there are 'Position actual value', 'Target position'"
    );
    assert_eq!(rig.bus.with(|bus| bus.number(X, 0x1A00, 0)), 2, "the torque is not mapped: the file says that it cannot be");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn another_product_than_that_of_the_file_is_refused() {
    let path = data_sheet("product", 0x403, true);
    let axes = json!([{ "name": "x", "node": X, "counts": COUNTS, "eds": path }]);
    let error = common::opened("emulated", &axes, &json!({})).err().unwrap();
    assert_eq!(error, "node 5 (axis 'x') does not match its EDS file: its product is 0x00000402, but that of the file is 0x00000403");
    std::fs::write(&path, "nothing").unwrap();
    let error = common::opened("emulated", &axes, &json!({})).err().unwrap();
    assert!(error.contains("option 'eds'") && error.contains("line 1 is neither a section nor a value"), "{error}");
    std::fs::remove_file(path).unwrap();
    let error = common::opened("emulated", &axes, &json!({})).err().unwrap();
    assert!(error.contains("option 'eds'") && error.contains("No such file"), "{error}");
}

#[test]
fn a_drive_may_keep_its_own_mapping() {
    let axes = |pdos: &str| json!([{ "name": "x", "node": X, "counts": COUNTS, "pdos": pdos }]);
    let mut rig = Rig::on(bus(), axes("written"), json!({}));
    rig.exchange(&[]).unwrap();
    rig.driver.close();
    // The drive has the PDOs that the first driver wrote.
    let mut driver = common::opened(&rig.interface, &axes("device"), &json!({})).unwrap();
    std::mem::swap(&mut driver, &mut rig.driver);
    rig.until(&[Some(1.0)], "there", |rig| rig.double("x.position") == 1.0 && rig.status("x") == OPERATION_ENABLED);
    rig.bus.with(|bus| (bus.power(X, false), bus.power(X, true)));
    let error = common::opened(&rig.interface, &axes("device"), &json!({})).err().unwrap();
    assert_eq!(error, "node 5 (axis 'x') does not exchange object 0x6040; let the driver write the PDOs: \"pdos\": \"written\"");
    let error = common::opened("emulated", &json!([{ "name": "x", "node": X, "counts": 1, "sped_max": 1 }]), &json!({})).err().unwrap();
    assert!(error.contains("'x': there is no sped_max; an axis has name, counts, mode"), "{error}");
}
