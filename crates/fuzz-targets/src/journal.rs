// SPDX-License-Identifier: Apache-2.0
//! Fuzz target for a daemon's journal, which is a file that a crash, an editor or a disk may have altered.
use daemon::journal::ledger::Ledger;
use daemon::journal::lines::{self, Line};

/// Checks that a parsed journal is written and parsed again as the same lines, and that the lines kept by its ledger yield the same
/// ledger.
pub(crate) fn journal(bytes: &[u8]) {
    let Ok(read) = lines::read(bytes) else { return };
    let mut again = lines::text(&read.head);
    read.lines.iter().for_each(|(_, line)| again.extend(lines::text(line)));
    let second = lines::read(&again).expect("what was written can be read");
    let only = |lines: &[(usize, Line)]| lines.iter().map(|(_, line)| line.clone()).collect::<Vec<_>>();
    assert_eq!(only(&read.lines), only(&second.lines));
    let Ok(ledger) = Ledger::of(read.lines) else { return };
    let kept = |ledger: &Ledger| ledger.lines().map(|kept| kept.line.clone()).collect::<Vec<_>>();
    let short = Ledger::of(kept(&ledger).into_iter().map(|line| (0, line))).expect("what counts goes with what counts");
    assert_eq!(kept(&ledger), kept(&short));
}
