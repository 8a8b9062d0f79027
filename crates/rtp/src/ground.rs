// SPDX-License-Identifier: Apache-2.0
//! What scripts stand on where they run: code, devices, connections.
use crate::agent::Reaches;
use crate::module::{LIBRARY, Module};
use interconnect::{Carrier, Full, Header, Memory, Receiver, Sender};
use kernel::wire::{CodeName, Ground};
use kernel::{Device, Event, Host, Reach, SourceId, Way};
use modules::{LoadOptions, Probe};
use opengpac::abi::Descriptor;
use opengpac::read::{BlockFace, TypeFace};
use std::any::Any;
use std::collections::HashMap;
use std::sync::Arc;

type Keeper = Arc<dyn Any + Send + Sync>;

/// The code, devices and connections of one processor.
pub(crate) struct Grounds {
    code: HashMap<CodeName, (&'static Descriptor, Keeper)>,
    pub devices: HashMap<String, Arc<Device>>,
    reaches: Reaches,
    /// The other ends of connections within this process.
    senders: HashMap<u64, Box<dyn Sender>>,
    receivers: HashMap<u64, Box<dyn Receiver>>,
    host: Arc<Host>,
    probe: Probe,
}

impl Grounds {
    pub fn new(host: Arc<Host>, reaches: Reaches, probe: Probe) -> Grounds {
        let mut grounds = Grounds { code: HashMap::new(), devices: HashMap::new(), reaches, senders: HashMap::new(), receivers: HashMap::new(), host, probe };
        let types: Vec<TypeFace> = library::types().iter().filter_map(|of| TypeFace::read(of).ok()).collect();
        let faces: Vec<BlockFace> = library::blocks().iter().filter_map(|of| BlockFace::read(of, &types).ok()).collect();
        grounds.enter(LIBRARY, &faces, &(Arc::new(Module::library()) as Keeper));
        grounds
    }

    /// Loads a module from its bytes. Errors: what is wrong with it, in words.
    pub fn load(&mut self, key: &str, name: &str, bytes: &[u8]) -> Result<(), String> {
        let module = Module::new(name, bytes.into());
        if module.key() != key {
            return Err(format!("module '{name}' is damaged: it has changed on its way"));
        }
        if self.code.keys().any(|known| known.module == key) {
            return Ok(());
        }
        let file = private_file(name, bytes).map_err(|why| format!("module '{name}' cannot be kept: {why}"))?;
        let loaded = modules::load(&file, &LoadOptions { probe: self.probe.clone(), ..LoadOptions::default() });
        // It has been loaded from a copy, or not at all.
        let _removed = file.parent().map(std::fs::remove_dir_all);
        let loaded = loaded.map_err(|why| why.to_string())?;
        self.enter(key, &loaded.blocks, &(Arc::new(module) as Keeper));
        Ok(())
    }

    fn enter(&mut self, key: &str, faces: &[BlockFace], keeper: &Keeper) {
        for face in faces {
            self.code.insert(CodeName { module: key.to_owned(), block: face.name.clone() }, (face.descriptor, keeper.clone()));
        }
    }

    fn ends(&mut self, way: &Way) -> Result<&mut Box<dyn interconnect::Ends>, String> {
        let (ends, what) = match way.reach {
            Reach::Host => (&mut self.reaches.host, "other processes"),
            _ => (&mut self.reaches.network, "other hosts"),
        };
        ends.as_mut().ok_or_else(|| format!("this processor has no connection to {what}"))
    }

    fn unconnected(&self, way: &Way, message: String) {
        self.host.tell(Event::Unconnected { writer: SourceId(way.spec.writer), reader: SourceId(way.spec.reader), message });
    }
}

impl Ground for Grounds {
    fn code(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)> {
        self.code.get(name).cloned()
    }

    fn device(&self, name: &str) -> Option<Arc<Device>> {
        self.devices.get(name).cloned()
    }

    fn sender(&mut self, way: &Way) -> Box<dyn Sender> {
        if way.reach == Reach::Process {
            return self.senders.remove(&way.number).unwrap_or_else(|| {
                let (sender, receiver) = Memory.connect(&way.spec);
                self.receivers.insert(way.number, receiver);
                sender
            });
        }
        let made = self.ends(way).and_then(|ends| ends.sender(way.number, &way.spec).map_err(|why| why.message));
        made.unwrap_or_else(|message| {
            self.unconnected(way, message);
            Box::new(Nowhere(vec![0; way.spec.asynchronous_len]))
        })
    }

    fn receiver(&mut self, way: &Way) -> Box<dyn Receiver> {
        if way.reach == Reach::Process {
            return self.receivers.remove(&way.number).unwrap_or_else(|| {
                let (sender, receiver) = Memory.connect(&way.spec);
                self.senders.insert(way.number, sender);
                receiver
            });
        }
        let raise = self.host.raiser_of(SourceId(way.spec.reader));
        let made = self.ends(way).and_then(|ends| ends.receiver(way.number, &way.spec, raise).map_err(|why| why.message));
        made.unwrap_or_else(|message| {
            self.unconnected(way, message);
            Box::new(Nowhere(vec![0; way.spec.asynchronous_len]))
        })
    }
}

/// A file of its own folder, which only this user reads.
fn private_file(name: &str, bytes: &[u8]) -> std::io::Result<std::path::PathBuf> {
    use std::os::unix::fs::DirBuilderExt;
    static COUNT: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(0);
    let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("opengpac-rtp-{}-{number}", std::process::id()));
    std::fs::DirBuilder::new().mode(0o700).create(&folder)?;
    let file = folder.join(format!("{name}.so"));
    std::fs::write(&file, bytes)?;
    Ok(file)
}

/// The end of a connection that could not be made: nothing goes, nothing comes. That it could not was told.
struct Nowhere(Vec<u8>);

impl Sender for Nowhere {
    fn group(&mut self) -> &mut [u8] {
        &mut self.0
    }

    fn publish(&mut self, _number: u64, _now_ns: i64) {}

    fn push(&mut self, _number: u64, _now_ns: i64, _fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Full> {
        Err(Full)
    }

    fn arrived(&self) -> bool {
        false
    }
}

impl Receiver for Nowhere {
    fn latch(&mut self, _now_ns: i64) -> Option<Header> {
        None
    }

    fn group(&self) -> &[u8] {
        &self.0
    }

    fn peek_row(&mut self) -> Option<(u64, &[u8])> {
        None
    }

    fn pop_row(&mut self) -> bool {
        false
    }

    fn rows(&self) -> usize {
        0
    }
}
