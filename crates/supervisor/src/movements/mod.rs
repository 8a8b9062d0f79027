// SPDX-License-Identifier: Apache-2.0
//! Movements: what an instance needs of the kernels, in order, and carrying it out.
//!
//! A movement follows when everything before it in the sequence of its instance has been acknowledged. What stands in brackets comes only where it
//! is needed; `home` is `Home`, for which `Carry`, `Arrive`, `Tables`, `Inbound` and `Follow` come in its place.
//!
//! | what | movements in their order | made in |
//! |---|---|---|
//! | creation | \[`Scripts` that fill windows\], `Tables`, \[`Tables`, `Inbound` of its connections\] | `instances::create` |
//! | start: its SVVs | \[`Carry`, `Arrive`\], \[`Tables`, `Inbound`\], \[`Follow`\], \[`Tables` of taps\] | `claims::takeover`, `starting::start` |
//! | start: its list | `Opening`, \[`Scripts`, `Operating`\], \[`Scripts`, `CopyInitial`\], then as a stage | `starting::opening` |
//! | stage | \[home\], `Scripts`, one after each `execute` that reaches over sources, \[`Ready`\], `Entered` | `transitions::stages` |
//! | exchange of a device's verb | as the start of its SVVs, then `Scripts` that put one in the place of the other, `Entered` | `devices::exchange` |
//! | suspension | `Scripts`: intervals off, then readers of other sources, then outputs safe and the clock stopped; `Suspended` | `suspension::suspend` |
//! | resumption | `Scripts`: awake, then its stage and activations; `Resumed` | `suspension::suspend` |
//! | end | what is left of tables, connections and cells; `Scripts`: off, safe, captured; `Ended` | `ending::end` |
//! | deletion | what is left of tables and connections, waited for by nobody | `movements::removing` |
//!
//! A table of the only source of an instance goes with the script behind it, as `Together`.
pub(crate) mod carrier;
pub(crate) mod entering;
pub(crate) mod histories;
pub(crate) mod home_moves;
pub(crate) mod homing;
pub(crate) mod proceed;
pub(crate) mod removing;
pub(crate) mod sequence;
pub(crate) mod turning;
