// SPDX-License-Identifier: Apache-2.0
//! The other hosts: identity, time of the last message, and clock offset.
use crate::agreement::{Agreement, ClockOffset, ClockReport, Ping};

/// Time without a ping after which a restarted host may replace the host of the same name, ns.
const REPLACED_AFTER_NS: i64 = 1_000_000_000;
/// Duration of silence after which everything is retransmitted, ns.
pub(crate) const PARTITION_NS: i64 = 350_000_000;

/// Another host of the system.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer {
    /// Name of the host.
    pub name: String,
    /// Target platform of the host's build, such as `x86_64-unknown-linux-gnu`; determines which code modules it can load.
    pub target: String,
    /// Time since the host's last message, ns.
    pub silent_ns: i64,
    /// True if the silence exceeds the limit, in which case the host's links are closed.
    pub gone: bool,
    /// Offset of the host's clocks from this host's; `None` before the first measurement.
    pub offset: Option<ClockOffset>,
}

#[derive(Debug)]
pub(crate) struct KnownPeer {
    pub(crate) id: u64,
    pub(crate) name: String,
    pub(crate) target: String,
    heard_ns: i64,
    gone: bool,
    /// Pings sent by this host; the listening side leaves the measurement to the joined host.
    agreement: Agreement,
    offset: Option<ClockOffset>,
    beyond: bool,
}

impl KnownPeer {
    pub(crate) fn new(id: u64, name: String, target: String, now_ns: i64) -> Self {
        KnownPeer { id, name, target, heard_ns: now_ns, gone: false, agreement: Agreement::default(), offset: None, beyond: false }
    }

    fn peer(&self, now_ns: i64) -> Peer {
        let (name, target) = (self.name.clone(), self.target.clone());
        Peer { name, target, silent_ns: now_ns - self.heard_ns, gone: self.gone, offset: self.offset }
    }
}

#[derive(Debug, Default)]
pub(crate) struct Peers {
    known: Vec<KnownPeer>,
}

/// Consequences of a message from another host.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct MessageMeaning {
    /// True if the host had been silent, so everything must be retransmitted.
    pub(crate) whole_again: bool,
    /// Report to be passed to the clock watch.
    pub(crate) clock: Option<ClockReport>,
}

impl Peers {
    /// Admits a host, or returns the reason for refusing it. `Ok` contains the number of the host that it replaces.
    pub(crate) fn admit(&mut self, host: KnownPeer, now_ns: i64) -> Result<Option<u64>, String> {
        if self.known.iter().any(|known| known.id == host.id) {
            return Ok(None);
        }
        let same = self.known.iter().position(|known| known.name == host.name);
        if let Some(known) = same.map(|at| &self.known[at]) {
            let silent_ns = now_ns - known.heard_ns;
            if !known.gone && silent_ns < REPLACED_AFTER_NS {
                return Err(format!("a host '{}' has already joined and was heard {} ms ago; give this one another name", host.name, silent_ns / 1_000_000));
            }
        }
        let replaced = same.map(|at| self.known.remove(at).id);
        self.known.push(host);
        Ok(replaced)
    }

    /// Records a message from a host. Its clock offset is `said`, if the message contains it, or is measured from `ping`, if the message
    /// answers one.
    pub(crate) fn heard(&mut self, id: u64, said: Option<ClockOffset>, ping: Option<Ping>, limit_ns: Option<i64>, now_ns: i64) -> Option<MessageMeaning> {
        let known = self.known.iter_mut().find(|known| known.id == id)?;
        let whole_again = now_ns - known.heard_ns > PARTITION_NS;
        known.heard_ns = known.heard_ns.max(now_ns);
        known.gone = false;
        if let Some(ping) = ping {
            known.agreement.add(ping);
            known.offset = known.agreement.offset();
        }
        known.offset = said.or(known.offset);
        let clock = known.offset.zip(limit_ns).and_then(|(offset, limit_ns)| {
            let beyond = offset.worst_ns() > limit_ns;
            let crossed = beyond != std::mem::replace(&mut known.beyond, beyond);
            crossed.then(|| ClockReport { host: known.name.clone(), offset, limit_ns, beyond })
        });
        Some(MessageMeaning { whole_again, clock })
    }

    /// Records that this side was suspended for `late_ns`, which does not count as silence of the other hosts.
    pub(crate) fn stood_still(&mut self, late_ns: i64, now_ns: i64) {
        self.known.iter_mut().for_each(|known| known.heard_ns = known.heard_ns.saturating_add(late_ns).min(now_ns));
    }

