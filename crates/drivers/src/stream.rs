// SPDX-License-Identifier: Apache-2.0
//! A stream of bytes to a device: a TCP connection or a serial line, whose address is a single string.
//!
//! `tcp/192.0.2.5:502` and `rtu//dev/ttyUSB0?baud=19200&parity=even&stop=1`; the prefix of a serial line depends on the driver.
use crate::serial::{Parity, SerialLine, Settings, is_overtime, wait};
use forks::Device;
use std::fmt;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::os::fd::AsFd;
use std::time::Instant;

/// Address of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Address {
    /// Host and port.
    Tcp(String),
    Serial {
        path: String,
        settings: Settings,
    },
}

impl Address {
    /// Parses an address. `serial` is the prefix of a serial line, `settings` contains its defaults, and `port` is the default TCP port.
    ///
    /// # Errors
    /// Returns a message that explains the format of an address.
    pub(crate) fn parse(text: &str, serial: &str, settings: Settings, port: Option<u16>) -> std::result::Result<Address, String> {
        if let Some(host) = text.strip_prefix("tcp/").filter(|host| !host.is_empty()) {
            let has_port = host.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
            return match port {
                _ if has_port => Ok(Address::Tcp(host.to_owned())),
                Some(port) => Ok(Address::Tcp(format!("{host}:{port}"))),
                None => Err(format!("'{text}' has no port; write tcp/192.0.2.5:4001")),
            };
        }
        let Some(line) = text.strip_prefix(serial).and_then(|rest| rest.strip_prefix('/')).filter(|path| path.starts_with('/')) else {
            return Err(format!("'{text}' is not an address; write tcp/192.0.2.5:502 or {serial}//dev/ttyUSB0?baud=19200&parity=even"));
        };
        let (path, words) = line.split_once('?').unwrap_or((line, ""));
        let mut set = settings;
        for word in words.split('&').filter(|word| !word.is_empty()) {
            let wrong = || format!("'{word}' in '{text}' is not a setting; write baud=19200, parity=none, even or odd, stop=1 or 2");
            match word.split_once('=').ok_or_else(wrong)? {
                ("baud", baud) => set.baud = baud.parse().ok().filter(|baud| *baud > 0).ok_or_else(wrong)?,
                ("parity", "none") => set.parity = Parity::None,
                ("parity", "even") => set.parity = Parity::Even,
                ("parity", "odd") => set.parity = Parity::Odd,
                ("stop", "1") => set.stop_bits = 1,
                ("stop", "2") => set.stop_bits = 2,
                _ => return Err(wrong()),
            }
        }
        Ok(Address::Serial { path: path.to_owned(), settings: set })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Address::Tcp(host) => f.write_str(host),
            Address::Serial { path, .. } => f.write_str(path),
        }
    }
}

/// An open stream.
#[derive(Debug)]
pub(crate) enum Stream {
    Tcp(Device<TcpStream>),
    Serial(SerialLine),
}

impl Stream {
    /// Connects, or opens the line.
    ///
    /// # Errors
    /// Fails if there is no answer by the deadline, or the line cannot be opened.
    pub(crate) fn open(address: &Address, deadline: Instant) -> Result<Stream> {
        match address {
            Address::Serial { path, settings } => SerialLine::open(path, settings).map(Stream::Serial),
            Address::Tcp(host) => {
                let left = deadline.saturating_duration_since(Instant::now()).max(std::time::Duration::from_millis(1));
                let to = host.to_socket_addrs()?.next().ok_or_else(|| Error::new(ErrorKind::NotFound, "there is no such host"))?;
                let connection = TcpStream::connect_timeout(&to, left)?;
                connection.set_nodelay(true)?;
                connection.set_nonblocking(true)?;
                Ok(Stream::Tcp(Device::new(connection)))
            }
        }
    }

    /// Reads like [`SerialLine::read`].
    ///
    /// # Errors
    /// Fails if the other end is lost.
    pub(crate) fn read(&self, buffer: &mut [u8], deadline: Instant) -> Result<usize> {
        if is_overtime(deadline) {
            return Ok(0);
        }
        match self {
            Stream::Serial(line) => line.read(buffer, deadline),
            Stream::Tcp(connection) => loop {
                match (&**connection).read(buffer) {
                    Ok(0) => return Err(Error::new(ErrorKind::UnexpectedEof, "the other end closed the connection")),
                    Err(why) if why.kind() == ErrorKind::WouldBlock => {}
                    Err(why) if why.kind() == ErrorKind::Interrupted => continue,
                    other => return other,
                }
                if !wait(connection.as_fd(), libc::POLLIN, deadline)? {
                    return Ok(0);
                }
            },
        }
    }

    /// Writes like [`SerialLine::write_all`].
    ///
    /// # Errors
    /// Fails if the other end is lost, or accepts nothing by the deadline.
    pub(crate) fn write_all(&self, mut bytes: &[u8], deadline: Instant) -> Result<()> {
        let connection = match self {
            Stream::Serial(line) => return line.write_all(bytes, deadline),
            Stream::Tcp(connection) => &**connection,
        };
        while !bytes.is_empty() {
            match { connection }.write(bytes) {
                Ok(taken) => bytes = &bytes[taken..],
                Err(why) if why.kind() == ErrorKind::Interrupted => {}
                Err(why) if why.kind() == ErrorKind::WouldBlock => {
                    if !wait(connection.as_fd(), libc::POLLOUT, deadline)? {
                        return Err(Error::new(ErrorKind::TimedOut, "the other end accepts no data"));
                    }
                }
                Err(why) => return Err(why),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn parse(text: &str) -> std::result::Result<Address, String> {
        Address::parse(text, "rtu", Settings { baud: 19_200, parity: Parity::Even, stop_bits: 1 }, Some(502))
    }

    #[test]
    fn who_reads_until_nothing_comes_ends_where_the_other_side_is_never_silent() {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let deadline = Instant::now();
        let long = deadline + Duration::from_secs(60);
        let stream = Stream::open(&Address::Tcp(listener.local_addr().unwrap().to_string()), long).unwrap();
        let mut babble = listener.accept().unwrap().0;
        let babbler = std::thread::spawn(move || while babble.write_all(&[0; 65_536]).is_ok() {});
        let mut buffer = [0; 64];
        assert!(stream.read(&mut buffer, long).unwrap() > 0);
        while stream.read(&mut buffer, deadline).unwrap() > 0 {}
        drop(stream);
        babbler.join().unwrap();
    }

    #[test]
    fn an_address_is_one_text() {
        assert_eq!(parse("tcp/192.0.2.5"), Ok(Address::Tcp("192.0.2.5:502".to_owned())));
        assert_eq!(parse("tcp/[::1]:1502"), Ok(Address::Tcp("[::1]:1502".to_owned())));
        let settings = Settings { baud: 9_600, parity: Parity::None, stop_bits: 2 };
        assert_eq!(parse("rtu//dev/ttyS0?baud=9600&parity=none&stop=2"), Ok(Address::Serial { path: "/dev/ttyS0".to_owned(), settings }));
        for wrong in ["192.0.2.5", "tcp/", "rtu/ttyS0", "rtu//dev/ttyS0?baud=0", "rtu//dev/ttyS0?speed=9600", "udp/x:1"] {
            let why = parse(wrong).expect_err(wrong);
            assert!(why.contains("write ") && why.contains(wrong.rsplit('?').next().unwrap_or(wrong)), "{why}");
        }
    }
}
