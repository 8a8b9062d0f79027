// SPDX-License-Identifier: Apache-2.0
//! A record as a file: what was flushed is there, however whoever wrote it ended.
use replay::{Item, Reader, Writer};
use std::path::{Path, PathBuf};

/// A path that nothing lies at, and the file that it names goes with this.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        Scratch(std::env::temp_dir().join(format!("opengpac-replay-{}-{name}.mcap", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _gone = std::fs::remove_file(&self.0);
    }
}

fn items(numbers: std::ops::Range<u32>) -> Vec<Item> {
    numbers.map(|number| Item::Module { key: number.to_string(), name: "module".to_owned(), bytes: vec![number as u8; 10_000] }).collect()
}

/// The numbers of the items in a file, and whether it is cut off.
fn read(path: &Path) -> Result<(Vec<u32>, bool), String> {
    let mut reader = Reader::open(path)?;
    let mut numbers = Vec::new();
    while let Some(item) = reader.next_item()? {
        let Item::Module { key, bytes, .. } = item else { panic!("another item than was written") };
        let number = key.parse().map_err(|_| format!("key '{key}'"))?;
        assert_eq!(bytes, vec![number as u8; 10_000]);
        numbers.push(number);
    }
    assert!(reader.has_items(), "it is a record as soon as it is made");
    Ok((numbers, reader.is_cut_off()))
}

#[test]
fn what_was_flushed_is_read_while_it_is_written_and_after_its_writer_has_gone() {
    let file = Scratch::new("flushed");
    let mut writer = Writer::create(&file.0).unwrap();
    assert_eq!(read(&file.0), Ok((vec![], true)));
    writer.write(&items(0..3)).unwrap();
    writer.flush().unwrap();
    assert_eq!(read(&file.0), Ok((vec![0, 1, 2], true)));
    writer.write(&items(3..5)).unwrap();
    drop(writer);
    assert_eq!(read(&file.0), Ok((vec![0, 1, 2], true)), "what nobody flushed");
}

#[test]
fn a_record_is_compressed_and_read_as_far_as_it_goes() {
    let file = Scratch::new("whole");
    let mut writer = Writer::create(&file.0).unwrap();
    let begun = std::fs::read(&file.0).unwrap().len();
    for first in [0, 10, 20] {
        writer.write(&items(first..first + 10)).unwrap();
        writer.flush().unwrap();
    }
    // More than a chunk holds, which nobody has to flush.
    writer.write(&items(30..250)).unwrap();
    writer.finish().unwrap();
    let bytes = std::fs::read(&file.0).unwrap();
    assert!(bytes.len() < 250 * 1_000, "{} bytes", bytes.len());
    assert_eq!(read(&file.0), Ok(((0..250).collect(), false)));
    for cut in (begun..bytes.len()).step_by(97) {
        std::fs::write(&file.0, &bytes[..cut]).unwrap();
        let (numbers, is_cut_off) = read(&file.0).unwrap();
        assert_eq!(numbers, (0..numbers.len() as u32).collect::<Vec<_>>());
        assert!(is_cut_off || numbers.len() == 250);
    }
}
