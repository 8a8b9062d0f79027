// SPDX-License-Identifier: Apache-2.0
use super::*;

fn write(writer: &mut RowsWriter, number: u64) {
    writer.write(number, number as i64 * 10, |sink| sink.put(&number.to_le_bytes()));
}

fn numbers(rows: &[Row]) -> Vec<u64> {
    rows.iter().map(|row| row.number).collect()
}

#[test]
fn there_is_no_newest_row_before_the_first() {
    let (writer, reader) = rows(8, 4);
    assert_eq!(reader.newest(), None);
    assert!(reader.last(3).is_empty());
    assert_eq!(writer.reader().since(0, &mut Vec::new()), 0);
}

#[test]
fn the_newest_row_has_its_sequence_number_time_and_bytes() {
    let (mut writer, reader) = rows(8, 4);
    write(&mut writer, 7);
    write(&mut writer, 9);
    assert_eq!(reader.newest(), Some(Row { sequence: 1, number: 9, time_ns: 90, bytes: 9u64.to_le_bytes().to_vec() }));
}

#[test]
fn rows_since_a_sequence_come_in_order_and_the_lost_are_counted() {
    let (mut writer, reader) = rows(8, 4);
    let mut out = Vec::new();
    for number in 0..3 {
        write(&mut writer, number);
    }
    assert_eq!(reader.since(0, &mut out), 0);
    assert_eq!(numbers(&out), [0, 1, 2]);
    for number in 3..10 {
        write(&mut writer, number);
    }
    out.clear();
    assert_eq!(reader.since(3, &mut out), 3);
    assert_eq!(numbers(&out), [6, 7, 8, 9]);
    out.clear();
    assert_eq!(reader.since(10, &mut out), 0);
    assert!(out.is_empty());
    assert_eq!(numbers(&reader.last(2)), [8, 9]);
    assert_eq!(numbers(&reader.last(100)), [6, 7, 8, 9]);
}

#[test]
fn rows_one_by_one_tell_how_many_were_lost_before_each() {
    let (mut writer, reader) = rows(8, 4);
    let mut row = Row::default();
    assert_eq!(reader.next(0, &mut row), None);
    for number in 0..6 {
        write(&mut writer, number);
    }
    assert_eq!((reader.next(0, &mut row), row.sequence, row.number), (Some(2), 2, 2));
    assert_eq!((reader.next(3, &mut row), row.sequence, row.number), (Some(0), 3, 3));
    assert_eq!(reader.next(6, &mut row), None);
}

#[test]
fn rows_that_a_ring_before_has_lost_are_lost_here_too() {
    let (mut writer, reader) = rows(8, 4);
    let mut row = Row::default();
    write(&mut writer, 0);
    writer.skip(7);
    write(&mut writer, 8);
    assert_eq!((reader.next(1, &mut row), row.sequence, row.number), (Some(7), 8, 8));
    assert_eq!(reader.newest().map(|row| row.number), Some(8));
}

#[test]
fn segments_of_any_length_lie_one_after_the_other() {
    let (mut writer, reader) = rows(21, 2);
    let bytes: Vec<u8> = (1..=21).collect();
    for cut in 0..=21 {
        for again in cut..=21 {
            writer.write(0, 0, |sink| {
                sink.put(&bytes[..cut]);
                sink.put(&bytes[cut..again]);
                sink.put(&bytes[again..]);
            });
            assert_eq!(reader.newest().map(|row| row.bytes), Some(bytes.clone()), "cut at {cut} and {again}");
        }
    }
}

#[test]
fn what_is_not_put_is_zero_not_an_older_row() {
    let (mut writer, reader) = rows(20, 2);
    for _ in 0..2 {
        writer.write(0, 0, |sink| sink.put(&[0xff; 20]));
    }
    writer.write(1, 0, |sink| sink.put(&[1; 3]));
    let mut expected = vec![0; 20];
    expected[..3].fill(1);
    assert_eq!(reader.newest().map(|row| row.bytes), Some(expected));
}

#[test]
#[should_panic(expected = "does not fit")]
fn a_segment_beyond_the_row_is_refused() {
    let (mut writer, _reader) = rows(12, 2);
    writer.write(0, 0, |sink| sink.put(&[0; 13]));
}

#[test]
fn a_fill_that_panics_writes_no_row() {
    let (mut writer, reader) = rows(8, 2);
    write(&mut writer, 1);
    write(&mut writer, 2);
    let fault = std::panic::AssertUnwindSafe(|| writer.write(3, 0, |_| panic!("the writer faults here")));
    assert!(std::panic::catch_unwind(fault).is_err());
    assert_eq!(reader.newest().map(|row| row.number), Some(2));
    let mut out = Vec::new();
    assert_eq!(reader.since(0, &mut out), 1, "the place of the oldest row was being written");
    assert_eq!(numbers(&out), [2]);
    write(&mut writer, 3);
    assert_eq!(numbers(&reader.last(2)), [2, 3]);
}
