// SPDX-License-Identifier: Apache-2.0
//! Options accepted by a driver: the options that it declares, and those of its class.
use crate::class::Class;
use crate::declaration::Declaration;
use crate::option_word::{Kind, OptionWord};

/// Range of the timeout: a shorter one cannot be met by any source, and a longer one gives no protection.
const TIMEOUT_NS: [f64; 2] = [1e6, 3.6e12];

/// Option for the watchdog, for drivers that do not declare one themselves.
pub(crate) const TIMEOUT: OptionWord = OptionWord::with_default(
    "timeout_ns",
    Kind::Whole,
    "none",
    "its watchdog: after this time without a new command, once something moves, it goes to its safe state by itself",
)
.unit("ns")
.within(TIMEOUT_NS[0], TIMEOUT_NS[1]);

/// Option to exchange on the thread of the source, as is done under the virtual clock.
pub(crate) const IN_PLACE: OptionWord =
    OptionWord::with_default("in_place", Kind::Bool, "false; true under the virtual clock", "exchanges on the thread of its source: for tests");

/// Options of every driver of class `worker`.
pub(crate) const WORKER: [OptionWord; 3] = [
    OptionWord::with_default("period_ns", Kind::Whole, "10 ms", "period of its exchange, on a separate thread").unit("ns").within(1e5, 1e10),
    OptionWord::with_default(
        "age_max_ns",
        Kind::Whole,
        "as the driver declares; a device that delivers nothing new may then do so for a long time",
        "maximum age of a reading: with older ones the device is lost",
    )
    .unit("ns")
    .within(2e5, 3.6e12),
    IN_PLACE,
];

/// Returns the options of a driver for a manual: its own options and those of its class.
pub fn options_of(of: &'static Declaration) -> Vec<&'static OptionWord> {
    accepted(of).collect()
}

/// Returns true if the driver declares the watchdog option itself.
pub(crate) fn has_own_timeout(of: &Declaration) -> bool {
    of.options.iter().any(|word| word.name == TIMEOUT.name)
}

/// Returns the options of a driver and those of its class.
pub(crate) fn accepted(of: &'static Declaration) -> impl Iterator<Item = &'static OptionWord> + Clone {
    let of_class: &[OptionWord] = if of.class == Class::Worker { &WORKER } else { &[] };
    of.options.iter().chain((!has_own_timeout(of)).then_some(&TIMEOUT)).chain(of_class)
}
