// SPDX-License-Identifier: Apache-2.0
//! Devices that use text: a scale that is polled, a scanner that sends by itself, a printer that is written to.
mod common;
use common::Machine;
use device::Direction;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

fn listen() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = format!("tcp/{}", listener.local_addr().expect("it is bound"));
    (listener, address)
}

fn open(options: Value) -> Machine {
    let mut options = options;
    options["in_place"] = true.into();
    Machine::open("text", options)
}

fn accept(listener: &TcpListener) -> TcpStream {
    let (stream, _) = listener.accept().expect("it connects");
    stream.set_read_timeout(Some(Duration::from_secs(30))).expect("it is open");
    stream
}

fn bytes_of<'a>(machine: &'a Machine, name: &str) -> &'a [u8] {
    let channel = machine.driver.channels().iter().find(|channel| channel.name == name && channel.direction == Direction::Read).expect("it has one");
    &machine.readings()[channel.offset..channel.offset + channel.len]
}

fn counted(machine: &Machine, name: &str) -> u64 {
    machine.driver.counters().expect("it counts").all().find(|(word, _)| word.name == name).expect("it is counted").1
}

/// Reads until `count` texts have arrived.
fn read_until(machine: &mut Machine, count: f64) {
    let until = Instant::now() + Duration::from_secs(60);
    while machine.get("count") != [count] {
        assert!(Instant::now() < until, "{:?} texts of {count} came", machine.get("count"));
        machine.read(0);
    }
}

#[test]
fn a_scale_answers_when_it_is_asked() {
    let (listener, address) = listen();
    std::thread::spawn(move || {
        let mut stream = accept(&listener);
        let lines = BufReader::new(stream.try_clone().expect("it is open")).lines();
        for (line, weight) in lines.map_while(Result::ok).zip(["ST,+  12.50 kg\r\n", "US,-3 kg\r\n", "OL\r\nST,1.0 kg\r\n"]) {
            assert_eq!(line, "P");
            stream.write_all(weight.as_bytes()).expect("it takes it");
        }
    });
    let mut machine = open(json!({ "address": address, "asks": "P", "reads": ["{stable},{weight} kg"], "answer_ns": 30_000_000_000_i64,
        "fields": { "weight": { "unit": "kg", "scale": 2.0 }, "stable": { "when": "ST" } } }));
    machine.read(0);
    assert_eq!((machine.get("weight"), bytes_of(&machine, "stable")), (vec![25.0], &[1][..]));
    machine.read(1);
    assert_eq!((machine.get("weight"), bytes_of(&machine, "stable")), (vec![-6.0], &[0][..]));
    machine.read(2);
    assert_eq!((machine.get("weight"), machine.get("count")), (vec![2.0], vec![3.0]));
    assert_eq!((counted(&machine, "taken"), counted(&machine, "unmatched"), counted(&machine, "sent")), (3, 1, 3));
    let last = machine.driver.services().expect("it has some").call("last_text", &json!({}));
    assert!(last.is_ok_and(|text| text == "ST,1.0 kg"));
    let why = machine.try_read(3).expect_err("it is gone");
    assert!(why.starts_with(&format!("the device at {}: ", &address[4..])), "{why}");
}

#[test]
fn a_scanner_speaks_by_itself() {
    let (listener, address) = listen();
    let mut machine = open(json!({ "address": address, "start": "\u{2}", "end": "\u{3}", "reads": ["{code}"], "fields": { "code": { "text": 8 } },
        "checksum": { "sum": "xor" }, "silent_ns": 1000 }));
    let mut scanner = accept(&listener);
    machine.read(0);
    assert_eq!((machine.get("count"), bytes_of(&machine, "code")), (vec![0.0], &[0; 8][..]));
    // Noise, a damaged text, one that is too long, and a good one in two halves.
    scanner.write_all(b"xy\x02A1B7\x30\x30\x03\x02123456789\x33\x31\x03\x02A1B7").expect("it takes it");
    scanner.write_all(b"\x30\x30\x03\x02A1B7\x30\x32\x03").expect("it takes it");
    let sum = b"A1B7".iter().fold(0, |sum, byte| sum ^ byte);
    scanner.write_all(format!("\u{2}A1B7{sum:02x}\u{3}").as_bytes()).expect("it takes it");
    read_until(&mut machine, 1.0);
    assert_eq!(bytes_of(&machine, "code"), b"A1B7\0\0\0\0");
    assert!(counted(&machine, "damaged") >= 4);
    assert_eq!(counted(&machine, "unmatched"), 1);
    assert_eq!(machine.try_read(1000), Ok(()));
    assert_eq!(machine.try_read(1001), Err(format!("the device at {} has sent no declared text for 0.001 ms", &address[4..])));
}

