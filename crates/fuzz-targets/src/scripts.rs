// SPDX-License-Identifier: Apache-2.0
//! Fuzz targets for orders to a remote processor and its reports: frames, and the scripts and tables in them.
use interconnect::{Carrier, Memory, Receiver, Sender};
use kernel::{Device, Way};
use opengpac::abi::Descriptor;
use opengpac::read::{BlockFace, TypeFace};
use rtp::protocol::{News, Order, frame, opened};
use runtime::encoding::{CodeName, Ground, Parcel, Reader};
use std::any::Any;
use std::collections::HashMap;
use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

/// Fuzzes one frame to or from a processor. Checks that a decoded frame is encoded and decoded again as the same frame.
pub(crate) fn frames(bytes: &[u8]) {
    again::<Order>(bytes);
    again::<News>(bytes);
}

fn again<T: serde::Serialize + serde::de::DeserializeOwned + Debug>(bytes: &[u8]) {
    let Ok(first) = opened::<T>(bytes) else { return };
    let second: T = opened(&frame(&first)).expect("what was written can be read");
    assert_eq!(format!("{first:?}"), format!("{second:?}"));
}

/// Fuzzes consecutive parcels of one host, each preceded by its two-byte length. Checks that the reader refuses inconsistent parcels with
/// a message, and that the scripts that it creates can be dropped.
pub(crate) fn parcels(mut bytes: &[u8]) {
    let (mut reader, mut ground) = (Reader::default(), Library);
    let mut scripts = Vec::new();
    for submission in 0.. {
        let [low, high, rest @ ..] = bytes else { break };
        let (parcel, after) = rest.split_at(rest.len().min(usize::from(u16::from_le_bytes([*low, *high]))));
        bytes = after;
        let Ok(parcel) = opened::<Parcel>(parcel) else { continue };
        match reader.open(submission, parcel, &mut ground) {
            Ok(script) => scripts.push(script),
            Err(message) => assert!(!message.is_empty()),
        }
    }
    drop(reader);
    drop(scripts);
}

/// Ground with the blocks of the library, no devices, and connections in memory.
struct Library;

type Keeper = Arc<dyn Any + Send + Sync>;

impl Ground for Library {
    fn code(&self, name: &CodeName) -> Option<(&'static Descriptor, Keeper)> {
        static BLOCKS: OnceLock<HashMap<String, &'static Descriptor>> = OnceLock::new();
        let blocks = BLOCKS.get_or_init(|| {
            let types: Vec<TypeFace> = library::types().iter().filter_map(|of| TypeFace::read(of).ok()).collect();
            let faces = library::blocks().into_iter().filter_map(|of| BlockFace::read(of, &types).ok());
            faces.map(|face| (face.name.clone(), face.descriptor)).collect()
        });
        blocks.get(&name.block).map(|descriptor| (*descriptor, Arc::new(()) as Keeper))
    }

    fn device(&self, _: &str) -> Option<Arc<Device>> {
        None
    }

    fn sender(&mut self, way: &Way) -> Box<dyn Sender> {
        Memory.connect(&way.spec).0
    }

    fn receiver(&mut self, way: &Way) -> Box<dyn Receiver> {
        Memory.connect(&way.spec).1
    }
}
