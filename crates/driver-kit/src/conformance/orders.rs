// SPDX-License-Identifier: Apache-2.0
//! Messages between the requesting side and a process of the kit.
use process_kit::UnixLink;
use serde_json::Value;
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// Name of the descriptor of the link.
pub(super) const LINK: &str = "link";
/// Time limit for a process; only intended to end one that hangs.
pub(super) const LIMIT: Duration = Duration::from_secs(60);

/// Sends a message to the other side, with descriptors.
pub(super) fn tell(link: &UnixLink, news: &Value, descriptors: &[BorrowedFd<'_>]) -> Result<(), String> {
    link.send_with(news.to_string().as_bytes(), descriptors, Some(LIMIT)).map_err(|_| "the other side is gone".to_owned())
}