    /// Removes and returns the hosts that have been silent for too long.
    pub(crate) fn take_gone(&mut self, silent_max_ns: i64, now_ns: i64) -> Vec<u64> {
        let silent = self.known.iter_mut().filter(|known| !known.gone && now_ns - known.heard_ns > silent_max_ns);
        silent.map(|known| (known.gone = true, known.id).1).collect()
    }

    /// Removes a host that has notified this one that it is leaving.
    pub(crate) fn remove(&mut self, id: u64) {
        self.known.retain(|known| known.id != id);
    }

    pub(crate) fn id(&self, name: &str) -> Option<u64> {
        self.known.iter().find(|known| known.name == name && !known.gone).map(|known| known.id)
    }

    pub(crate) fn offset(&self, id: u64) -> Option<ClockOffset> {
        self.known.iter().find(|known| known.id == id)?.offset
    }

    /// Returns the number of answered pings of a host.
    pub(crate) fn pings(&self, id: u64) -> usize {
        self.known.iter().find(|known| known.id == id).map_or(0, |known| known.agreement.len())
    }

    pub(crate) fn all(&self, now_ns: i64) -> Vec<Peer> {
        self.known.iter().map(|known| known.peer(now_ns)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn host(id: u64, name: &str, now_ns: i64) -> KnownPeer {
        KnownPeer::new(id, name.to_owned(), "target".to_owned(), now_ns)
    }

    #[test]
    fn a_name_is_taken_until_its_host_is_silent() {
        let mut peers = Peers::default();
        assert_eq!(peers.admit(host(1, "b", 0), 0), Ok(None));
        assert_eq!(peers.admit(host(1, "b", 0), 0), Ok(None), "the same host asks again");
        let refused = peers.admit(host(2, "b", 0), 300 * MS).expect_err("the name is taken");
        assert!(refused.contains("'b' has already joined and was heard 300 ms ago"), "{refused}");
        assert_eq!(peers.admit(host(2, "b", 0), 1_000 * MS), Ok(Some(1)));
        assert_eq!(peers.id("b"), Some(2));
        peers.remove(2);
        assert_eq!(peers.id("b"), None);
    }

    #[test]
    fn a_silent_host_is_gone_once_and_can_come_back() {
        let mut peers = Peers::default();
        assert_eq!(peers.admit(host(1, "b", 0), 0), Ok(None));
        assert!(peers.take_gone(5_000 * MS, 5_000 * MS).is_empty());
        assert_eq!(peers.take_gone(5_000 * MS, 5_001 * MS), [1]);
        assert!(peers.take_gone(5_000 * MS, 5_002 * MS).is_empty());
        assert_eq!(peers.id("b"), None, "no link is made to a host that is gone");
        assert_eq!(peers.heard(1, None, None, None, 9_000 * MS), Some(MessageMeaning { whole_again: true, clock: None }));
        assert_eq!(peers.heard(1, None, None, None, 9_100 * MS), Some(MessageMeaning::default()));
        assert_eq!((peers.id("b"), peers.heard(7, None, None, None, 0)), (Some(1), None));
    }

    #[test]
    fn a_side_that_stood_still_itself_blames_nobody() {
        let mut peers = Peers::default();
        assert_eq!(peers.admit(host(1, "b", 0), 0), Ok(None));
        peers.stood_still(20_000 * MS, 20_000 * MS);
        assert!(peers.take_gone(5_000 * MS, 20_100 * MS).is_empty());
        assert_eq!(peers.take_gone(5_000 * MS, 25_001 * MS), [1], "its silence counts from then on");
    }

    #[test]
    fn a_limit_is_told_when_it_is_passed_in_either_direction() {
        let mut peers = Peers::default();
        assert_eq!(peers.admit(host(1, "b", 0), 0), Ok(None));
        let mut told = |wall_offset_ns: i64| {
            let offset = ClockOffset { clock_offset_ns: i64::MAX, uncertainty_ns: 5, wall_offset_ns };
            peers.heard(1, Some(offset), None, Some(100), 0).expect("it is known").clock.map(|report| (report.beyond, report.host))
        };
        assert_eq!(told(-100), None);
        assert_eq!(told(-101), Some((true, "b".to_owned())));
        assert_eq!(told(500), None);
        assert_eq!(told(0), Some((false, "b".to_owned())));
    }
}
