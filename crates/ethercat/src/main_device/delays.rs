// SPDX-License-Identifier: Apache-2.0
//! Delays of a frame from the reference clock to each subdevice, computed from the times at which one frame arrived at their ports.
//!
//! A frame passes the open ports of a subdevice in the order 0, 3, 1, 2 and leaves through the port at which it arrived. The time between
//! two ports is the round-trip delay through all subdevices attached to the second port. After subtracting the delay within these
//! subdevices, what remains is twice the delay of the cable, which is assumed to be equal in both directions.

/// Times of one frame at the ports of a subdevice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ports {
    pub has_clock: bool,
    pub is_open: [bool; 4],
    /// Reception times in the subdevice's local time, ns.
    pub received: [u32; 4],
}

/// Order in which a frame passes the ports.
const ORDER: [usize; 4] = [0, 3, 1, 2];

impl Ports {
    /// Returns the open ports in the order in which a frame passes them, starting at the port at which it arrived.
    fn passed(&self) -> impl Iterator<Item = usize> {
        let is_open = self.is_open;
        ORDER.into_iter().filter(move |port| is_open[*port] || *port == 0)
    }

    /// Returns the time that a frame takes between two ports, ns.
    fn between(&self, from: usize, to: usize) -> u32 {
        self.received[to].wrapping_sub(self.received[from])
    }

    /// Returns the round-trip time of a frame through all attached subdevices, ns.
    fn through(&self) -> u32 {
        self.between(0, self.passed().last().unwrap_or(0))
    }
}

/// Returns the delay of each subdevice from the first one with a clock, ns, in line order; `None` if the subdevice has no clock.
pub fn delays(line: &[Ports]) -> Vec<Option<u32>> {
    let mut delays: Vec<Option<u32>> = vec![None; line.len()];
    // These ports may have further subdevices: each entry is a subdevice and its remaining ports, the next one last.
    let mut branches: Vec<(usize, Vec<usize>)> = Vec::new();
    // Each entry is the subdevice with a clock, and its port, through which a subdevice is reached.
    let mut reached: Vec<Option<(usize, usize)>> = vec![None; line.len()];
    for (at, ports) in line.iter().enumerate() {
        while branches.last().is_some_and(|(_, left)| left.is_empty()) {
            branches.pop();
        }
        if let Some((before, left)) = branches.last_mut()
            && let Some(port) = left.pop()
        {
            reached[at] = if line[*before].has_clock { Some((*before, port)) } else { reached[*before] };
        }
        if ports.has_clock {
            delays[at] = Some(reached[at].map_or(0, |(before, port)| delay(&line[before], delays[before].unwrap_or(0), port, ports)));
        }
        let mut left: Vec<usize> = ports.passed().skip(1).collect();
        left.reverse();
        branches.push((at, left));
    }
    delays
}

/// Returns the delay of a subdevice attached to a port of another subdevice.
fn delay(before: &Ports, before_ns: u32, port: usize, ports: &Ports) -> u32 {
    let previous = before.passed().take_while(|of| *of != port).last().unwrap_or(0);
    let cable = before.between(previous, port).saturating_sub(ports.through()) / 2;
    before_ns.wrapping_add(before.between(0, previous)).wrapping_add(cable)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the ports of a subdevice whose clock is `ahead`; times are relative to the arrival of the frame at port 0.
    fn ports(ahead: u32, times: [Option<u32>; 4]) -> Ports {
        Ports { has_clock: true, is_open: times.map(|time| time.is_some()), received: times.map(|time| ahead.wrapping_add(time.unwrap_or(0))) }
    }

    #[test]
    fn on_a_line_each_cable_is_half_of_what_its_ends_differ_by() {
        let line =
            [ports(1_000, [Some(0), Some(1_600), None, None]), ports(u32::MAX - 300, [Some(0), Some(900), None, None]), ports(77, [Some(0), None, None, None])];
        assert_eq!(delays(&line), [Some(0), Some(350), Some(800)]);
    }

    #[test]
    fn a_branch_is_passed_before_what_is_behind_it() {
        // After the first subdevice, port 3 has a branch of one with 200 ns of cable, and then port 1 another one with 300 ns.
        let line = [ports(5, [Some(0), Some(1_000), None, Some(400)]), ports(9, [Some(0), None, None, None]), ports(2, [Some(0), None, None, None])];
        assert_eq!(delays(&line), [Some(0), Some(200), Some(700)]);
    }

    #[test]
    fn one_without_a_clock_is_a_piece_of_cable() {
        let without = Ports { has_clock: false, is_open: [true, true, false, false], received: [0; 4] };
        let line = [without, ports(0, [Some(0), Some(1_000), None, None]), without, ports(0, [Some(0), None, None, None])];
        assert_eq!(delays(&line), [None, Some(0), None, Some(500)]);
    }

    #[test]
    fn no_times_are_too_wrong() {
        let odd = ports(7, [Some(0), Some(u32::MAX), Some(3), Some(1 << 31)]);
        assert_eq!(delays(&[odd; 9]).len(), 9);
        assert_eq!(delays(&[]), []);
    }
}
