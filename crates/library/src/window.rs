// SPDX-License-Identifier: Apache-2.0
//! Most recent values of a signal, for blocks that look back.

/// Maximum number of values in a window.
pub const WINDOW_MAX: usize = 256;

/// Ring buffer of the most recent values.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    values: [f64; WINDOW_MAX],
    next: u8,
    held: u16,
}

impl Default for Window {
    fn default() -> Window {
        Window { values: [0.0; WINDOW_MAX], next: 0, held: 0 }
    }
}

impl Window {
    /// Adds a value.
    pub fn push(&mut self, value: f64) {
        self.values[usize::from(self.next)] = value;
        // 256 values: the byte index wraps around by itself.
        self.next = self.next.wrapping_add(1);
        self.held = (self.held + 1).min(WINDOW_MAX as u16);
    }

    /// Returns the `length` most recent values, newest first, or all values so far if there are fewer.
    pub fn last(&self, length: usize) -> impl ExactSizeIterator<Item = f64> + '_ {
        let count = length.min(usize::from(self.held));
        (0..count).map(move |back| self.values[(usize::from(self.next) + WINDOW_MAX - 1 - back) % WINDOW_MAX])
    }

    /// Returns the value from `back` invocations ago, 0 being the newest; `None` if there are not enough values.
    pub fn before(&self, back: usize) -> Option<f64> {
        (back < usize::from(self.held)).then(|| self.values[(usize::from(self.next) + WINDOW_MAX - 1 - back) % WINDOW_MAX])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_the_last_256() {
        let mut window = Window::default();
        assert_eq!((window.last(3).len(), window.before(0)), (0, None));
        for k in 0..600 {
            window.push(f64::from(k));
        }
        assert_eq!(window.last(3).collect::<Vec<_>>(), [599.0, 598.0, 597.0]);
        assert_eq!((window.last(999).len(), window.before(255), window.before(256)), (256, Some(344.0), None));
    }
}
