// SPDX-License-Identifier: Apache-2.0
//! Writes MCAP files: messages in chunks, the indexes of the chunks, and the summary.
use crate::records::{
    CHANNEL, CHUNK, CHUNK_INDEX, DATA_END, FOOTER, Fields, HEADER, MAGIC, MESSAGE, MESSAGE_INDEX, METADATA, METADATA_INDEX, SCHEMA, STATISTICS, SUMMARY_OFFSET,
};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::io::{self, Write};

/// A chunk that is being filled.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Times and offsets of the messages of each channel.
    index: BTreeMap<u16, Vec<(u64, u64)>>,
    first: u64,
    last: u64,
}

impl Chunk {
    fn is_full(&self) -> bool {
        self.records.len() >= CHUNK_SIZE
    }
}

/// Schema of a channel's messages.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Schema {
    pub name: String,
    /// Schema language of `text`, such as `jsonschema`.
    pub encoding: &'static str,
    pub text: String,
}

/// Writes an MCAP file to `W`, which need not be buffered: chunks are written as a whole, and `W` is flushed after each.
///
/// If a call fails, no more data can be written: `W` then ends with an incomplete record after [`Writer::position`].
pub struct Writer<W: Write> {
    sink: W,
    position: u64,
    chunk: Chunk,
    /// Chunk for the channels that are kept separate.
    chunk_apart: Chunk,
    apart: HashSet<u16>,
    /// IDs of the schemas.
    schemas: HashMap<Schema, u16>,
    /// Every schema and channel as a record, for the summary and for repetition in later chunks.
    described: [Vec<u8>; 2],
    /// Number of chunks of values written.
    value_chunks: u64,
    channels: u16,
    /// Indexes of all chunks; `None` if there are too many.
    chunk_indexes: Option<Vec<u8>>,
    chunks: u32,
    metadata_indexes: Vec<u8>,
    metadata: u32,
    counts: BTreeMap<u16, u64>,
    span: Option<(u64, u64)>,
}

impl<W: Write> Writer<W> {
    /// Starts a file. `library` identifies the writer.
    ///
    /// # Errors
    /// Fails if the sink fails, as do all other calls.
    pub fn new(sink: W, library: &str) -> io::Result<Writer<W>> {
        let mut writer = Writer {
            sink,
            position: 0,
            chunk: Chunk::default(),
            chunk_apart: Chunk::default(),
            apart: HashSet::new(),
            schemas: HashMap::new(),
            described: Default::default(),
            value_chunks: 0,
            channels: 0,
            chunk_indexes: Some(Vec::new()),
            chunks: 0,
            metadata_indexes: Vec::new(),
            metadata: 0,
            counts: BTreeMap::new(),
            span: None,
        };
        let mut begin = MAGIC.to_vec();
        Fields::default().text("").text(library).record(HEADER, &mut begin);
        writer.write(&begin)?;
        Ok(writer)
    }

    /// Adds a channel; returns its ID, or `None` if the file has no IDs left. `encoding` is the encoding of its messages.
    pub fn channel(&mut self, topic: &str, encoding: &str, schema: Option<&Schema>, metadata: &BTreeMap<String, String>) -> Option<u16> {
        let schema = schema.map_or(Some(0), |schema| self.schema(schema))?;
        self.channels = self.channels.checked_add(1)?;
        let id = self.channels;
        self.describe(1, CHANNEL, || Fields::default().u16(id).u16(schema).text(topic).text(encoding).texts(metadata));
        Some(id)
    }

    fn schema(&mut self, schema: &Schema) -> Option<u16> {
        if let Some(id) = self.schemas.get(schema) {
            return Some(*id);
        }
        let id = u16::try_from(self.schemas.len() + 1).ok()?;
        self.schemas.insert(schema.clone(), id);
        self.describe(0, SCHEMA, || Fields::default().u16(id).text(&schema.name).text(schema.encoding).text(&schema.text));
        Some(id)
    }

    fn describe(&mut self, which: usize, code: u8, fields: impl Fn() -> Fields) {
        fields().record(code, &mut self.chunk.records);
        fields().record(code, &mut self.described[which]);
    }

    /// Stores messages of a channel in separate chunks, shared with other such channels, so that their readers need not read the other
    /// chunks. Must be called before the channel's first message.
    pub fn set_apart(&mut self, channel: u16) {
        self.apart.insert(channel);
    }

