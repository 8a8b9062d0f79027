// SPDX-License-Identifier: Apache-2.0
//! Channels served over Modbus, queried by slow, silent or mad sockets, and by our own client.
mod common;
use common::Machine;
use serde_json::{Value, json};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

const CHANNELS: &str = r#"{
    "wanted": { "holding": 100, "type": "double" }, "flag": { "holding": 104, "type": "double" },
    "position": { "input": 0, "type": "int32", "scale": 0.001, "write": true, "safe": -1.0 }, "speed": { "input": 2, "type": "float", "write": true } }"#;

/// Starts a server; returns it and its address, a loopback address unique to this test, so that its port is free.
fn server(test: u8, more: &Value) -> (Machine, String) {
    let process = std::process::id();
    let address = format!("tcp/127.{test}.{}.{}:15020", process / 250 % 250, process % 250 + 1);
    let mut options = json!({ "address": address, "channels": serde_json::from_str::<Value>(CHANNELS).expect("it is right"), "in_place": true });
    options.as_object_mut().expect("a table").extend(more.as_object().expect("a table").clone());
    (Machine::open("modbus_server", options), address)
}

fn connect(address: &str) -> TcpStream {
    let stream = TcpStream::connect(&address[4..]).expect("it listens");
    stream.set_read_timeout(Some(Duration::from_secs(30))).expect("it is open");
    stream
}

const READ_POSITION: [u8; 12] = [0, 1, 0, 0, 0, 6, 1, 4, 0, 0, 0, 2];
/// -1 mm in micrometres.
const SAFE: [u8; 13] = [0, 1, 0, 0, 0, 7, 1, 4, 4, 0xFF, 0xFF, 0xFC, 0x18];

fn ask<const N: usize>(stream: &mut TcpStream, request: &[u8]) -> [u8; N] {
    stream.write_all(request).expect("it takes it");
    let mut answer = [0; N];
    stream.read_exact(&mut answer).expect("it answers");
    answer
}

#[test]
fn a_client_reads_what_is_written_and_writes_what_is_read() {
    let (mut machine, address) = server(1, &json!({}));
    let channels = json!({ "position": { "input": 0, "type": "int32", "scale": 0.001 }, "speed": { "input": 2, "type": "float" },
        "wanted": { "holding": 100, "type": "double", "write": true } });
    let mut client = Machine::open("modbus", json!({ "address": address, "channels": channels, "in_place": true, "answer_ns": 30_000_000_000_i64 }));
    client.read(0);
    assert_eq!((client.get("position"), client.get("speed")), (vec![-1.0], vec![0.0]), "safe, as nobody commands it");
    machine.set("position", &[12.345]);
    machine.set("speed", &[-0.5]);
    machine.write(0, &[true, true]);
    client.set("wanted", &[0.1]);
    client.write(0, &[true]);
    client.read(0);
    machine.read(0);
    assert_eq!((client.get("position"), client.get("speed"), machine.get("wanted")), (vec![12.345], vec![-0.5], vec![0.1]));
    let said = client.driver.services().expect("it has some").call("identification", &json!({})).expect("it answers");
    assert_eq!((&said["vendor"], &said["product_code"]), (&json!("OpenGPAC"), &json!("modbus_server")));
    let services = client.driver.services().expect("it has some");
    let call = |service: &str, arguments: Value| services.call(service, &arguments).map_err(|why| why.message);
    assert_eq!(call("read_register", json!({ "address": 0, "table": "input", "type": "int32" })), Ok(json!(12345.0)));
    assert_eq!(call("write_register", json!({ "address": 104, "type": "double", "value": 7.5 })), Ok(Value::Null));
    machine.read(0);
    assert_eq!(machine.get("flag"), [7.5]);
    let refused = call("write_register", json!({ "address": 101, "value": 7 })).expect_err("a channel writes it");
    assert_eq!(refused, "holding 101 is written by channel 'wanted'; use a verb to command it");
    machine.driver.safe_state();
    client.read(0);
    assert_eq!(client.get("position"), [-1.0]);
}

