// SPDX-License-Identifier: Apache-2.0
//! Checks that a recording read in place gives the same as one read as a whole, at every time and over every span.
use crate::common::{self, MS, svv, wave};
use recorder::{ALARMS, Archive, INSTALLED, LOG, Options, Recorder, Recording, STATISTICS, Series, opened, recordings};
use serde_json::json;
use std::path::PathBuf;
use supervisor::System;

/// A folder that is deleted with this value.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        let folder = std::env::temp_dir().join(format!("opengpac-archive-{}-{name}", std::process::id()));
        let _absent = std::fs::remove_dir_all(&folder);
        std::fs::create_dir(&folder).expect("a folder");
        Scratch(folder)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _gone = std::fs::remove_dir_all(&self.0);
    }
}

/// Returns a system with the verb `wave`, an SVV `y` for it, and `still`, which nothing writes.
fn system() -> System {
    let system = common::system();
    svv(&system, "y", json!({"type_text": "double", "unit": "rad"}));
    svv(&system, "still", json!({"type_text": "int32_t[2]"}));
    system
}

fn begin(system: &System, file: &std::path::Path) -> (std::sync::Arc<Recorder>, u64) {
    let (_, recorder) = Recorder::start(system, file, &Options::default()).unwrap();
    (recorder, wave(system, "y"))
}

fn doubles(series: &Series) -> Vec<f64> {
    series.bytes.chunks(8).map(|value| f64::from_le_bytes(value.try_into().unwrap())).collect()
}

/// Returns the index of the value that a series holds at a time.
fn held(series: &Series, time_ns: i64) -> Option<usize> {
    series.times_ns.iter().rposition(|at| *at <= time_ns)
}

#[test]
fn at_every_time_it_says_what_was_stored_last() {
    let (system, scratch) = (system(), Scratch::new("at"));
    let (recorder, id) = begin(&system, &scratch.file("run.mcap"));
    // Half a minute fills several chunks.
    system.advance(30_000 * MS).unwrap();
    system.halt(id).unwrap();
    system.advance(10 * MS).unwrap();
    recorder.stop();
    let whole = Recording::open(&scratch.file("run.mcap")).unwrap();
    let archive = Archive::open(&scratch.file("run.mcap")).unwrap();
    let (y, values) = (&whole.series["y"], doubles(&whole.series["y"]));
    for time_ns in (0..31_000).step_by(17).map(|ms| ms * MS - 5) {
        let expected = held(y, time_ns).map(|at| (model::value::Value::Number(values[at]), y.numbers[at], y.times_ns[at]));
        assert_eq!(archive.reading_at("y", time_ns).unwrap(), expected, "at {time_ns}");
    }
    assert_eq!(archive.reading_at("still", 20_000 * MS).unwrap().map(|(_, number, _)| number), Some(whole.series["still"].numbers[0]));
    assert_eq!(archive.reading_at("nothing", 0).unwrap(), None);
    let log: Vec<_> = archive.records(LOG, 0, usize::MAX).unwrap().0.into_iter().map(|said| said.message).collect();
    assert_eq!(log.iter().collect::<Vec<_>>(), whole.log().collect::<Vec<_>>());
    let about = archive.about().unwrap();
    assert_eq!((about.complete, about.replay, about.verbs), (true, false, vec!["wave".to_owned()]));
    assert_eq!(about.ends.iter().map(|end| (end.instance.as_str(), end.condition.as_str())).collect::<Vec<_>>(), [("wave#1", "halted")]);
    assert!(about.ends_ns >= 30_000 * MS && about.channels.iter().any(|of| of.name == "still" && of.components == 2));
}

#[test]
fn the_state_of_the_system_stands_in_it() {
    let (system, scratch) = (system(), Scratch::new("state"));
    system.define_alarm("hot", serde_json::from_value(json!({"text": "too hot"})).unwrap()).unwrap();
    let (recorder, _) = begin(&system, &scratch.file("run.mcap"));
    system.advance(3000 * MS).unwrap();
    system.raise_alarm("hot", "y", "too warm").unwrap();
    system.advance(3000 * MS).unwrap();
    recorder.stop();
    let archive = Archive::open(&scratch.file("run.mcap")).unwrap();
    let at = |topic: &str, ms: i64| archive.record_at(topic, ms * MS).unwrap().map(|said| said.message);
    let installed = at(INSTALLED, 5000).expect("what was installed");
    assert_eq!(installed["instances"][0]["name"], "wave#1");
    assert!(at(STATISTICS, 5900).is_some_and(|now| now["now_s"].as_f64().is_some_and(|now_s| now_s > 1.0 && now_s <= 5.9)));
    let raised = |ms| at(ALARMS, ms).map_or(0, |alarms| alarms["current"].as_array().map_or(0, Vec::len));
    assert_eq!((raised(2900), raised(5900)), (0, 1));
}

