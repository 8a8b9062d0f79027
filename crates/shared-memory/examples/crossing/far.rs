// SPDX-License-Identifier: Apache-2.0
//! The far side, which answers bursts and sleeps in between.
use crate::place::{core, pin};
use crate::wires::Wire;
use std::io::{BufRead, BufReader, Write, stdin, stdout};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};

/// Far side as seen from the near side: a process or a thread.
pub enum Far {
    Process(Child, BufReader<ChildStdout>),
    Thread(Sender<u64>, Receiver<()>),
}

impl Far {
    /// Starts the far side as a process of this program.
    pub fn process(kind: &str, len: usize, run: u64) -> Self {
        let program = std::env::current_exe().expect("this program");
        let mut command = Command::new(program);
        command.args(["far", kind, &len.to_string(), &run.to_string(), &core().to_string()]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let output = BufReader::new(child.stdout.take().expect("it is piped"));
        let mut far = Far::Process(child, output);
        far.hear();
        far
    }

    /// Starts the far side as a thread.
    pub fn thread(mut wire: impl Wire + Send + 'static, len: usize) -> Self {
        let ((tell, told), (say, said)) = (channel(), channel());
        std::thread::spawn(move || {
            pin(core());
            while let Ok(count) = told.recv() {
                say.send(()).expect("this side waits");
                answer(&mut wire, len, count);
            }
        });
        Far::Thread(tell, said)
    }

    /// Makes the far side answer the next `count` groups, or perform its other task; returns when the far side is ready.
    pub fn tell(&mut self, count: u64) {
        match self {
            Far::Process(child, _) => {
                let input = child.stdin.as_mut().expect("it is piped");
                writeln!(input, "{count}").expect("it listens");
                self.hear();
            }
            Far::Thread(tell, said) => {
                tell.send(count).expect("it listens");
                said.recv().expect("it answers");
            }
        }
    }

    fn hear(&mut self) {
        if let Far::Process(_, output) = self {
            let mut line = String::new();
            output.read_line(&mut line).expect("it speaks");
            assert_eq!(line, "ready\n");
        }
    }
}

impl Drop for Far {
    fn drop(&mut self) {
        if let Far::Process(child, _) = self {
            drop(child.stdin.take());
            child.wait().expect("it ends with its input");
        }
    }
}

/// Answers `count` groups, each with an equal group.
fn answer(wire: &mut impl Wire, len: usize, count: u64) {
    let mut values = vec![0; len];
    for _ in 0..count {
        let number = loop {
            if let Some(number) = wire.poll(&mut values) {
                break number;
            }
            std::hint::spin_loop();
        };
        wire.send(number, &values);
    }
}

/// Runs the far process of a wire, which answers bursts until its input ends.
pub fn bursts(mut wire: impl Wire, len: usize) {
    commands(|count| answer(&mut wire, len, count));
}

/// Reports readiness before the first command and after each command, and carries out each command.
pub fn commands(mut carry_out: impl FnMut(u64)) {
    let ready = || {
        println!("ready");
        stdout().flush().expect("who started this process reads");
    };
    ready();
    for line in stdin().lock().lines() {
        ready();
        carry_out(line.expect("text").parse().expect("a number"));
    }
}
