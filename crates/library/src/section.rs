// SPDX-License-Identifier: Apache-2.0
//! Second-order sections: common part of the filters.

/// Coefficients of y_k = b0 u_k + b1 u_(k-1) + b2 u_(k-2) - a1 y_(k-1) - a2 y_(k-2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Section {
    pub b0: f64,
    pub b1: f64,
    pub b2: f64,
    pub a1: f64,
    pub a2: f64,
}

/// State of a section in transposed direct form II, which is the form least sensitive to rounding (Oppenheim and Schafer, Discrete-Time
/// Signal Processing, 6.3).
pub type Memory = [f64; 2];

impl Section {
    /// Computes the output of one invocation.
    #[inline]
    pub fn step(&self, u: f64, memory: &mut Memory) -> f64 {
        let y = self.b0 * u + memory[0];
        memory[0] = self.b1 * u - self.a1 * y + memory[1];
        memory[1] = self.b2 * u - self.a2 * y;
        y
    }

    /// Returns the state after a constant input u has always given the output y.
    pub fn at_rest(&self, u: f64, y: f64) -> Memory {
        [y - self.b0 * u, self.b2 * u - self.a2 * y]
    }

    /// Returns true if both poles are inside the unit circle (Jury's stability triangle).
    pub fn stable(&self) -> bool {
        self.a2.abs() < 1.0 && self.a1.abs() < 1.0 + self.a2
    }
}

/// Pass band of a second-order filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Low,
    High,
    Band,
    Notch,
}

impl Kind {
    /// Returns the DC gain.
    pub fn gain_at_rest(self) -> f64 {
        if matches!(self, Kind::Low | Kind::Notch) { 1.0 } else { 0.0 }
    }

    /// Returns the section for a corner or centre frequency of `omega` rad/s and a quality factor, with one invocation every `span_s`, by
    /// the bilinear transform, prewarped so that the frequency is exact. The frequency must be below half the invocation rate.
    pub fn section(self, omega: f64, quality: f64, span_s: f64) -> Section {
        let (sin, cos) = (omega * span_s).sin_cos();
        let alpha = sin / (2.0 * quality);
        let scale = 1.0 / (1.0 + alpha);
        let (b0, b1, b2) = match self {
            Kind::Low => (0.5 * (1.0 - cos), 1.0 - cos, 0.5 * (1.0 - cos)),
            Kind::High => (0.5 * (1.0 + cos), -(1.0 + cos), 0.5 * (1.0 + cos)),
            Kind::Band => (alpha, 0.0, -alpha),
            Kind::Notch => (1.0, -2.0 * cos, 1.0),
        };
        Section { b0: b0 * scale, b1: b1 * scale, b2: b2 * scale, a1: -2.0 * cos * scale, a2: (1.0 - alpha) * scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_it_stays_at_rest() {
        for kind in [Kind::Low, Kind::High, Kind::Band, Kind::Notch] {
            let section = kind.section(300.0, 0.7, 1e-3);
            assert!(section.stable());
            let mut memory = section.at_rest(3.0, 3.0 * kind.gain_at_rest());
            for _ in 0..100 {
                assert!((section.step(3.0, &mut memory) - 3.0 * kind.gain_at_rest()).abs() < 1e-12, "{kind:?}");
            }
        }
    }
}
