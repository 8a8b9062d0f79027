// SPDX-License-Identifier: Apache-2.0
//! Serves a system over the control interface, and edits the token file. This module only converts.
use crate::convert::{from_json, interpreter, refused, to_json};
use crate::system::System;
use api::Role;
use control::{Options, Server};
use daemon::{Watcher, tokens};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

/// Maximum time for which a server runs without checking for signals.
const LOOK: Duration = Duration::from_millis(50);

/// Receives a daemon's messages while its journal is replayed, and aborts the replay if a signal raises an exception.
struct Starting {
    tell: Py<PyAny>,
    ended: Option<PyErr>,
}

impl Watcher for Starting {
    fn tell(&mut self, text: &str) {
        let told = Python::attach(|py| self.tell.call1(py, (text,)).map(|_| ()));
        self.ended = self.ended.take().or(told.err());
    }

    fn goes_on(&mut self) -> bool {
        if self.ended.is_none() {
            self.ended = Python::attach(|py| py.check_signals()).err();
        }
        self.ended.is_none()
    }
}

/// A system in this process, served by separate threads until the server is stopped.
#[pyclass(name = "Server", frozen, module = "opengpac._native")]
pub struct SystemServer(Mutex<Server>);

#[pymethods]
impl SystemServer {
    #[new]
    fn new(py: Python<'_>, system: &System, options_json: &str) -> PyResult<SystemServer> {
        let mut options: Options = from_json(options_json)?;
        options.python = Some(interpreter(py)?);
        let shared = system.shared();
        let server = py.detach(|| Server::start(shared, &options)).map_err(refused)?;
        Ok(SystemServer(Mutex::new(server)))
    }

    fn addresses(&self) -> Vec<String> {
        self.server().addresses().to_vec()
    }

    fn studio(&self) -> Option<String> {
        self.server().studio().map(str::to_owned)
    }

    fn stop(&self, py: Python<'_>) {
        py.detach(|| self.server().stop());
    }
}

impl SystemServer {
    fn server(&self) -> MutexGuard<'_, Server> {
        self.0.lock().expect("nobody panics with this lock")
    }
}

/// Serves a system until a signal raises an exception. `tell` receives messages about the replay of the journal, then `ready` is called
/// with the addresses. Whenever `rereads` returns true, the server reopens its files and reports this through `tell`.
#[pyfunction]
pub fn serve(py: Python<'_>, system: &System, options_json: &str, tell: Py<PyAny>, ready: &Bound<'_, PyAny>, rereads: &Bound<'_, PyAny>) -> PyResult<()> {
    let mut options: Options = from_json(options_json)?;
    options.python = Some(interpreter(py)?);
    let shared = system.shared();
    let mut starting = Starting { tell: tell.clone_ref(py), ended: None };
    let started = py.detach(|| Server::start_watched(shared, &options, &mut starting));
    if let Some(ended) = starting.ended {
        return Err(ended);
    }
    let mut server = started.map_err(refused)?;
    let mut looked = ready.call1((server.addresses().to_vec(), server.studio())).map(|_| ());
    while looked.is_ok() {
        py.detach(|| std::thread::sleep(LOOK));
        looked = py.check_signals().and_then(|()| reread(py, &server, &tell, rereads));
    }
    py.detach(|| server.stop());
    looked
}

/// Reopens a server's files if requested.
fn reread(py: Python<'_>, server: &Server, tell: &Py<PyAny>, rereads: &Bound<'_, PyAny>) -> PyResult<()> {
    if rereads.call0()?.is_truthy()? {
        for text in py.detach(|| server.reread()) {
            tell.call1(py, (text,))?;
        }
    }
    Ok(())
}

/// Returns the default path of a system's Unix socket.
#[pyfunction]
pub fn socket_path(name: &str) -> String {
    control::default_path(name).display().to_string()
}

/// Creates a token and adds it to the file; if a client certificate is passed, adds its holder instead and returns an empty string.
#[pyfunction]
#[pyo3(signature = (path, name, role, expires=None, certificate=None))]
pub fn token_new(path: PathBuf, name: &str, role: &str, expires: Option<u64>, certificate: Option<PathBuf>) -> PyResult<String> {
    let role: Role = role.parse().map_err(PyValueError::new_err)?;
    let Some(certificate) = certificate else { return tokens::add(&path, name, role, expires).map_err(os_error) };
    let first = control::certificates(&certificate).map_err(refused)?.into_iter().next().ok_or_else(|| PyValueError::new_err("there is no certificate"))?;
    tokens::add_certificate(&path, name, role, expires, control::fingerprint(&first)).map_err(os_error)?;
    Ok(String::new())
}

/// Returns every entry of the token file as JSON, without the tokens themselves.
#[pyfunction]
pub fn token_list(path: PathBuf) -> PyResult<String> {
    to_json(&tokens::list(&path).map_err(os_error)?)
}

/// Revokes the entry with this name; returns false if it does not exist.
#[pyfunction]
pub fn token_revoke(path: PathBuf, name: &str) -> PyResult<bool> {
    tokens::revoke(&path, name).map_err(os_error)
}

fn os_error(why: std::io::Error) -> PyErr {
    PyOSError::new_err(why.to_string())
}
