// SPDX-License-Identifier: Apache-2.0
use crate::section::{Kind, Section};
use crate::span::Span;
use opengpac::{FunctionBlock, Invocation, Outcome, Step};
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

/// The kind of filter is unknown.
const UNKNOWN_KIND: u32 = 1;
/// The frequency or the quality factor is not above 0.
const NOT_POSITIVE: u32 = 2;
/// The frequency is not below half the invocation rate.
const TOO_HIGH: u32 = 3;

/// Second-order low-pass, high-pass, band-pass or notch filter: H(s) = 1, s^2, s/q or s^2 + 1 over s^2 + s/q + 1, s in units of 2 pi
/// frequency.
///
/// Discretised by the bilinear transform for the interval of its invocations, and prewarped so that the frequency is exact; starts at
/// rest at its first sample, so that there is no transient from 0. Quality 0.7071 gives a Butterworth filter; the width of a notch is
/// frequency / quality. Source: Franklin, Powell and Workman, Digital Control of Dynamic Systems, 6.1. Range: frequency above 0 and below
/// half the invocation rate, quality above 0. Faults: 1 the kind of filter is not 0 (low-pass), 1 (high-pass), 2 (band-pass) or 3
/// (notch); 2 frequency or quality is not above 0; 3 the frequency is not below half the invocation rate.
#[derive(FunctionBlock)]
pub struct SecondOrder {
    /// raw signal
    #[input]
    u: f64,
    /// filtered signal
    #[output]
    y: f64,
    /// 0 low-pass, 1 high-pass, 2 band-pass, 3 notch
    #[param(default = 0, range = "[0, 3]")]
    kind: u32,
    /// corner frequency, or centre frequency of the band or notch
    #[param(default = 10.0, unit = "Hz", range = "(0, inf)")]
    frequency: f64,
    /// quality factor q
    #[param(default = FRAC_1_SQRT_2, range = "(0, inf)")]
    quality: f64,
    /// time of the previous invocation
    #[state(opaque)]
    span: Span,
    /// span, frequency, quality and kind for which the coefficients were computed
    #[state]
    designed: [f64; 4],
    /// coefficients
    #[state]
    coefficients: [f64; 5],
    /// filter state
    #[state]
    memory: [f64; 2],
    /// first sample
    #[state]
    first: f64,
}

impl SecondOrder {
    /// Computes the coefficients for this span; if there were none yet, starts the filter at rest.
    fn design(&mut self, kind: Kind, span_s: f64) {
        let wanted = [span_s, self.frequency, self.quality, f64::from(self.kind)];
        if wanted == self.designed {
            return;
        }
        let section = kind.section(TAU * self.frequency, self.quality, span_s);
        if self.designed[0] == 0.0 {
            self.memory = section.at_rest(self.first, kind.gain_at_rest() * self.first);
        }
        self.designed = wanted;
        self.coefficients = [section.b0, section.b1, section.b2, section.a1, section.a2];
    }
}

impl Step for SecondOrder {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let kind = match self.kind {
            0 => Kind::Low,
            1 => Kind::High,
            2 => Kind::Band,
            3 => Kind::Notch,
            _ => return Outcome::Fault(UNKNOWN_KIND),
        };
        if !(self.frequency > 0.0 && self.quality > 0.0) {
            return Outcome::Fault(NOT_POSITIVE);
        }
        if !self.span.begun() {
            self.first = self.u;
            self.y = kind.gain_at_rest() * self.u;
        }
        let span_s = self.span.used(invocation);
        if span_s == 0.0 {
            return Outcome::Done;
        }
        if TAU * self.frequency * span_s >= PI {
            return Outcome::Fault(TOO_HIGH);
        }
        self.design(kind, span_s);
        let [b0, b1, b2, a1, a2] = self.coefficients;
        self.y = Section { b0, b1, b2, a1, a2 }.step(self.u, &mut self.memory);
        Outcome::Done
    }
}
