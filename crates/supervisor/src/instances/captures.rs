// SPDX-License-Identifier: Apache-2.0
//! Values of outputs in one start: what has been captured, and what scripts under way still capture.
use crate::instances::installed_verb::InstalledVerb;
use kernel::SourceId;

/// Piece of an output that is read at once: all of it, or one element if a port's elements are cells of their own, as each of them is
/// where it is written.
pub(crate) type Piece = (usize, usize);

/// Outputs as far as they have been captured. An output of several cells comes in pieces, as these may lie in several sources.
#[derive(Default)]
pub(crate) struct Captures {
    taken: Vec<(Piece, Vec<u8>)>,
    /// Pieces that the script under way captures in each source, in order.
    pending: Vec<(SourceId, Vec<Piece>)>,
}

impl Captures {
    /// Returns true if a script under way captures anything.
    pub fn is_pending(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Removes what has been captured already.
    pub fn keep_missing(&self, pieces: &mut Vec<Piece>) {
        pieces.retain(|piece| self.bytes(*piece).is_none());
    }

    /// Expects a script for `source` that captures these pieces.
    pub fn expect(&mut self, source: SourceId, pieces: Vec<Piece>) {
        if !pieces.is_empty() {
            self.pending.push((source, pieces));
        }
    }

    /// Expects no more captures.
    pub fn expect_nothing(&mut self) {
        self.pending.clear();
    }

    /// Forgets the values of these outputs, which are out of date.
    pub fn forget(&mut self, outputs: &[usize]) {
        self.taken.retain(|((output, _), _)| !outputs.contains(output));
    }

    /// Takes the bytes of pieces that were captured one behind the other.
    pub fn take(&mut self, of: &InstalledVerb, pieces: &[Piece], mut bytes: &[u8]) {
        for &piece in pieces {
            let Some((part, rest)) = bytes.split_at_checked(of.piece_len(piece)) else { return };
            self.taken.push((piece, part.to_vec()));
            bytes = rest;
        }
    }

    /// Takes what the scripts under way have captured in each source; none is under way then.
    pub fn take_scripts(&mut self, of: &InstalledVerb, captured: Vec<(SourceId, Vec<u8>)>) {
        let pending = std::mem::take(&mut self.pending);
        for (source, bytes) in captured {
            if let Some((_, pieces)) = pending.iter().find(|(asked, _)| *asked == source) {
                self.take(of, pieces, &bytes);
            }
        }
    }

    /// Returns the bytes of an output all of whose pieces have been captured.
    pub fn whole(&self, of: &InstalledVerb, output: usize) -> Option<Vec<u8>> {
        (0..of.parts(output)).map(|part| self.bytes((output, part))).collect::<Option<Vec<_>>>().map(|pieces| pieces.concat())
    }

    fn bytes(&self, of: Piece) -> Option<&[u8]> {
        self.taken.iter().find(|(piece, _)| *piece == of).map(|(_, bytes)| bytes.as_slice())
    }
}
