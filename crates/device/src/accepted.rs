// SPDX-License-Identifier: Apache-2.0
//! The options that a driver accepts: those that it declares, and those of its class.
use crate::class::Class;
use crate::declaration::Declaration;
use crate::option_word::OptionWord;
use crate::watchdog::TIMEOUT;
use crate::worker;

/// Returns the options of a driver for a manual: its own, and those that each of its class has.
pub fn options_of(of: &'static Declaration) -> Vec<&'static OptionWord> {
    accepted(of).collect()
}

/// Returns true if it declares the option of the watchdog itself.
pub(crate) fn has_own_timeout(of: &Declaration) -> bool {
    of.options.iter().any(|word| word.name == TIMEOUT.name)
}

/// Returns the options of a driver, and those that each of its class has.
pub(crate) fn accepted(of: &'static Declaration) -> impl Iterator<Item = &'static OptionWord> + Clone {
    let of_class: &[OptionWord] = if of.class == Class::Worker { &worker::WORDS } else { &[] };
    of.options.iter().chain((!has_own_timeout(of)).then_some(&TIMEOUT)).chain(of_class)
}