#[test]
fn a_carriage_return_before_the_line_feed_is_no_part_of_a_checksum() {
    let (listener, address) = listen();
    let mut machine =
        open(json!({ "address": address, "start": "$", "reads": ["SCALE,{weight}"], "checksum": { "sum": "xor", "written": "hex", "mark": "*" } }));
    let mut scale = accept(&listener);
    let line = |weight: &str, end: &str| {
        let text = format!("SCALE,{weight}");
        let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
        format!("${text}*{sum:02X}{end}")
    };
    scale.write_all(format!("{}{}", line("12.5", "\r\n"), line("13.5", "\n")).as_bytes()).expect("it takes it");
    read_until(&mut machine, 2.0);
    assert_eq!((machine.get("weight"), counted(&machine, "damaged")), (vec![13.5], 0));
    let last = machine.driver.services().expect("it has some").call("last_text", &json!({}));
    assert!(last.is_ok_and(|text| text == "SCALE,13.5"), "neither sum nor end");
}

#[test]
fn a_line_that_is_too_long_is_dropped_with_its_tail() {
    let (listener, address) = listen();
    let mut machine = open(json!({ "address": address, "reads": ["W {weight}"] }));
    let mut scale = accept(&listener);
    // Its tail alone would be a valid reading.
    let long = format!("{}W 99\nW 7\n", "x".repeat(5_000));
    scale.write_all(long.as_bytes()).expect("it takes it");
    read_until(&mut machine, 1.0);
    assert_eq!((machine.get("weight"), counted(&machine, "damaged"), counted(&machine, "taken")), (vec![7.0], 1, 1));
    // A long text whose tail arrives later.
    scale.write_all("y".repeat(2_000).as_bytes()).expect("it takes it");
    machine.read(1);
    scale.write_all(b"W 98\nW 8\n").expect("it takes it");
    read_until(&mut machine, 2.0);
    assert_eq!((machine.get("weight"), counted(&machine, "damaged")), (vec![8.0], 2));
}

#[test]
fn a_printer_is_told_when_a_value_changes() {
    let (listener, address) = listen();
    let mut machine = open(json!({ "address": address, "writes": ["^FD{label}^FS", "SP {heat}"], "end": "\r",
        "fields": { "label": { "text": 4 }, "heat": { "decimals": 1, "safe": 0.0 } } }));
    let mut printer = accept(&listener);
    let mut expect = |text: &str| {
        let mut got = vec![0; text.len()];
        printer.read_exact(&mut got).expect("it comes");
        assert_eq!(String::from_utf8_lossy(&got), text);
    };
    machine.write(0, &[false, false]);
    expect("SP 0.0\r");
    machine.set("heat", &[21.25]);
    machine.write(0, &[false, true]);
    machine.write(0, &[false, true]);
    machine.set("heat", &[f64::NAN]);
    machine.write(0, &[false, true]);
    machine.set("heat", &[22.0]);
    machine.write(0, &[true, true]);
    expect("SP 21.2\r^FD^FS\rSP 22.0\r");
    machine.driver.services().expect("it has some").call("send", &json!({ "text": "~HS" })).expect("it is sent");
    machine.driver.safe_state();
    expect("~HS\rSP 0.0\r");
}

#[test]
fn options_that_are_wrong_are_named() {
    for (options, why) in [
        (json!({}), "option 'reads': give the texts that it sends"),
        (json!({ "reads": ["{x"] }), "option 'reads': a '{' in '{x' has no counterpart"),
        (json!({ "reads": ["{x}"], "fields": { "y": {} } }), "option 'fields': 'y' is in none of the texts"),
        (json!({ "reads": ["{x}"], "writes": ["{x}"] }), "'x' is already read"),
        (json!({ "reads": ["{age}"] }), "'age' is the name of a channel"),
        (json!({ "reads": ["{x}"], "end": "" }), "option 'end': a text without an end must have a \"length\""),
        (json!({ "reads": ["{x}"], "length": 0 }), "option 'length': it cannot be 0: its range is 1 to 512"),
        (json!({ "reads": ["{x}"], "address": "tcp/192.0.2.1" }), "has no port"),
    ] {
        let mut given = json!({ "address": "tcp/192.0.2.1:4001" });
        given.as_object_mut().expect("a table").extend(options.as_object().expect("a table").clone());
        let text = drivers::open("text", &given).err().expect("it is refused").to_string();
        assert!(text.contains(why), "{text}");
    }
}
