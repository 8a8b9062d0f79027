// SPDX-License-Identifier: Apache-2.0
//! I/O terminals on an emulated segment: a coupler, digital and analog ones, and a drive behind them.
mod common;
use common::{COUNTS, Rig, drive};
use device::{DeviceError, Direction};
use ethercat::emulator::{DriveOptions, TerminalOptions};
use serde_json::{Value, json};

const INPUTS: usize = 1;
const OUTPUTS: usize = 2;
const ANALOG: usize = 3;

fn terminal(name: &str, of: TerminalOptions) -> DriveOptions {
    DriveOptions { terminal: Some(of), ..drive(name, 0) }
}

fn line() -> Vec<DriveOptions> {
    let none = TerminalOptions::default;
    vec![
        terminal("coupler", none()),
        terminal("inputs", TerminalOptions { digital_inputs: 8, ..none() }),
        terminal("outputs", TerminalOptions { digital_outputs: 16, ..none() }),
        terminal("analog", TerminalOptions { analog_inputs: 2, analog_outputs: 1, ..none() }),
        drive("drive", 1000),
    ]
}

fn options() -> Value {
    json!({
        "axes": [{ "name": "x", "at": 4, "counts": COUNTS, "speed_max": 10 }],
        "terminals": [
            { "name": "in", "at": INPUTS },
            { "name": "out", "at": OUTPUTS, "channels": {
                "lamp": { "entry": "Channel 2" },
                "valve": { "entry": "0x70f0:1", "safe": true },
            } },
            { "name": "analog", "at": ANALOG, "channels": {
                "force": { "entry": "AI Standard Channel 2.Value", "scale": 0.01, "offset": -5, "unit": "N" },
                "counts": { "entry": "ai_standard_channel_1_value" },
                "heater": { "entry": "AO Output Channel 1", "scale": 10.0 / 32767.0, "unit": "V", "safe": -1 },
            } },
        ],
    })
}

/// Exchanges twice, since readings are one frame behind, with these outputs commanded and the others at their safe values.
fn exchange(rig: &mut Rig, commanded: &[(&str, &[u8])]) -> Result<(), DeviceError> {
    let mut commands = vec![0; 256];
    let mut engaged = Vec::new();
    for channel in rig.driver.channels().iter().filter(|of| of.direction == Direction::Write) {
        let given = commanded.iter().find(|(name, _)| *name == channel.name);
        commands[channel.offset..channel.offset + channel.len].copy_from_slice(given.map_or(&channel.safe[..], |(_, bytes)| bytes));
        engaged.push(given.is_some());
    }
    rig.exchange_raw(&commands, &engaged)?;
    rig.exchange_raw(&commands, &engaged)
}

/// Exchanges until the device is lost; returns why.
fn lost(rig: &mut Rig) -> String {
    (0..5).find_map(|_| exchange(rig, &[]).err()).expect("lost").message
}

#[test]
fn its_entries_are_channels_by_their_names_in_the_eeprom() {
    let rig = Rig::with(&line(), options());
    let described = rig.driver.channels().iter().filter(|of| !of.name.starts_with("x."));
    let described: Vec<String> = described.map(|of| format!("{} {} {} {:?}", of.name, of.type_text, of.unit, of.direction)).collect();
    let inputs = (1..=8).map(|number| format!("in.channel_{number} bool  Read"));
    let named = ["out.lamp bool  Write", "out.valve bool  Write"].map(String::from);
    let analog = ["analog.counts int16_t  Read", "analog.force double N Read", "analog.heater double V Write"].map(String::from);
    assert_eq!(described, inputs.chain(named).chain(analog).collect::<Vec<_>>());
}

