// SPDX-License-Identifier: Apache-2.0
//! Messages between the side that asks and a process of the kit.
use process_kit::UnixLink;
use serde_json::Value;
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// The name of the descriptor of the link.
pub(super) const LINK: &str = "link";
/// Any wait for a process: only to end one that hangs.
pub(super) const LIMIT: Duration = Duration::from_secs(60);

/// Says something to the other side, with what it hands over.
pub(super) fn tell(link: &UnixLink, news: &Value, descriptors: &[BorrowedFd<'_>]) -> Result<(), String> {
    link.send_with(news.to_string().as_bytes(), descriptors, Some(LIMIT)).map_err(|_| "the other side is gone".to_owned())
}
