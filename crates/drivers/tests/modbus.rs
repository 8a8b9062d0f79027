// SPDX-License-Identifier: Apache-2.0
//! A Modbus device that answers badly: late, by halves, damaged, not at all. Its answers are written by hand here, byte by byte.
mod common;
use common::Machine;
use device::Driver;
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

/// What a device sends when it has its n-th request, counted from 0; it also sees all requests so far. None: it closes the connection.
type Script = fn(usize, &[[u8; 12]]) -> Option<Vec<u8>>;

/// A device that reads requests of 12 bytes; it ends with the test's process.
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

/// The answer to a request that reads one register.
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

/// Opens it, and says why that failed.
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
    // Nothing at the first; from then on what it was asked first, and only then what it was asked now.
    let script: Script = |n, requests| match n {
        0 => Some(Vec::new()),
        _ => Some([answer(&requests[n - 1], 1), answer(&requests[n], 2)].concat()),
    };
    // Opening it asks first.
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
        (json!({ "address": "192.0.2.1" }), "option 'address': '192.0.2.1' is no address; write tcp/192.0.2.5:502 or rtu//dev/ttyUSB0"),
        (json!({ "channels": {} }), "option 'channels': name at least one channel"),
        (json!({ "channels": { "x": { "coil": 70000 } } }), "option 'channels.x.coil': it cannot be 70000: its range is 0 to 65535"),
        (json!({ "answer_ns": 5 }), "option 'answer_ns': it cannot be 5 ns: its range is 1 ms to 60 s; give 5000000 for 5 ms"),
        (json!({ "address": "rtu//dev/ttyUSB0", "unit": 0 }), "option 'unit': units on a serial line are 1 to 247"),
    ] {
        let text = refused(more);
        assert!(text.contains(why), "{text}");
    }
}