#[test]
fn inputs_arrive_and_outputs_are_carried() {
    let mut rig = Rig::with(&line(), options());
    for (position, input, value) in [(INPUTS, 2, 1), (ANALOG, 0, -123), (ANALOG, 1, 1500)] {
        rig.server.lock().put(position, input, value);
    }
    exchange(&mut rig, &[("out.lamp", &[1]), ("out.valve", &[0]), ("analog.heater", &5.0f64.to_ne_bytes())]).unwrap();
    let inputs: Vec<u8> = (1..=8).map(|number| rig.bytes(&format!("in.channel_{number}"))[0]).collect();
    assert_eq!(inputs, [0, 0, 1, 0, 0, 0, 0, 0]);
    assert_eq!(i16::from_ne_bytes(rig.bytes("analog.counts").try_into().unwrap()), -123);
    assert_eq!(rig.double("analog.force"), 10.0);
    assert_eq!(rig.double("x.position"), 1.0, "the drive is there too");
    let carried = |rig: &Rig, position| rig.server.lock().carried(position).unwrap();
    assert_eq!(carried(&rig, OUTPUTS), [0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(carried(&rig, ANALOG), [16384]);

    exchange(&mut rig, &[("analog.heater", &1e9f64.to_ne_bytes())]).unwrap();
    assert_eq!(carried(&rig, ANALOG), [32767], "a value beyond the counts is the largest one");
    exchange(&mut rig, &[("analog.heater", &f64::NAN.to_ne_bytes())]).unwrap();
    assert_eq!(carried(&rig, ANALOG), [-3277], "what is no number is the safe value");
    let safe = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1];
    assert_eq!(carried(&rig, OUTPUTS), safe, "what nobody commands carries its safe value");

    exchange(&mut rig, &[("out.lamp", &[1])]).unwrap();
    let seen = rig.server.lock().counts().frames;
    rig.driver.safe_state();
    rig.wait_beyond(seen);
    assert_eq!(carried(&rig, OUTPUTS), safe);
}

#[test]
fn without_commands_its_watchdog_takes_its_outputs_back() {
    let mut rig = Rig::with(&line(), options());
    exchange(&mut rig, &[("out.lamp", &[1])]).unwrap();
    rig.pass_by(200_000_000);
    let message = lost(&mut rig);
    assert!(message.contains("has left OP: it is in SAFEOP"), "{message}");
    assert_eq!(rig.server.lock().carried(OUTPUTS).unwrap(), [0; 16]);
}

#[test]
fn a_pulled_cable_and_a_swapped_terminal_are_named() {
    let mut rig = Rig::with(&line(), options());
    rig.server.lock().cut(ANALOG);
    let message = lost(&mut rig);
    assert!(message.contains("terminal 'analog' at place 3 does not answer"), "{message}");
    rig.server.lock().heal();
    rig.server.lock().swap(INPUTS, OUTPUTS);
    rig.driver.close();
    let refused = device::open("ethercat", &with_interface(&rig)).err().map(|error| error.to_string());
    assert!(refused.as_ref().is_some_and(|text| text.contains("terminal 'out' exchanges no entry")), "{refused:?}");
}

fn with_interface(rig: &Rig) -> Value {
    let mut options = options();
    options["interface"] = rig.interface.clone().into();
    options
}

#[test]
fn what_is_wrong_is_said_with_the_terminal_and_its_channel() {
    let rig = Rig::with(&line(), options());
    let wrong = [
        (
            json!({ "name": "in", "at": 1, "channels": { "door": { "entry": "Chanel 3" } } }),
            "terminal 'in' exchanges no entry 'Chanel 3'; did you mean 'channel_3'?",
        ),
        (
            json!({ "name": "in", "at": 1, "channels": { "door": { "entry": "Channel 3", "scale": 2 } } }),
            "channel 'door' is a single bit: it cannot have a scale",
        ),
        (
            json!({ "name": "in", "at": 1, "channels": { "door": { "entry": "Channel 3", "safe": true } } }),
            "channel 'door' is an input: it cannot have a safe value",
        ),
        (
            json!({ "name": "in", "at": 1, "channels": { "a": { "entry": "Channel 3" }, "b": { "entry": "0x6020:1" } } }),
            "channel 'b' is an entry that another channel already uses",
        ),
        (json!({ "name": "out", "at": 2, "channels": { "lamp": { "entry": "Channel 1", "safe": 2 } } }), "channel 'lamp' cannot have the safe value 2"),
        (json!({ "name": "none", "at": 0 }), "terminal 'none' exchanges nothing"),
        (json!({ "name": "far", "at": 9 }), "terminal 'far' should be at place 9, but 5 subdevices answer"),
        (json!({ "name": "x", "at": 1 }), "'x' is named twice"),
        (json!({ "name": "y", "at": 4 }), "'x' and 'y' are both at place 4"),
    ];
    for (terminal, said) in wrong {
        let mut options = with_interface(&rig);
        options["terminals"] = json!([terminal]);
        let refused = device::open("ethercat", &options).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(refused.contains(said), "{said}: {refused}");
    }
}

#[test]
fn a_vendors_file_names_what_the_eeprom_does_not() {
    let mut options = options();
    let pdos = json!([{ "output": false, "name": "Doors", "entries": [
        { "index": 0x6000, "sub": 1, "bits": 1, "kind": 1, "name": "Left" }, { "index": 0x6010, "sub": 1, "bits": 1, "kind": 1, "name": "Right" },
    ] }]);
    options["terminals"] = json!([{ "name": "in", "at": INPUTS, "pdos": pdos }]);
    let mut rig = Rig::with(&line(), options.clone());
    rig.server.lock().put(INPUTS, 1, 1);
    exchange(&mut rig, &[]).unwrap();
    assert_eq!((rig.bytes("in.doors_left"), rig.bytes("in.doors_right")), (&[0][..], &[1][..]));
    options["interface"] = rig.interface.clone().into();
    options["terminals"][0]["pdos"][0]["entries"][0]["index"] = 0x6100.into();
    rig.driver.close();
    let (mut driver, _) = device::open("ethercat", &options).expect("made");
    let refused = driver.open(0).expect_err("refused").message;
    assert!(refused.contains("terminal 'in': channel 'in.doors_left' is entry 0x6100:1, which it does not exchange now"), "{refused}");
}