#[test]
fn what_is_no_channel_is_refused_as_a_whole() {
    let (mut machine, address) = server(2, &json!({}));
    let mut client = connect(&address);
    assert_eq!(ask::<13>(&mut client, &READ_POSITION), SAFE);
    // One register too many; a register that only this machine writes; an unsupported function; a count of 0.
    for (request, exception) in [
        (&[0, 2, 0, 0, 0, 6, 9, 4, 0, 0, 0, 5][..], [0, 2, 0, 0, 0, 3, 9, 0x84, 2]),
        (&[0, 3, 0, 0, 0, 6, 1, 6, 0, 99, 0, 5], [0, 3, 0, 0, 0, 3, 1, 0x86, 2]),
        (&[0, 4, 0, 0, 0, 2, 1, 7], [0, 4, 0, 0, 0, 3, 1, 0x87, 1]),
        (&[0, 5, 0, 0, 0, 6, 1, 3, 0, 100, 0, 0], [0, 5, 0, 0, 0, 3, 1, 0x83, 3]),
        (&[0, 6, 0, 0, 0, 6, 1, 3, 0xFF, 0xFF, 0, 2], [0, 6, 0, 0, 0, 3, 1, 0x83, 2]),
        (&[0, 7, 0, 0, 0, 11, 1, 16, 0, 107, 0, 2, 4, 1, 1, 1, 1], [0, 7, 0, 0, 0, 3, 1, 0x90, 2]),
    ] {
        assert_eq!(ask::<9>(&mut client, request), exception);
    }
    machine.read(0);
    assert_eq!(machine.get("flag"), [0.0], "its last register was not written alone");
}

#[test]
fn one_client_delays_no_other() {
    let (_machine, address) = server(3, &json!({ "clients": 4 }));
    let (mut half, mut deaf, mut mad) = (connect(&address), connect(&address), connect(&address));
    half.write_all(&READ_POSITION[..7]).expect("it takes it");
    // One client never reads its answers, until its socket accepts no more requests.
    deaf.set_nonblocking(true).expect("it is open");
    let until = Instant::now() + Duration::from_secs(60);
    while !matches!(deaf.write(&READ_POSITION.repeat(100)), Err(why) if why.kind() == ErrorKind::WouldBlock) {
        assert!(Instant::now() < until, "it takes everything");
    }
    mad.write_all(b"GET / HTTP/1.1\r\n\r\n").expect("it takes it");
    assert!(matches!(mad.read(&mut [0; 1]), Ok(0) | Err(_)), "its connection ends");
    let mut plc = connect(&address);
    assert_eq!(ask::<13>(&mut plc, &READ_POSITION), SAFE);
    // One client too many: the one that was silent for the longest is disconnected.
    let mut others = [connect(&address), connect(&address)];
    others.iter_mut().for_each(|other| assert_eq!(ask::<13>(other, &READ_POSITION), SAFE));
    assert!(matches!(half.read(&mut [0; 1]), Ok(0) | Err(_)), "its connection ends");
    assert_eq!(ask::<13>(&mut plc, &READ_POSITION), SAFE);
}

#[test]
fn silent_clients_are_a_lost_device() {
    let (mut machine, address) = server(4, &json!({ "silent_ns": 1_000_000 }));
    assert_eq!(machine.try_read(i64::MAX / 2), Ok(()), "nobody has asked yet");
    assert_eq!(ask::<13>(&mut connect(&address), &READ_POSITION), SAFE);
    machine.read(5_000_000);
    assert_eq!(machine.try_read(6_000_000), Ok(()));
    assert_eq!(machine.try_read(6_000_001), Err(format!("no client has sent a request to {} for 1 ms", &address[4..])));
}

#[test]
fn it_listens_on_this_host_unless_told() {
    let refused = |options: Value| drivers::open("modbus_server", &options).err().map(|why| why.to_string()).unwrap_or_default();
    let channels = serde_json::from_str::<Value>(CHANNELS).expect("it is right");
    let why = refused(json!({ "address": "tcp/0.0.0.0:1502", "channels": channels }));
    assert!(why.contains("option 'address': other hosts could write its channels") && why.contains("to_network=true"), "{why}");
    assert_eq!(refused(json!({ "address": "tcp/0.0.0.0:1502", "channels": channels, "to_network": true })), "");
    let why = refused(json!({ "address": "tcp/127.0.0.1:1502", "channels": { "x": { "input": 0 } } }));
    assert!(why.contains("a client cannot write to the table \"input\", so this channel would get no values"), "{why}");
}
