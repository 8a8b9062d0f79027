// SPDX-License-Identifier: Apache-2.0
//! Options of a driver that exchanges on a thread of its own. The program that opens drivers provides the thread, because this crate has
//! none.
use crate::accepted::{IN_PLACE, WORKER};
use crate::driver::Driver;
use crate::error::DriverError;
use crate::life::Life;
use crate::option_word::OptionWord;
use crate::options::GivenOptions;
use std::sync::OnceLock;

/// Default period of a worker's exchange, ns.
const PERIOD_NS: i64 = 10_000_000;

/// Pace of a worker's exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    pub period_ns: i64,
    /// Maximum time since the latest exchange, ns, above which the device counts as lost.
    pub age_max_ns: i64,
    /// Maximum age of the readings, ns, if set; above it, the device counts as lost. An exchange may succeed although the device has not
    /// sent anything new for longer than that.
    pub taken_max_ns: Option<i64>,
    /// Time for which to wait for the device to appear, ns.
    pub waits_ns: i64,
    /// True if the driver exchanges on the thread of its source, because under the virtual clock no thread has its own pace.
    pub in_place: bool,
}

/// Function that wraps a driver in one that exchanges on a thread of its own; its last channel is `age`, the age of its readings.
pub type Worker = fn(Box<dyn Driver>, Pace) -> Box<dyn Driver>;

static LENT: OnceLock<Worker> = OnceLock::new();

/// Sets the worker that provides drivers with threads in this process. Only the first call has an effect.
pub fn lend_worker(worker: Worker) {
    LENT.get_or_init(|| worker);
}

pub(crate) fn lent() -> Option<Worker> {
    LENT.get().copied()
}

/// Returns the pace that the options set, and the remaining options.
pub(crate) fn pace<'a>(given: &GivenOptions<'a>, life: &Life) -> Result<(Pace, GivenOptions<'a>), DriverError> {
    let of = |word: &OptionWord| given.value()[word.name].as_i64();
    let rest = WORKER.iter().fold(given.without(""), |rest, word| rest.without(word.name));
    let [period, age_max, _] = &WORKER;
    let period_ns = of(period).unwrap_or(PERIOD_NS);
    let taken_max_ns = of(age_max);
    let age_max_ns = taken_max_ns.unwrap_or(if life.lost_within_ns > 0 { life.lost_within_ns } else { 10 * period_ns });
    if age_max_ns < 2 * period_ns {
        return Err(given.wrong(age_max.name, format!("it must be at least two periods, {} ms", 2.0 * period_ns as f64 * 1e-6)));
    }
    let in_place = given.value()[IN_PLACE.name].as_bool() == Some(true);
    Ok((Pace { period_ns, age_max_ns, taken_max_ns, waits_ns: life.waits_ns, in_place }, rest))
}
