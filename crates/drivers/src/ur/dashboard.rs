// SPDX-License-Identifier: Apache-2.0
//! Dashboard of a controller, with one line per request and one line per answer. It is never called on the cycle.
use device::{DeviceError, Kind, ServiceWord, Services};
use forks::Device;
use serde_json::Value;
use std::io::{BufRead, BufReader, Error, ErrorKind, Read, Result, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Dashboard port of the controller.
pub(super) const PORT: u16 = 29999;
/// Time limit for an answer.
const WITHIN: Duration = Duration::from_secs(5);
/// Maximum length of an answer.
const LINE_LEN_MAX: u64 = 4096;

pub(super) struct Dashboard {
    stream: BufReader<Device<TcpStream>>,
}

impl Dashboard {
    /// Connects to the dashboard. `within` is the time limit for the connection and for each answer.
    pub fn connect(to: SocketAddr, within: Duration) -> Result<Dashboard> {
        // A timeout of 0 would mean none.
        let within = within.clamp(Duration::from_millis(1), WITHIN);
        let stream = Device::new(TcpStream::connect_timeout(&to, within)?);
        stream.set_read_timeout(Some(within))?;
        stream.set_write_timeout(Some(within))?;
        let mut dashboard = Dashboard { stream: BufReader::new(stream) };
        dashboard.line()?;
        Ok(dashboard)
    }

    /// Returns the answer to a command.
    pub fn ask(&mut self, command: &str) -> Result<String> {
        self.stream.get_mut().write_all(format!("{command}\n").as_bytes())?;
        self.line()
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        match self.stream.by_ref().take(LINE_LEN_MAX).read_line(&mut line)? {
            0 => Err(Error::new(ErrorKind::UnexpectedEof, "it closed the connection")),
            _ => Ok(line.trim().to_owned()),
        }
    }
}

const fn service(name: &'static str, doc: &'static str) -> ServiceWord {
    ServiceWord { name, doc, arguments: &[], answer: Some(Kind::Text), moves: false }
}

/// Services, each with its commands.
const ASKED: [(ServiceWord, &[&str]); 7] = [
    (
        service("unlock_protective_stop", "releases a protective stop; the controller refuses this for the first 5 s"),
        &["close safety popup", "unlock protective stop"],
    ),
    (service("power_on", "powers the arm on and releases its brakes"), &["power on", "brake release"]),
    (service("power_off", "powers the arm off; its brakes hold it"), &["power off"]),
    (service("restart_safety", "restarts the safety system after a violation or a fault; the arm is powered off"), &["close safety popup", "restart safety"]),
    (service("close_popups", "closes the popup on the pendant"), &["close popup", "close safety popup"]),
    (service("mode", "state of the arm as the controller reports it"), &["robotmode"]),
    (service("safety", "state of the safety system as the controller reports it"), &["safetystatus"]),
];

pub(super) static SERVICES: [ServiceWord; 7] = [ASKED[0].0, ASKED[1].0, ASKED[2].0, ASKED[3].0, ASKED[4].0, ASKED[5].0, ASKED[6].0];

/// The dashboard as the services of a driver. Each call uses a separate connection, so that it works even while the arm is lost.
pub(super) struct Panel {
    pub to: SocketAddr,
}

impl Services for Panel {
    fn call(&self, service: &str, _: &Value) -> std::result::Result<Value, DeviceError> {
        let (_, commands) =
            ASKED.iter().find(|(word, _)| word.name == service).ok_or_else(|| DeviceError { message: format!("there is no service '{service}'") })?;
        let failed = |why: Error| DeviceError { message: format!("the dashboard at {} did not answer: {why}", self.to) };
        let mut dashboard = Dashboard::connect(self.to, WITHIN).map_err(failed)?;
        let mut answer = String::new();
        for command in *commands {
            answer = dashboard.ask(command).map_err(failed)?;
        }
        let is_refused = ["Cannot", "Failed", "could not understand"].iter().any(|word| answer.contains(word));
        if is_refused { Err(DeviceError { message: format!("the controller refuses: {answer}") }) } else { Ok(Value::String(answer)) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;
    use std::thread::JoinHandle;

    /// Creates a dashboard that answers each command with the same line. Its thread returns the commands.
    fn dashboard(answer: &'static str) -> (Panel, JoinHandle<Vec<String>>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let to = listener.local_addr().unwrap();
        let served = std::thread::spawn(move || {
            let mut stream = BufReader::new(listener.accept().unwrap().0);
            stream.get_mut().write_all(b"Connected\n").unwrap();
            let (mut asked, mut line) = (Vec::new(), String::new());
            while stream.read_line(&mut line).unwrap() > 0 {
                asked.push(std::mem::take(&mut line).trim().to_owned());
                stream.get_mut().write_all(format!("{answer}\n").as_bytes()).unwrap();
            }
            asked
        });
        (Panel { to }, served)
    }

    #[test]
    fn a_service_is_its_commands_and_answers_with_the_last_ones_answer() {
        let (panel, served) = dashboard("Protective stop releasing");
        assert_eq!(panel.call("unlock_protective_stop", &Value::Null).unwrap(), "Protective stop releasing");
        assert_eq!(served.join().unwrap(), ["close safety popup", "unlock protective stop"]);
    }

    #[test]
    fn what_the_controller_refuses_is_an_error_with_its_words() {
        let (panel, served) = dashboard("Cannot unlock protective stop until 5s after occurrence");
        let why = panel.call("unlock_protective_stop", &Value::Null).unwrap_err();
        assert_eq!(why.message, "the controller refuses: Cannot unlock protective stop until 5s after occurrence");
        served.join().unwrap();
        let nobody = panel.call("mode", &Value::Null).unwrap_err();
        assert!(nobody.message.contains("did not answer"), "{}", nobody.message);
    }
}
