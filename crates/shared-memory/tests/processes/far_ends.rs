// SPDX-License-Identifier: Apache-2.0
//! Writing ends in a separate process: each call is a line sent to it.
use super::FarEnd;
use interconnect::{ConnectionSpec, EndError, Ends, Full, Receiver, Sender};
use std::fmt::Write as _;
use std::sync::{Arc, Mutex};

/// Makes the writing ends of connections in another process.
pub struct FarEnds(Arc<Mutex<FarEnd>>);

impl FarEnds {
    pub fn start(system: &str, run: u64) -> Self {
        FarEnds(Arc::new(Mutex::new(FarEnd::start("obey", system, run, &[]))))
    }
}

fn call(process: &Mutex<FarEnd>, line: &str) -> String {
    let mut process = process.lock().expect("no other call failed");
    process.tell(line);
    process.hear()
}

impl Ends for FarEnds {
    fn sender(&mut self, number: u64, spec: &ConnectionSpec) -> Result<Box<dyn Sender>, EndError> {
        let answer = call(&self.0, &format!("sender {number} {} {} {}", spec.asynchronous_len, spec.queue_row_len, spec.queue_depth));
        assert_eq!(answer, "ok");
        let lines = vec![Line([0; 64]); spec.asynchronous_len.div_ceil(64)];
        Ok(Box::new(FarSender { process: self.0.clone(), connection: number, lines, group_len: spec.asynchronous_len, row_len: spec.queue_row_len }))
    }

    fn receiver(&mut self, _: u64, _: &ConnectionSpec, _: Box<dyn Fn() + Send + Sync>) -> Result<Box<dyn Receiver>, EndError> {
        Err(EndError { message: "the reading ends are in this process".to_owned() })
    }
}

#[derive(Clone, Copy)]
#[repr(align(64))]
struct Line([u8; 64]);

struct FarSender {
    process: Arc<Mutex<FarEnd>>,
    connection: u64,
    /// Lines of the group, until it is sent.
    lines: Vec<Line>,
    group_len: usize,
    row_len: usize,
}

impl Sender for FarSender {
    fn group(&mut self) -> &mut [u8] {
        // SAFETY: the bytes of the lines, which are contiguous.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), self.group_len) }
    }

    fn publish(&mut self, number: u64, now_ns: i64) {
        let bytes = digits(self.group());
        assert_eq!(call(&self.process, &format!("publish {} {number} {now_ns} {bytes}", self.connection)), "ok");
    }

    fn push(&mut self, number: u64, now_ns: i64, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        match call(&self.process, &format!("push {} {number} {now_ns}", self.connection)).as_str() {
            "full" => Err(Full),
            "fill" => {
                let mut row = vec![0; self.row_len];
                fill(&mut row);
                assert_eq!(call(&self.process, &digits(&row)), "ok");
                Ok(())
            }
            other => panic!("a push was answered with '{other}'"),
        }
    }

    fn arrived(&self) -> bool {
        false
    }
}

impl Drop for FarSender {
    fn drop(&mut self) {
        assert_eq!(call(&self.process, &format!("drop {}", self.connection)), "ok");
    }
}

fn digits(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("a text takes what is written");
        text
    })
}
