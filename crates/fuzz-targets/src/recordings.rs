// SPDX-License-Identifier: Apache-2.0
//! Fuzz target for the MCAP reader: recordings, and records for replay, that a user opens.
use mcap::{Reader, Record, Unreadable};

/// Checks that reading any file ends in exactly one way, and that the records of a truncated file are the first records of the complete
/// file.
pub fn recordings(bytes: &[u8]) {
    let (whole, is_refused) = read(bytes);
    let (part, _) = read(&bytes[..bytes.len() / 2]);
    if !is_refused {
        assert!(part.len() <= whole.len() && part.iter().zip(&whole).all(|(a, b)| a == b), "a part of the file says something else");
    }
}

/// Returns all records as text, and true if the file was refused at any point.
fn read(bytes: &[u8]) -> (Vec<String>, bool) {
    let mut records = Vec::new();
    let mut reader = match Reader::new(bytes) {
        Ok(reader) => reader,
        Err(why) => {
            assert!(matches!(why, Unreadable::NoMcap), "{why}");
            return (records, true);
        }
    };
    loop {
        match reader.next_record() {
            Ok(Some(Record::Message { data, .. })) if data.len() > bytes.len() << 8 => panic!("more than any compression makes"),
            Ok(Some(record)) => records.push(format!("{record:?}")),
            Ok(None) => break,
            Err(_) => {
                assert!(matches!(reader.next_record(), Ok(None)), "nothing comes behind an error");
                return (records, true);
            }
        }
    }
    assert!(reader.is_whole() != reader.is_cut_off(), "it ends in one way");
    (records, false)
}