    /// Adds a message to its chunk. `time` is in ns.
    pub fn put(&mut self, channel: u16, sequence: u32, time: u64, data: &[u8]) {
        let is_apart = self.apart.contains(&channel);
        if !is_apart && self.chunk.index.is_empty() && self.value_chunks > 0 && (self.value_chunks + 1).is_power_of_two() {
            self.described.iter().for_each(|records| self.chunk.records.extend(records));
        }
        let Chunk { records, index, first, last } = if is_apart { &mut self.chunk_apart } else { &mut self.chunk };
        if index.is_empty() {
            (*first, *last) = (time, time);
        }
        (*first, *last) = ((*first).min(time), (*last).max(time));
        index.entry(channel).or_default().push((time, records.len() as u64));
        records.push(MESSAGE);
        records.extend((MESSAGE_FIELDS + data.len() as u64).to_le_bytes());
        records.extend(channel.to_le_bytes());
        records.extend(sequence.to_le_bytes());
        records.extend(time.to_le_bytes());
        records.extend(time.to_le_bytes());
        records.extend(data);
    }

    /// Returns true if a chunk is large enough to be finished; a larger chunk would not compress better.
    pub fn is_full(&self) -> bool {
        [&self.chunk, &self.chunk_apart].into_iter().any(Chunk::is_full)
    }

    /// Returns true if a chunk that is being filled contains messages of a channel.
    pub fn is_filling(&self, channel: u16) -> bool {
        [&self.chunk, &self.chunk_apart].into_iter().any(|chunk| chunk.index.contains_key(&channel))
    }

    /// Returns the number of bytes written; they consist of complete records. The file can be read up to this position whatever happens
    /// to its writer.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Returns the sink, without the chunks that are being filled.
    pub fn into_sink(self) -> W {
        self.sink
    }

    /// Writes the chunks to the sink, each as a whole with the index of its messages; does nothing if both are empty.
    pub fn finish_chunk(&mut self) -> io::Result<()> {
        self.finish_values()?;
        let chunk = std::mem::take(&mut self.chunk_apart);
        self.chunk_apart = self.finished(chunk)?;
        Ok(())
    }

    /// Writes only full chunks. The separate chunk is kept if it is not full, so that its few messages stay together.
    pub fn finish_full(&mut self) -> io::Result<()> {
        if self.chunk_apart.is_full() { self.finish_chunk() } else { self.finish_values() }
    }

    /// Writes the chunk of values. It comes first because it describes channels, so that no description follows its messages.
    ///
    /// Chunks 2, 4, 8, … repeat all descriptions, so that the channels are not lost if both the first chunk and the summary are damaged.
    fn finish_values(&mut self) -> io::Result<()> {
        let chunk = std::mem::take(&mut self.chunk);
        self.value_chunks += u64::from(!chunk.records.is_empty());
        self.chunk = self.finished(chunk)?;
        Ok(())
    }

    /// Writes a chunk and returns it empty, so that its memory can be reused.
    fn finished(&mut self, mut chunk: Chunk) -> io::Result<Chunk> {
        if chunk.records.is_empty() {
            return Ok(chunk);
        }
        let Chunk { records, index, first, last } = &chunk;
        let (first, last, size) = (*first, *last, records.len() as u64);
        // A flipped bit may decompress to the same bytes, which the checksum of the records does not detect; that of the block does.
        let checked = lz4_flex::frame::FrameInfo::new().block_checksums(true);
        let mut encoder = lz4_flex::frame::FrameEncoder::with_frame_info(checked, Vec::with_capacity(records.len() / 2));
        encoder.write_all(records)?;
        let compressed = encoder.finish().map_err(|why| io::Error::other(why.to_string()))?;
        let mut fields = Fields::default().u64(first).u64(last).u64(size).u32(crc32fast::hash(records)).text(COMPRESSION).u64(compressed.len() as u64);
        fields.0.extend(&compressed);
        let mut out = Vec::with_capacity(compressed.len() + 64 * index.len());
        fields.record(CHUNK, &mut out);
        let (start, chunk_len) = (self.position, out.len() as u64);
        let mut offsets = BTreeMap::new();
        for (channel, messages) in index {
            offsets.insert(*channel, start + out.len() as u64);
            let pairs = messages.iter().fold(Fields::default(), |pairs, (time, offset)| pairs.u64(*time).u64(*offset));
            Fields::default().u16(*channel).bytes(&pairs.0).record(MESSAGE_INDEX, &mut out);
        }
        let index_len = out.len() as u64 - chunk_len;
        self.write(&out)?;
        self.sink.flush()?;
        if let Some(indexes) = &mut self.chunk_indexes {
            let fields = Fields::default().u64(first).u64(last).u64(start).u64(chunk_len).by_channel(&offsets).u64(index_len);
            fields.text(COMPRESSION).u64(compressed.len() as u64).u64(size).record(CHUNK_INDEX, indexes);
        }
        self.chunk_indexes.take_if(|indexes| indexes.len() > INDEXES_MAX);
        self.chunks += 1;
        for (channel, messages) in &chunk.index {
            *self.counts.entry(*channel).or_default() += messages.len() as u64;
        }
        if !chunk.index.is_empty() {
            self.span = Some(self.span.map_or((first, last), |(from, to)| (from.min(first), to.max(last))));
        }
        chunk.records.clear();
        chunk.index.clear();
        (chunk.first, chunk.last) = (0, 0);
        Ok(chunk)
    }

