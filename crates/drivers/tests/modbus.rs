// SPDX-License-Identifier: Apache-2.0
//! A Modbus device that answers badly: late, in pieces, damaged, not at all. Its answers are hand-written, byte by byte.
mod common;
use common::Machine;
use device::Driver;
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

/// Returns the device's answer to its n-th request, counted from 0; it also gets all requests so far. `None` closes the connection.
type Script = fn(usize, &[[u8; 12]]) -> Option<Vec<u8>>;

/// Starts a device that reads requests of 12 bytes; it ends with the test's process.
fn device(script: Script) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = format!("tcp/{}", listener.local_addr().expect("it is bound"));
    std::thread::spawn(move || {
        let mut requests = Vec::new();
        for stream in listener.incoming().flatten() {
            serve(stream, &mut requests, script);
        }
    });
    address
}

fn serve(mut stream: TcpStream, requests: &mut Vec<[u8; 12]>, script: Script) {
    let mut request = [0; 12];
    while stream.read_exact(&mut request).is_ok() {
        requests.push(request);
        let sent = match script(requests.len() - 1, requests) {
            Some(answer) => stream.write_all(&answer).is_ok(),
            None => false,
        };
        if !sent {
            return;
        }
    }
}

/// Returns the answer to a request that reads one register.
fn answer(request: &[u8; 12], value: u16) -> Vec<u8> {
    let [high, low] = value.to_be_bytes();
    vec![request[0], request[1], 0, 0, 0, 5, request[6], request[7], 2, high, low]
}

fn options(address: &str, more: Value) -> Value {
    let mut options = json!({ "address": address, "unit": 7, "in_place": true, "channels": { "x": { "input": 3, "scale": 0.5, "unit": "bar" } },
        "retries": 100, "answer_ns": 100_000_000 });
    options.as_object_mut().expect("a table").extend(more.as_object().expect("a table").clone());
    options
}

/// Opens the driver, and returns why that failed.
fn refused(options: &Value) -> (Box<dyn Driver>, String) {
    let (mut driver, _) = drivers::open("modbus", options).unwrap_or_else(|e| panic!("{e}"));
    let why = driver.open(0).expect_err("it is refused").message;
    (driver, why)
}

fn counted(machine: &Machine, name: &str) -> u64 {
    count_of(machine.driver.as_ref(), name)
}

fn count_of(driver: &dyn Driver, name: &str) -> u64 {
    let counters = driver.counters().expect("it counts");
    counters.all().find(|(word, _)| word.name == name).expect("it is counted").1
}

#[test]
fn a_register_is_a_channel() {
    let mut machine = Machine::open("modbus", options(&device(|_, requests| Some(answer(requests.last()?, 8))), json!({})));
    machine.read(0);
    assert_eq!(machine.get("x"), [4.0]);
    assert_eq!((counted(&machine, "requests"), counted(&machine, "timeouts"), counted(&machine, "reconnects")), (2, 0, 0));
}

#[test]
fn a_late_answer_is_not_taken_for_the_next_one() {
    // No answer to the first request; every later one is answered after the answer to its predecessor.
    let script: Script = |n, requests| match n {
        0 => Some(Vec::new()),
        _ => Some([answer(&requests[n - 1], 1), answer(&requests[n], 2)].concat()),
    };
    // Opening the driver sends the first request.
    let mut machine = Machine::open("modbus", options(&device(script), json!({})));
    machine.read(0);
    assert_eq!(machine.get("x"), [1.0], "2 times its scale");
    assert!(counted(&machine, "timeouts") >= 1 && counted(&machine, "late") >= 1);
    assert_eq!((counted(&machine, "damaged"), counted(&machine, "reconnects")), (0, 0));
}

#[test]
fn half_a_frame_waits_for_its_other_half() {
    let script: Script = |n, requests| match n {
        0 => Some(answer(&requests[0], 1)[..6].to_vec()),
        1 => Some([answer(&requests[0], 1)[6..].to_vec(), answer(&requests[1], 2)].concat()),
        _ => Some(answer(&requests[n], 2)),
    };
    let mut machine = Machine::open("modbus", options(&device(script), json!({})));
    machine.read(0);
    assert_eq!(machine.get("x"), [1.0]);
    assert!(counted(&machine, "late") >= 1, "the first was whole in the end, and too late");
    assert_eq!(counted(&machine, "damaged"), 0);
}

