// SPDX-License-Identifier: Apache-2.0
//! A minimal client of a control interface, which can send anything and reads every response.
use serde_json::Value as Json;
use std::io::{ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::Duration;

/// Time limit for an answer. Only calls that hang exceed it, even if fifty other processes compete for the cores.
const ANSWER: Duration = Duration::from_secs(240);
/// Time for which subscriptions are read.
const LISTEN: Duration = Duration::from_millis(4);

const TEXT: u8 = 1;
const CLOSE: u8 = 8;
const PING: u8 = 9;
const PONG: u8 = 10;

/// Path at which the interface listens.
pub(crate) struct Socket(pub PathBuf);

/// Answer to a request; the body is null if it was empty.
pub(crate) struct Answer {
    pub status: u16,
    pub body: Json,
}

impl Socket {
    fn connect(&self) -> UnixStream {
        let stream = UnixStream::connect(&self.0).expect("it listens");
        stream.set_read_timeout(Some(ANSWER)).expect("a time above zero");
        stream
    }

    /// Makes one request, which must be answered.
    pub fn request(&self, method: &str, path: &str, session: Option<&str>, body: &[u8]) -> Answer {
        let mut stream = self.connect();
        let session = session.map_or_else(String::new, |session| format!("opengpac-session: {session}\r\n"));
        let head = format!("{method} {path} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\ncontent-length: {}\r\n{session}\r\n", body.len());
        // A refusal may arrive before the whole request has been sent.
        let _said = stream.write_all(&[head.as_bytes(), body].concat());
        let mut told = Vec::new();
        stream.read_to_end(&mut told).unwrap_or_else(|why| panic!("{method} {path} is not answered: {why}"));
        let text = String::from_utf8(told).expect("an answer is text");
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or_else(|| panic!("{method} {path} is answered with {text:?}"));
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or_else(|| panic!("{head:?} has no status"));
        let body = if body.is_empty() { Json::Null } else { serde_json::from_str(body).unwrap_or_else(|why| panic!("{path}: {why}: {body:?}")) };
        Answer { status, body }
    }

    /// Sends bytes unchanged. Checks that the answer, if there is one, is HTTP.
    pub fn raw(&self, bytes: &[u8]) {
        // Compilation is not fuzzed here.
        if bytes.windows(3).any(|window| window == b"PUT") {
            return;
        }
        let mut stream = self.connect();
        let _said = stream.write_all(bytes).and_then(|()| stream.shutdown(Shutdown::Write));
        let mut told = Vec::new();
        match stream.read_to_end(&mut told) {
            Err(why) if matches!(why.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => panic!("a connection that says no more is not closed"),
            _ => assert!(told.is_empty() || told.starts_with(b"HTTP/1."), "{told:?}"),
        }
    }

    /// Opens a stream and sends one frame per line; returns the texts received.
    pub fn stream(&self, lines: &[u8]) -> Vec<Json> {
        let mut stream = self.connect();
        let upgrade = b"GET /v1/stream HTTP/1.1\r\nhost: localhost\r\nconnection: upgrade\r\nupgrade: websocket\r\n\
            sec-websocket-version: 13\r\nsec-websocket-key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n";
        stream.write_all(upgrade).expect("it takes the request");
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).expect("it is answered");
            head.push(byte[0]);
        }
        assert!(head.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&head));
        let frames = lines.split(|byte| *byte == b'\n').map(|line| framed(TEXT, line));
        // A frame that is not text ends the stream, so later frames are not taken.
        let _said = frames.chain([framed(PING, b"")]).try_for_each(|frame| stream.write_all(&frame));
        let mut texts = Vec::new();
        while let Some((kind, payload)) = received(&mut stream) {
            match kind {
                TEXT => texts.push(serde_json::from_slice(&payload).unwrap_or_else(|why| panic!("{why}: {}", String::from_utf8_lossy(&payload)))),
                // All frames were taken; subscriptions have sent their values, or send them now.
                PONG => stream.set_read_timeout(Some(LISTEN)).expect("a time above zero"),
                CLOSE => break,
                _ => {}
            }
        }
        let _said = stream.write_all(&framed(CLOSE, b""));
        texts
    }
}

/// Returns a complete client frame, with a mask of zeros.
fn framed(kind: u8, payload: &[u8]) -> Vec<u8> {
    let len = u16::try_from(payload.len()).unwrap_or(u16::MAX);
    let mut frame = vec![0x80 | kind, 0x80 | 126];
    // A control frame has its length in the second byte.
    if kind == TEXT {
        frame.extend(len.to_be_bytes())
    } else {
        frame[1] = 0x80
    }
    frame.extend([0; 4]);
    frame.extend(&payload[..if kind == TEXT { usize::from(len) } else { 0 }]);
    frame
}

/// Returns the next frame from the server; `None` after the last one.
fn received(stream: &mut UnixStream) -> Option<(u8, Vec<u8>)> {
    let mut head = [0; 2];
    stream.read_exact(&mut head).ok()?;
    let len = match head[1] & 0x7f {
        126 => {
            let mut len = [0; 2];
            stream.read_exact(&mut len).ok()?;
            usize::from(u16::from_be_bytes(len))
        }
        127 => {
            let mut len = [0; 8];
            stream.read_exact(&mut len).ok()?;
            usize::try_from(u64::from_be_bytes(len)).ok()?
        }
        short => usize::from(short),
    };
    let mut payload = vec![0; len];
    stream.read_exact(&mut payload).ok()?;
    Some((head[0] & 0x0f, payload))
}
