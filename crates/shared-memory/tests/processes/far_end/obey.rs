// SPDX-License-Identifier: Apache-2.0
//! Creates and uses writing ends as directed by the standard input, one line per call; each answer is also a line.
use super::say;
use interconnect::{ConnectionSpec, Ends, Sender};
use shared_memory::SharedMemory;
use std::collections::HashMap;
use std::io::{BufRead, stdin};

pub fn obey(mut ends: SharedMemory) {
    let mut senders: HashMap<u64, Box<dyn Sender>> = HashMap::new();
    while let Some(line) = line() {
        let words: Vec<&str> = line.split(' ').collect();
        let number = |at: usize| words[at].parse::<u64>().expect("a number");
        let len = |at: usize| words[at].parse::<usize>().expect("a length");
        match words[0] {
            "sender" => {
                let spec = ConnectionSpec { writer: 0, reader: 1, asynchronous_len: len(2), queue_row_len: len(3), queue_depth: len(4) };
                senders.insert(number(1), ends.sender(number(1), &spec).expect("the end is free"));
            }
            "publish" => {
                let sender = senders.get_mut(&number(1)).expect("it was made");
                copy(sender.group(), words[4]);
                sender.publish(number(2), words[3].parse().expect("a time"));
            }
            "push" => {
                let sender = senders.get_mut(&number(1)).expect("it was made");
                let ask = &mut |row: &mut [u8]| {
                    say("fill");
                    copy(row, &self::line().expect("the bytes of the row"));
                };
                if sender.push(number(2), words[3].parse().expect("a time"), ask).is_err() {
                    say("full");
                    continue;
                }
            }
            "drop" => drop(senders.remove(&number(1))),
            other => panic!("there is no call '{other}'"),
        }
        say("ok");
    }
}

fn line() -> Option<String> {
    stdin().lock().lines().next().map(|line| line.expect("text"))
}

/// Decodes two hexadecimal digits per byte.
fn copy(into: &mut [u8], text: &str) {
    assert_eq!(text.len(), 2 * into.len(), "all bytes come");
    for (index, byte) in into.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&text[2 * index..2 * index + 2], 16).expect("two digits");
    }
}