    /// Writes the chunks to the sink, followed by a metadata record.
    pub fn metadata(&mut self, name: &str, texts: &BTreeMap<String, String>) -> io::Result<()> {
        self.finish_chunk()?;
        let (start, mut out) = (self.position, Vec::new());
        Fields::default().text(name).texts(texts).record(METADATA, &mut out);
        self.write(&out)?;
        Fields::default().u64(start).u64(out.len() as u64).text(name).record(METADATA_INDEX, &mut self.metadata_indexes);
        self.metadata += 1;
        self.sink.flush()
    }

    /// Writes the end of the file: the summary, after the last chunk. Must be the last call.
    pub fn finish(&mut self) -> io::Result<()> {
        self.finish_chunk()?;
        let mut out = Vec::new();
        Fields::default().u32(0).record(DATA_END, &mut out);
        let summary = self.position + out.len() as u64;
        let (from, to) = self.span.unwrap_or((0, 0));
        let mut statistics = Vec::new();
        let fields = Fields::default().u64(self.counts.values().sum()).u16(u16::try_from(self.schemas.len()).unwrap_or(u16::MAX));
        let fields = fields.u32(self.channels.into()).u32(0).u32(self.metadata).u32(self.chunks).u64(from).u64(to).by_channel(&self.counts);
        fields.record(STATISTICS, &mut statistics);
        let [schemas, channels] = &self.described;
        let chunk_indexes = &self.chunk_indexes.take().unwrap_or_default();
        let groups =
            [(SCHEMA, schemas), (CHANNEL, channels), (STATISTICS, &statistics), (CHUNK_INDEX, chunk_indexes), (METADATA_INDEX, &self.metadata_indexes)];
        let mut offsets = Vec::new();
        for (code, group) in groups.into_iter().filter(|(_, group)| !group.is_empty()) {
            let start = self.position + out.len() as u64;
            let mut fields = Fields(vec![code]);
            fields = fields.u64(start).u64(group.len() as u64);
            fields.record(SUMMARY_OFFSET, &mut offsets);
            out.extend(group);
        }
        let offset_start = self.position + out.len() as u64;
        out.extend(&offsets);
        // The checksum covers the summary and the footer up to the checksum.
        let begins = usize::try_from(summary - self.position).map_err(io::Error::other)?;
        Fields::default().u64(summary).u64(offset_start).u32(0).record(FOOTER, &mut out);
        let sum_at = out.len() - size_of::<u32>();
        let sum = crc32fast::hash(&out[begins..sum_at]);
        out[sum_at..].copy_from_slice(&sum.to_le_bytes());
        out.extend(MAGIC);
        self.write(&out)?;
        self.sink.flush()
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sink.write_all(bytes)?;
        self.position += bytes.len() as u64;
        Ok(())
    }
}

/// Size of a chunk before compression, bytes.
const CHUNK_SIZE: usize = 1 << 20;
/// Maximum size of the index of all chunks, bytes. The index stays in memory until the end. This size is enough for days at one chunk per
/// second, and for an hour at a hundred. A longer file has no index, and tools read it from the beginning.
const INDEXES_MAX: usize = 32 << 20;
const COMPRESSION: &str = "lz4";
/// Size of a message's fields before its data, bytes: channel, sequence, two times.
const MESSAGE_FIELDS: u64 = 22;
