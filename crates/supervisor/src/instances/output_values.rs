// SPDX-License-Identifier: Apache-2.0
//! ω: locations of an instance's output values, and the values that are read in each source when a condition occurs.
use crate::instances::captures::Piece;
use crate::instances::installed_verb::InstalledVerb;
use crate::movements::sequence::Builder;
use indexmap::IndexMap;
use kernel::{Op, SourceId};
use model::plan::Target;
use model::types::Type;
use model::value::Value;

impl InstalledVerb<'_> {
    /// Returns the pieces of a condition's outputs that are located in `source`.
    pub fn outputs_in(&self, source: SourceId, condition: usize) -> Vec<Piece> {
        let mut pieces = self.pieces(condition);
        pieces.retain(|piece| self.piece_source(*piece) == source);
        pieces
    }

    /// Returns the pieces of a condition's outputs, in order.
    pub fn pieces(&self, condition: usize) -> Vec<Piece> {
        let Some(condition) = self.plan.conditions.get(condition) else { return Vec::new() };
        condition.returns.iter().flat_map(|output| (0..self.parts(*output)).map(|part| (*output, part))).collect()
    }

    /// Returns the number of pieces of an output.
    pub fn parts(&self, output: usize) -> usize {
        if let Target::Cells(cells) = &self.plan.outputs[output].target { cells.len() } else { 1 }
    }

    /// Returns the source in which a piece's value is located: that of the port that writes it, or else that of a port that reads it.
    fn piece_source(&self, (output, part): Piece) -> SourceId {
        match &self.plan.outputs[output].target {
            Target::Item { block, .. } | Target::Report { block, .. } => self.installed.block_source[*block],
            Target::Cell(cell) => self.cell_source(*cell),
            Target::Cells(cells) => self.cell_source(cells[part]),
        }
    }

    fn cell_source(&self, cell: usize) -> SourceId {
        self.installed.home(self.plan, cell).unwrap_or(self.installed.sources[0])
    }

    /// Returns the cells of pieces, in order.
    pub fn cells_of(&self, pieces: &[Piece]) -> Vec<kernel::Cell> {
        let mut cells = Vec::new();
        for &(output, part) in pieces {
            let source = self.piece_source((output, part));
            match &self.plan.outputs[output].target {
                Target::Item { block, item } => cells.push(self.installed.blocks[*block].value(*item)),
                // The value is followed by a word that marks whether it was reported.
                Target::Report { block, item } => {
                    let block = &self.installed.blocks[*block];
                    cells.extend(block.report(*item).into_iter().chain(block.reported()));
                }
                Target::Cell(cell) => cells.extend(self.installed.cell(*cell, source).cloned()),
                Target::Cells(list) => cells.extend(self.installed.cell(list[part], source).cloned()),
            }
        }
        cells
    }

    /// Returns the length in bytes of a piece.
    pub fn piece_len(&self, piece: Piece) -> usize {
        self.cells_of(&[piece]).iter().map(kernel::Cell::len).sum()
    }

    /// Adds the operations that end the verb in `source`: they deactivate everything and make it safe, hold the verb's running time, and
    /// read these outputs.
    pub fn end_in(&self, builder: &mut Builder, source: SourceId, outputs: &[Piece]) {
        self.stop_in(builder, source);
        builder.add(source, Op::StopClock(self.installed.process.clone()));
        self.capture_in(builder, source, outputs);
    }

    /// Adds the operation that reads the pieces that are in `source`; adds nothing if there are none.
    pub fn capture_in(&self, builder: &mut Builder, source: SourceId, pieces: &[Piece]) {
        if !pieces.is_empty() {
            builder.add(source, Op::Capture(self.cells_of(pieces)));
        }
    }

    /// Returns the pieces in `source` that a kernel reads when it enters the ending list: the outputs of the condition, and those of the
    /// conditions whose earlier transitions may have started the end.
    pub fn concluding_outputs(&self, source: SourceId, condition: usize) -> Vec<Piece> {
        let led_on = |c: usize| self.plan.lists.iter().any(|l| l.transitions.iter().any(|(on, _)| *on == c));
        let mut pieces = Vec::new();
        for index in std::iter::once(condition).chain((0..self.plan.conditions.len()).filter(|c| led_on(*c))) {
            for piece in self.outputs_in(source, index) {
                if !pieces.contains(&piece) {
                    pieces.push(piece);
                }
            }
        }
        pieces
    }
}

/// Returns the value of a condition, and whether it was reported: the word after the value has a bit for each item of its block.
pub(crate) fn reported(bytes: &[u8], item: usize) -> (&[u8], bool) {
    match bytes.split_last_chunk() {
        Some((value, word)) => (value, u64::from_ne_bytes(*word) >> item & 1 == 1),
        None => (bytes, false),
    }
}

/// Decodes a value of a normalised type; the values of several cells of that type become a list.
pub(crate) fn decode(type_text: &str, several: bool, bytes: &[u8]) -> Value {
    let Ok(of) = Type::parse(type_text, &IndexMap::new()) else { return Value::List(Vec::new()) };
    if several && of.size() > 0 && bytes.len() != of.size() {
        return Value::List(bytes.chunks(of.size()).map(|part| of.decode(part)).collect());
    }
    of.decode(bytes)
}
