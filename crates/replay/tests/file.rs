// SPDX-License-Identifier: Apache-2.0
//! Records in files: present items are read, missing ones are reported.
use mcap::Writer;
use replay::{ENCODING, Item, Reader, TOPIC};
use runtime::trace::Entry;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A file that is deleted with this value.
struct Scratch(PathBuf);

impl Scratch {
    /// Writes items with these numbers, among messages of another channel, ten in each chunk.
    fn new(name: &str, numbers: impl IntoIterator<Item = u32>) -> Scratch {
        let mut file = Writer::new(Vec::new(), "test").unwrap();
        let other = file.channel("/log", "json", None, &BTreeMap::new()).unwrap();
        let channel = file.channel(TOPIC, ENCODING, None, &BTreeMap::new()).unwrap();
        for (count, number) in numbers.into_iter().enumerate() {
            let item = Item::Module { key: number.to_string(), name: "module".to_owned(), bytes: vec![number as u8; 10_000] };
            file.put(other, 0, 0, b"{}");
            file.put(channel, number, 0, &item.bytes());
            if count % 10 == 9 {
                file.finish_chunk().unwrap();
            }
        }
        file.finish().unwrap();
        let path = std::env::temp_dir().join(format!("opengpac-replay-{}-{name}.mcap", std::process::id()));
        std::fs::write(&path, file.into_sink()).unwrap();
        Scratch(path)
    }

    /// Returns the numbers of the items, a text for each gap, and whether the file is truncated.
    fn read(&self) -> Result<(Vec<Result<u32, String>>, bool), String> {
        let mut reader = Reader::open(&self.0)?;
        let mut found = Vec::new();
        while let Some(item) = reader.next_item()? {
            found.push(match item {
                Item::Module { key, bytes, .. } => {
                    let number = key.parse().map_err(|_| format!("key '{key}'"))?;
                    assert_eq!(bytes, vec![number as u8; 10_000]);
                    Ok(number)
                }
                Item::Entry(Entry::Broken(why)) => Err(why),
                Item::Entry(_) => panic!("another item than was written"),
            });
        }
        Ok((found, reader.is_cut_off()))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _gone = std::fs::remove_file(&self.0);
    }
}

#[test]
fn a_record_is_read_as_far_as_it_goes() {
    let file = Scratch::new("whole", 0..250);
    assert_eq!(file.read(), Ok(((0..250).map(Ok).collect(), false)));
    let bytes = std::fs::read(&file.0).unwrap();
    assert!(bytes.len() < 250 * 1_000, "{} bytes", bytes.len());
    for cut in (100..bytes.len()).step_by(97) {
        std::fs::write(&file.0, &bytes[..cut]).unwrap();
        let (numbers, is_cut_off) = file.read().unwrap();
        assert_eq!(numbers, (0..numbers.len() as u32).map(Ok).collect::<Vec<_>>());
        assert!(is_cut_off || numbers.len() == 250);
    }
}

#[test]
fn where_items_are_missing_it_says_so() {
    let file = Scratch::new("holed", (0..3).chain(5..6));
    let missing = "2 of its items are not in the file: the disk was too slow for them".to_owned();
    assert_eq!(file.read(), Ok((vec![Ok(0), Ok(1), Ok(2), Err(missing)], false)));
    let file = Scratch::new("headless", 1..2);
    assert!(matches!(&file.read().unwrap().0[..], [Err(why)] if why.starts_with("1 of")));
}
