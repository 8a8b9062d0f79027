// SPDX-License-Identifier: Apache-2.0
//! Converts the block descriptions of a code module to interfaces for the model.
use indexmap::IndexMap;
use model::interface::{Interface, Item, Kind, Mode};
use opengpac::read::{self, BlockFace, ItemFace};

/// Returns the interface of a module's block.
pub(crate) fn interface(module: &str, face: &BlockFace, types: &IndexMap<String, String>) -> Interface {
    Interface {
        name: format!("{module}.{}", face.name),
        doc: face.doc.clone(),
        items: face.items.iter().map(item).collect(),
        types: types.clone(),
        file: face.file.clone(),
        line: face.line,
    }
}

fn item(face: &ItemFace) -> Item {
    let (least, most) = face.limits.unwrap_or((0, 0));
    let (unit, unit_of, range) = Item::declared_unit(&face.unit);
    Item {
        name: face.name.clone(),
        kind: kind(face.kind),
        mode: match face.mode {
            read::Mode::Synchronous => Mode::Synchronous,
            read::Mode::Ratio(n) => Mode::Ratio(n),
            read::Mode::Asynchronous => Mode::Asynchronous,
        },
        type_text: face.type_text.clone(),
        unit,
        unit_of,
        range,
        doc: face.doc.clone(),
        has_default: face.has_default,
        nonfinite: face.nonfinite,
        sized: face.sized,
        history: face.history,
        default: face.initial.clone(),
        least,
        most,
    }
}

fn kind(kind: read::Kind) -> Kind {
    match kind {
        read::Kind::Input => Kind::Input,
        read::Kind::Output => Kind::Output,
        read::Kind::DeviceRead => Kind::DeviceRead,
        read::Kind::DeviceWrite => Kind::DeviceWrite,
        read::Kind::Condition => Kind::Condition,
        read::Kind::Parameter => Kind::Parameter,
        read::Kind::State => Kind::State,
        read::Kind::Size => Kind::Size,
    }
}