#[test]
fn a_span_has_the_extremes_of_each_column_and_exact_sums() {
    let (system, scratch) = (system(), Scratch::new("span"));
    let (recorder, _) = begin(&system, &scratch.file("run.mcap"));
    system.advance(30_000 * MS).unwrap();
    recorder.stop();
    let whole = Recording::open(&scratch.file("run.mcap")).unwrap();
    let archive = Archive::open(&scratch.file("run.mcap")).unwrap();
    let (y, values) = (&whole.series["y"], doubles(&whole.series["y"]));
    let names = ["y".to_owned(), "still".to_owned()];
    for (from_ns, to_ns, columns) in [(1000 * MS, 1100 * MS, 50), (0, 30_000 * MS, 40), (7 * MS, 29_001 * MS, 6), (5000 * MS, 5000 * MS, 10)] {
        let whole_span = archive.span(&names, (from_ns, to_ns), columns, 0, usize::MAX).unwrap();
        assert_eq!(whole_span.next, None);
        // Reading chunk by chunk gives the same, except that a column shared by two chunks has extremes in each.
        let (mut part, mut count) = (archive.span(&names, (from_ns, to_ns), columns, 0, 1).unwrap(), 0);
        let mut apart = part.traces[0].samples.times_ns.clone();
        while let Some(next) = part.next {
            count += part.traces[0].sums[0].count;
            part = archive.span(&names, (from_ns, to_ns), columns, next, 1).unwrap();
            apart.extend(&part.traces[0].samples.times_ns);
        }
        let span = whole_span;
        assert_eq!(count + part.traces[0].sums[0].count, span.traces[0].sums[0].count);
        assert!(apart.is_sorted() && span.traces[0].samples.times_ns.iter().all(|time| apart.contains(time)));
        let inside: Vec<usize> = (0..values.len()).filter(|at| (from_ns..=to_ns).contains(&y.times_ns[*at])).collect();
        let (samples, sums) = (&span.traces[0].samples, span.traces[0].sums[0]);
        for (at, time_ns) in samples.times_ns.iter().enumerate() {
            let from = y.times_ns.iter().zip(&y.numbers).position(|(time, number)| (time, number) == (time_ns, &samples.numbers[at])).expect("a stored value");
            assert_eq!(samples.values[at].to_bits(), values[from].to_bits());
        }
        assert!(samples.times_ns.is_sorted());
        let of = |at: &usize| values[*at];
        assert_eq!(sums.count, inside.len() as u64);
        assert_eq!((sums.min, sums.max), (inside.iter().map(of).fold(f64::MAX, f64::min), inside.iter().map(of).fold(f64::MIN, f64::max)));
        assert!(
            (sums.sum - inside.iter().map(of).sum::<f64>()).abs() < 1e-9 && (sums.squares - inside.iter().map(|at| of(at) * of(at)).sum::<f64>()).abs() < 1e-9
        );
        let drawn: Vec<f64> = samples.values.iter().zip(&samples.times_ns).filter(|(_, time)| **time >= from_ns).map(|(value, _)| *value).collect();
        assert_eq!((drawn.iter().copied().fold(f64::MAX, f64::min), drawn.iter().copied().fold(f64::MIN, f64::max)), (sums.min, sums.max));
        assert!(drawn.len() <= 4 * (columns + 2) && (columns < 50 || drawn.len() > columns), "{} of {columns} columns", drawn.len());
        assert_eq!(span.traces[1].samples.values, [0.0, 0.0], "what was there before");
    }
    let refused = archive.span(&["z".to_owned()], (0, 1), 1, 0, 1).expect_err("refused");
    assert!(refused[0].message.contains("there is no SVV 'z'"), "{}", refused[0]);
}

#[test]
fn it_is_stepped_by_firing() {
    let (system, scratch) = (system(), Scratch::new("firing"));
    let (recorder, _) = begin(&system, &scratch.file("run.mcap"));
    system.advance(3000 * MS).unwrap();
    recorder.stop();
    let whole = Recording::open(&scratch.file("run.mcap")).unwrap();
    let archive = Archive::open(&scratch.file("run.mcap")).unwrap();
    let mut times: Vec<i64> = whole.series.values().flat_map(|series| series.times_ns.clone()).collect();
    times.sort_unstable();
    times.dedup();
    for at in [1, 2, 500, times.len() - 2] {
        assert_eq!(archive.firing(times[at], true).unwrap(), Some(times[at + 1]));
        assert_eq!(archive.firing(times[at] + 1, false).unwrap(), Some(times[at]));
        assert_eq!(archive.firing(times[at], false).unwrap(), Some(times[at - 1]));
    }
    assert_eq!(archive.firing(times[times.len() - 1], true).unwrap(), None);
    assert_eq!(archive.firing(times[0], false).unwrap(), None);
}

