// SPDX-License-Identifier: Apache-2.0
//! Movements: the work that an instance needs from the kernels, in order, and its execution.
//!
//! A movement begins when all previous ones in the sequence of its instance have been acknowledged. Movements in brackets occur only if
//! needed; `home` is `Home`, which is replaced by `Carry`, `Arrive`, `Tables`, `Inbound` and `Follow`.
//!
//! | what | movements in order | created in |
//! |---|---|---|
//! | creation | \[`Scripts` that fill windows\], `Tables`, \[`Tables`, `Inbound` of its connections\] | `instances::create` |
//! | start: its SVVs | \[`Carry`, `Arrive`\], \[`Tables`, `Inbound`\], \[`Follow`\], \[`Tables` of taps\] | `claims::takeover`, `starting::start` |
//! | start: its list | `Opening`, \[`Scripts`, `Operating`\], \[`Scripts`, `CopyInitial`\], then as for a stage | `starting::opening` |
//! | stage | \[home\], `Scripts`, one after each `execute` that spans several sources, \[`Ready`\], `Entered` | `transitions::stages` |
//! | exchange of a device's verb | as for the SVVs of a start, then `Scripts` that replace one verb with the other, `Entered` | `devices::exchange` |
//! | suspension | `Scripts`: intervals off, then readers of other sources, then outputs safe and the clock stopped; `Suspended` | `suspension::suspend` |
//! | resumption | `Scripts`: awake, then its stage and activations; `Resumed` | `suspension::suspend` |
//! | end | remaining tables, connections and cells; `Scripts`: off, safe, captured; `Ended` | `ending::end` |
//! | deletion | remaining tables and connections, not awaited | `movements::removing` |
//!
//! A table of the only source of an instance is sent together with the script that follows it, as `Together`.
pub(crate) mod carrier;
pub(crate) mod entering;
pub(crate) mod histories;
pub(crate) mod home_moves;
pub(crate) mod homing;
pub(crate) mod proceed;
pub(crate) mod removing;
pub(crate) mod sequence;
pub(crate) mod turning;
