// SPDX-License-Identifier: Apache-2.0
//! A driver served as by the kernel: readings and commands by name.
#![allow(dead_code)]
use device::{Direction, Driver};
use serde_json::{Value, json};
use std::path::PathBuf;

pub struct Machine {
    pub driver: Box<dyn Driver>,
    pub about: Value,
    readings: Vec<u8>,
    commands: Vec<u8>,
}

impl Machine {
    pub fn open(kind: &str, options: Value) -> Machine {
        let mut machine = Machine::made(kind, options);
        machine.driver.open(0).unwrap_or_else(|e| panic!("{}", e.message));
        machine
    }

    /// Makes a machine without opening it.
    pub fn made(kind: &str, options: Value) -> Machine {
        let (driver, about) = drivers::open(kind, &options).unwrap_or_else(|e| panic!("{e}"));
        let size = |direction| driver.channels().iter().filter(|c| c.direction == direction).map(|c| c.offset + c.len).max().unwrap_or(0);
        let (readings, commands) = (vec![0; size(Direction::Read)], vec![0; size(Direction::Write)]);
        Machine { driver, about, readings, commands }
    }

    pub fn read(&mut self, release_ns: i64) {
        self.try_read(release_ns).unwrap_or_else(|e| panic!("{e}"));
    }

    pub fn try_read(&mut self, release_ns: i64) -> Result<(), String> {
        self.driver.read(release_ns, &mut self.readings).map_err(|e| e.message)
    }

    pub fn write(&mut self, release_ns: i64, engaged: &[bool]) {
        self.driver.write(release_ns, &self.commands, engaged).unwrap_or_else(|e| panic!("{}", e.message));
    }

    pub fn try_write(&mut self, release_ns: i64, engaged: &[bool]) -> Result<(), String> {
        self.driver.write(release_ns, &self.commands, engaged).map_err(|e| e.message)
    }

    pub fn get(&self, name: &str) -> Vec<f64> {
        let channel = self.driver.channels().iter().find(|c| c.name == name && c.direction == Direction::Read).unwrap_or_else(|| panic!("no channel {name}"));
        self.readings[channel.offset..channel.offset + channel.len].chunks(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect()
    }

    pub fn set(&mut self, name: &str, values: &[f64]) {
        let channel = self.driver.channels().iter().find(|c| c.name == name && c.direction == Direction::Write).unwrap_or_else(|| panic!("no channel {name}"));
        for (i, value) in values.iter().enumerate() {
            let place = channel.offset + 8 * i;
            self.commands[place..place + 8].copy_from_slice(&value.to_ne_bytes());
        }
    }

    pub fn set_bool(&mut self, name: &str, value: bool) {
        let channel = self.driver.channels().iter().find(|c| c.name == name && c.direction == Direction::Write).unwrap_or_else(|| panic!("no channel {name}"));
        self.commands[channel.offset] = u8::from(value);
    }

    pub fn readings(&self) -> &[u8] {
        &self.readings
    }
}

/// Returns the path of a model in the Python package.
pub fn robot(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../python/opengpac/robots").join(file)
}

/// Writes a file of this test run with this text.
pub fn scratch(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}_{}.xml", std::process::id()));
    std::fs::write(&path, text).expect("the scratch folder can be written");
    path
}

/// Runs `test` with the library that `OPENGPAC_MUJOCO` names; without it, checks that the driver explains how to get one.
pub fn with_mujoco(test: impl FnOnce(PathBuf)) {
    match std::env::var_os("OPENGPAC_MUJOCO") {
        Some(library) => test(library.into()),
        None => {
            let error = drivers::open("mujoco", &json!({ "path": robot("ur5e.xml") })).err().expect("there is no library").to_string();
            assert!(error.contains("pip install mujoco") && error.contains("OPENGPAC_MUJOCO"), "{error}");
        }
    }
}