#[test]
fn after_a_damaged_frame_or_a_closed_connection_it_connects_again() {
    let script: Script = |n, requests| match n {
        0 => Some(b"HTTP/1.1 400 Bad Request".to_vec()),
        1 => None,
        _ => Some(answer(&requests[n], 6)),
    };
    let mut machine = Machine::open("modbus", options(&device(script), json!({ "answer_ns": 30_000_000_000_i64 })));
    machine.read(0);
    assert_eq!(machine.get("x"), [3.0]);
    assert_eq!((counted(&machine, "damaged"), counted(&machine, "reconnects"), counted(&machine, "timeouts")), (1, 2, 0));
}

#[test]
fn an_exception_has_its_name_and_is_not_asked_again() {
    let script: Script = |_, requests| requests.last().map(|r| vec![r[0], r[1], 0, 0, 0, 3, r[6], 0x84, 2]);
    let address = device(script);
    let (driver, why) = refused(&options(&address, json!({})));
    assert_eq!(why, format!("unit 7 at {} did not read input 3: illegal data address (exception 2)", &address[4..]));
    assert_eq!((count_of(driver.as_ref(), "requests"), count_of(driver.as_ref(), "exceptions")), (1, 1));
}

#[test]
fn a_damaged_answer_says_what_was_damaged() {
    let of = |script: Script| {
        let address = device(script);
        let (driver, why) = refused(&options(&address, json!({ "retries": 0, "answer_ns": 30_000_000_000_i64 })));
        assert_eq!(count_of(driver.as_ref(), "damaged"), 1);
        let said = format!("unit 7 at {} did not read input 3: its answer was damaged: ", &address[4..]);
        why.strip_prefix(&said).unwrap_or_else(|| panic!("{why}")).to_owned()
    };
    assert_eq!(of(|_, _| Some(b"HTTP/1.1 400 Bad Request".to_vec())), "it does not begin with a Modbus TCP header");
    let other_unit: Script = |_, requests| requests.last().map(|r| vec![r[0], r[1], 0, 0, 0, 5, 8, r[7], 2, 0, 1]);
    assert_eq!(of(other_unit), "it came from another unit");
    let other_function: Script = |_, requests| requests.last().map(|r| vec![r[0], r[1], 0, 0, 0, 5, r[6], 3, 2, 0, 1]);
    let other_length: Script = |_, requests| requests.last().map(|r| vec![r[0], r[1], 0, 0, 0, 7, r[6], r[7], 4, 0, 1, 0, 2]);
    for script in [other_function, other_length] {
        assert_eq!(of(script), "it answers another request: its function, length or address differs");
    }
}

#[test]
fn a_command_beyond_its_register_is_written_as_the_largest_number_and_never_as_infinity() {
    let script: Script = |_, requests| requests.last().map(|r| if r[7] == 3 { answer(r, 0) } else { r.to_vec() });
    let channels = json!({ "held": { "holding": 0 }, "goal": { "holding": 3, "scale": 0.5, "write": true } });
    let (written, limited) = limits(script, channels, &[f64::INFINITY, -1.0, 1e300]);
    assert_eq!((written, limited), (vec![[0xFF, 0xFF], [0, 0], [0xFF, 0xFF]], 3));
}

/// Commands each of these numbers to a channel; returns the last register value the device received for each, and how many were limited.
fn limits(script: Script, channels: Value, commands: &[f64]) -> (Vec<[u8; 2]>, u64) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = format!("tcp/{}", listener.local_addr().expect("it is bound"));
    let (told, tells) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for mut stream in listener.incoming().flatten() {
            let (mut request, mut requests) = ([0; 12], Vec::new());
            while stream.read_exact(&mut request).is_ok() {
                requests.push(request);
                if request[7] == 6 && told.send([request[10], request[11]]).is_err() {
                    return;
                }
                let answered = script(requests.len() - 1, &requests).is_some_and(|answer| stream.write_all(&answer).is_ok());
                if !answered {
                    break;
                }
            }
        }
    });
    let mut machine = Machine::open("modbus", options(&address, json!({ "channels": channels, "answer_ns": 30_000_000_000_i64 })));
    let written = commands.iter().map(|command| {
        machine.set("goal", &[*command]);
        machine.write(0, &[true]);
        tells.recv().expect("it is told")
    });
    let written = written.collect();
    (written, counted(&machine, "limited"))
}