#[test]
fn a_page_of_messages_reads_its_own_chunks_only() {
    let (system, scratch) = (system(), Scratch::new("pages"));
    let file = scratch.file("run.mcap");
    let (recorder, _) = begin(&system, &file);
    system.advance(60_000 * MS).unwrap();
    recorder.stop();
    let archive = Archive::open(&file).unwrap();
    // Values, since records about the system occupy few chunks.
    let (all, next) = archive.records("y", 0, usize::MAX).unwrap();
    assert_eq!(next, None);
    // Reading page by page, one chunk each, gives the same.
    let (mut pages, mut begins, mut since) = (Vec::new(), Vec::new(), Some(0));
    while let Some(number) = since {
        begins.push(number);
        let (page, next) = archive.records("y", number, 1).unwrap();
        assert_eq!(next.unwrap_or(all.len()), number + page.len());
        pages.extend(page);
        since = next;
    }
    assert_eq!(pages, all);
    assert!(begins.len() > 3, "{} pages", begins.len());
    // A late page needs none of the earlier chunks: with their bytes destroyed it reads the same, while the first page cannot be read.
    let archive = Archive::open(&file).unwrap();
    let mut bytes = std::fs::read(&file).unwrap();
    let half = bytes.len() / 2;
    bytes[..half].fill(0xff);
    std::fs::write(&file, bytes).unwrap();
    let late = begins[begins.len() - 2];
    let (page, next) = archive.records("y", late, 1).expect("a page behind the damage");
    assert_eq!((page.as_slice(), next), (&all[late..begins[begins.len() - 1]], begins.last().copied()));
    let (page, next) = archive.records("y", 0, 1).expect("what is whole is read");
    assert!(page.is_empty() && next.is_some(), "its chunk is gone");
    let damage = archive.about().expect("it is known").damage;
    assert!(damage.iter().any(|one| one.lost.as_ref().is_some_and(|lost| lost.contains_key("y"))), "{damage:?}");
    let (page, next) = archive.records("y", all.len(), 1).unwrap();
    assert!(page.is_empty() && next.is_none(), "nothing is behind the last one");
}

#[test]
fn one_that_is_under_way_grows_and_one_that_was_cut_off_ends_where_it_does() {
    let (system, scratch) = (system(), Scratch::new("grows"));
    let file = scratch.file("run.mcap");
    let (recorder, _) = begin(&system, &file);
    system.advance(60_000 * MS).unwrap();
    let archive = opened(&file).unwrap();
    assert!(!archive.about().unwrap().complete);
    recorder.stop();
    let again = opened(&file).unwrap();
    assert!(std::sync::Arc::ptr_eq(&archive, &again), "it stays open");
    assert!(again.about().unwrap().complete && again.about().unwrap().ends_ns >= 20_000 * MS);
    let bytes = std::fs::read(&file).unwrap();
    for len in [bytes.len() / 2, bytes.len() - 40, 2 * bytes.len() / 3] {
        let cut = scratch.file(&format!("cut-{len}.mcap"));
        std::fs::write(&cut, &bytes[..len]).unwrap();
        let (whole, archive) = (Recording::open(&cut).unwrap(), Archive::open(&cut).unwrap());
        let about = archive.about().unwrap();
        let last = whole.series["y"].times_ns.last().copied().expect("a value");
        assert_eq!(archive.reading_at("y", i64::MAX).unwrap().map(|(.., time_ns)| time_ns), Some(last), "{len} bytes");
        assert_eq!(about.complete, whole.complete, "{len} bytes");
    }
    let names: Vec<String> = recordings(&scratch.0).unwrap().into_iter().map(|one| one.name).collect();
    assert_eq!(names.len(), 4);
    assert!(names.contains(&"run.mcap".to_owned()));
    std::fs::write(scratch.file("none.mcap"), b"nothing").unwrap();
    assert!(opened(&scratch.file("none.mcap")).is_err_and(|why| why[0].message.contains("it is not an MCAP file")));
    assert!(recordings(&scratch.file("absent")).is_err_and(|why| why[0].message.contains("cannot read the folder")));
}

#[test]
fn the_log_is_read_without_the_values() {
    let (system, scratch) = (system(), Scratch::new("apart"));
    let (recorder, id) = begin(&system, &scratch.file("run.mcap"));
    system.advance(30_000 * MS).unwrap();
    system.halt(id).unwrap();
    recorder.stop();
    let file = mcap::IndexedFile::open(std::fs::File::open(scratch.file("run.mcap")).unwrap()).unwrap();
    let of_values = |id: &u16| file.channels[id].metadata.contains_key("kind");
    let mixed = |chunk: &mcap::ChunkIndex| chunk.counts.keys().any(of_values) && !chunk.counts.keys().all(of_values);
    assert_eq!(file.chunks.iter().filter(|chunk| mixed(chunk)).count(), 0);
    assert!(file.chunks.iter().any(|chunk| chunk.counts.keys().any(of_values)));
    assert!(file.chunks.iter().any(|chunk| chunk.counts.keys().any(|id| file.channels[id].topic == LOG)));
}
