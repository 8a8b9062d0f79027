// SPDX-License-Identifier: Apache-2.0
//! Output values of a start: values already captured, and captures that running scripts will deliver.
use crate::instances::installed_verb::InstalledVerb;
use kernel::SourceId;

/// Piece of an output that is read at once: the whole output, or one element if the elements of a port are separate cells, each in the
/// source that writes it.
pub(crate) type Piece = (usize, usize);

/// Outputs captured so far. An output that consists of several cells is captured in pieces, because the cells may be in several sources.
#[derive(Default)]
pub(crate) struct Captures {
    taken: Vec<(Piece, Vec<u8>)>,
    /// Pieces that the running script captures in each source, in order.
    pending: Vec<(SourceId, Vec<Piece>)>,
}

impl Captures {
    /// Returns true if a running script captures outputs.
    pub fn is_pending(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Removes pieces that have already been captured.
    pub fn keep_missing(&self, pieces: &mut Vec<Piece>) {
        pieces.retain(|piece| self.bytes(*piece).is_none());
    }

    /// Registers a script for `source` that will capture these pieces.
    pub fn expect(&mut self, source: SourceId, pieces: Vec<Piece>) {
        if !pieces.is_empty() {
            self.pending.push((source, pieces));
        }
    }

    /// Cancels all expected captures.
    pub fn expect_nothing(&mut self) {
        self.pending.clear();
    }

    /// Discards the values of these outputs because they are outdated.
    pub fn forget(&mut self, outputs: &[usize]) {
        self.taken.retain(|((output, _), _)| !outputs.contains(output));
    }

    /// Stores the bytes of pieces that were captured consecutively.
    pub fn take(&mut self, of: &InstalledVerb, pieces: &[Piece], bytes: &[u8]) {
        self.taken.extend(pieces_in(of, pieces, bytes).map(|(piece, part)| (piece, part.to_vec())));
    }

    /// Stores the bytes of pieces that were captured consecutively, but only for the given outputs.
    pub fn take_of(&mut self, of: &InstalledVerb, pieces: &[Piece], bytes: &[u8], outputs: &[usize]) {
        let wanted = pieces_in(of, pieces, bytes).filter(|((output, _), _)| outputs.contains(output));
        self.taken.extend(wanted.map(|(piece, part)| (piece, part.to_vec())));
    }

    /// Stores the values that the running scripts have captured in each source; no scripts are running afterwards.
    pub fn take_scripts(&mut self, of: &InstalledVerb, captured: Vec<(SourceId, Vec<u8>)>) {
        let pending = std::mem::take(&mut self.pending);
        for (source, bytes) in captured {
            if let Some((_, pieces)) = pending.iter().find(|(asked, _)| *asked == source) {
                self.take(of, pieces, &bytes);
            }
        }
    }

    /// Returns the bytes of an output if all its pieces have been captured.
    pub fn whole(&self, of: &InstalledVerb, output: usize) -> Option<Vec<u8>> {
        (0..of.parts(output)).map(|part| self.bytes((output, part))).collect::<Option<Vec<_>>>().map(|pieces| pieces.concat())
    }

    fn bytes(&self, of: Piece) -> Option<&[u8]> {
        self.taken.iter().find(|(piece, _)| *piece == of).map(|(_, bytes)| bytes.as_slice())
    }
}

/// Splits bytes that were captured consecutively into the pieces; ends at the first piece that is not whole.
fn pieces_in<'a>(of: &InstalledVerb, pieces: &[Piece], mut bytes: &'a [u8]) -> impl Iterator<Item = (Piece, &'a [u8])> {
    pieces.iter().map_while(move |&piece| {
        let (part, rest) = bytes.split_at_checked(of.piece_len(piece))?;
        bytes = rest;
        Some((piece, part))
    })
}