#[test]
fn parts_of_a_register_change_nothing_else_in_it() {
    // A device without mask write (function 22): the register is read and written.
    let script: Script = |_, requests| {
        let r = requests.last()?;
        match r[7] {
            3 => Some(answer(r, 0b1000_0000_0100_0001)),
            6 => Some(r.to_vec()),
            _ => Some(vec![r[0], r[1], 0, 0, 0, 3, r[6], r[7] | 0x80, 1]),
        }
    };
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = format!("tcp/{}", listener.local_addr().expect("it is bound"));
    let (told, tells) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("it connects");
        let mut request = [0; 12];
        while stream.read_exact(&mut request).is_ok() {
            if request[7] == 22 {
                stream.read_exact(&mut [0; 2]).expect("its second mask");
            }
            let answered = told.send(request).is_ok() && script(0, &[request]).is_some_and(|answer| stream.write_all(&answer).is_ok());
            if !answered {
                return;
            }
        }
    });
    let channels = json!({ "run": { "holding": 5, "bit": 1, "write": true }, "ready": { "holding": 5, "bit": 6, "write": true }, "level": { "holding": 5, "byte": "high", "write": true } });
    let mut machine = Machine::open("modbus", options(&address, json!({ "channels": channels, "answer_ns": 30_000_000_000_i64 })));
    machine.set("level", &[5.0]);
    machine.set_bool("run", true);
    machine.write(0, &[true, true, true]);
    let asked: Vec<[u8; 12]> = tells.try_iter().collect();
    assert_eq!(asked.iter().map(|request| request[7]).collect::<Vec<_>>(), [22, 3, 6], "it is tried once, then read and written as one");
    // Bit 1 set, bit 6 cleared, the high byte 5; the unassigned bit 0 stays.
    assert_eq!(asked[2][8..], [0, 5, 0b0000_0101, 0b0000_0011]);
    machine.set_bool("run", false);
    machine.write(0, &[true, true, true]);
    let asked: Vec<u8> = tells.try_iter().map(|request| request[7]).collect();
    assert_eq!(asked, [3, 6], "it is not tried again");
}

#[test]
fn one_that_never_answers_is_lost_with_its_place() {
    let address = device(|_, _| Some(Vec::new()));
    let (driver, why) = refused(&options(&address, json!({ "answer_ns": 20_000_000, "retries": 2 })));
    assert_eq!(why, format!("unit 7 at {} did not read input 3: no answer within 20 ms", &address[4..]));
    assert_eq!((count_of(driver.as_ref(), "requests"), count_of(driver.as_ref(), "timeouts")), (3, 3));
}

#[test]
fn options_that_are_wrong_are_named() {
    let refused = |more: Value| drivers::open("modbus", &options("tcp/192.0.2.1", more)).err().expect("it is refused").to_string();
    for (more, why) in [
        (json!({ "address": "192.0.2.1" }), "option 'address': '192.0.2.1' is not an address; write tcp/192.0.2.5:502 or rtu//dev/ttyUSB0"),
        (json!({ "channels": {} }), "option 'channels': name at least one channel"),
        (json!({ "channels": { "x": { "coil": 70000 } } }), "option 'channels.x.coil': it cannot be 70000: its range is 0 to 65535"),
        (json!({ "answer_ns": 5 }), "option 'answer_ns': it cannot be 5 ns: its range is 1 ms to 60 s; give 5000000 for 5 ms"),
        (json!({ "address": "rtu//dev/ttyUSB0", "unit": 0 }), "option 'unit': a unit on a serial line must be 1 to 247"),
    ] {
        let text = refused(more);
        assert!(text.contains(why), "{text}");
    }
}
