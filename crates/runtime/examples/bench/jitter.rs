// SPDX-License-Identifier: Apache-2.0
//! Release jitter at 1 kHz, compared with `cyclictest`: the time from the release to the first block of the firing, and the time from the
//! requested end of a sleep to its return. Both use the same core, priority and number of releases, and are measured alternately.
use crate::Bench;
use crate::blocks::{LATE_FROM_NS, Lateness, MARKED, MARKS, MARKS_MAX, now_ns};
use crate::report::{Line, median, time};
use crate::rig::{Rig, core, interval, rest, single, step};
use kernel::*;
use opengpac::FunctionBlock;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::Ordering;

const RELEASES: usize = 2_000;
const PERIOD_NS: u64 = 1_000_000;
const PRIORITY: u8 = 80;

pub fn rows(bench: &Bench) {
    let mut turns = Vec::new();
    for _ in 0..bench.rounds {
        let ours = spread(by_kernel());
        let Some(theirs) = by_cyclictest() else { return not_taken() };
        turns.push((ours, spread(theirs)));
    }
    for (which, name) in ["median", "99 % of releases", "greatest"].into_iter().enumerate() {
        let ratio = median(turns.iter().map(|(ours, theirs)| ours[which] / theirs[which]));
        Line {
            row: "jitter",
            what: format!("release jitter at 1 kHz, {name}"),
            ours: time(median(turns.iter().map(|turn| turn.0[which]))),
            peer: format!("cyclictest: {}", time(median(turns.iter().map(|turn| turn.1[which])))),
            value: ratio,
            shown: format!("{ratio:.2} ×"),
            // The maximum of some thousand samples depends on the machine, not on us: it is shown, not judged.
            bar: (which < 2).then_some(1.0),
            bar_text: if which < 2 { "≤ 1 ×" } else { "" },
            note: format!("{} rounds of {RELEASES} releases, to the body of the first block", turns.len()),
        }
        .print();
    }
}

fn not_taken() {
    let note = "not taken: cyclictest gave no samples".to_owned();
    Line {
        row: "jitter",
        what: "release jitter at 1 kHz".into(),
        ours: String::new(),
        peer: String::new(),
        value: 0.0,
        shown: String::new(),
        bar: None,
        bar_text: "≤ 1 ×",
        note,
    }
    .print();
}

/// Returns the median, the 99th percentile and the maximum of the samples.
fn spread(mut samples: Vec<f64>) -> [f64; 3] {
    samples.sort_by(f64::total_cmp);
    let at = |share: f64| samples[((samples.len() - 1) as f64 * share) as usize].max(1.0);
    [at(0.5), at(0.99), at(1.0)]
}

fn by_kernel() -> Vec<f64> {
    let rig = Rig::new();
    let kind = SourceKind::Timer { period_ns: PERIOD_NS };
    let spec = SourceSpec { rtp: 0, name: "timer".into(), kind, priority: PRIORITY, core: Some(core()), virtual_cost_ns: 0 };
    let timer = rig.host.add_source(spec).expect("a thread can be made");
    let (process, on) = (Process::new(1, 1), interval());
    let table = Table::new(vec![step(Arc::new(single(1, Lateness::descriptor())), &on, &process, vec![])], vec![], vec![], vec![], None);
    // Start of the host's clock, as exactly as two consecutive reads can tell.
    let epoch_ns = (0..100).map(|_| now_ns() - rig.host.now_ns()).max().expect("there are a hundred");
    LATE_FROM_NS.store(epoch_ns, Ordering::Release);
    MARKED.store(0, Ordering::Release);
    rig.carry_out(timer, vec![Op::Table(Box::new(table)), Op::StartClock(process), Op::On(on, 1)]);
    while MARKED.load(Ordering::Acquire) < RELEASES as u64 {
        rest(50_000_000);
    }
    (0..RELEASES.min(MARKS_MAX)).map(|place| MARKS[place].load(Ordering::Relaxed) as f64).collect()
}

/// Runs `cyclictest`, which prints one line per sample: `task: cycle: ns`. It must not prevent the processor from sleeping, because the
/// kernel does not prevent it either.
fn by_cyclictest() -> Option<Vec<f64>> {
    let number = |n: usize| n.to_string();
    let output = Command::new("cyclictest")
        .args(["--default-system", "-m", "-q", "-N", "-v", "-t1", "--policy=fifo", "-p"])
        .args([number(PRIORITY.into()), "-i".into(), number(PERIOD_NS as usize / 1_000), "-l".into(), number(RELEASES), "-a".into(), number(core())])
        .output()
        .ok()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let samples: Vec<f64> = text.lines().filter_map(|line| line.split(':').nth(2)?.trim().parse().ok()).collect();
    (samples.len() >= RELEASES / 2).then_some(samples)
}
