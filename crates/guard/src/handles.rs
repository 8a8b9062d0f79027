// SPDX-License-Identifier: Apache-2.0
//! Transfer of safe handles from the process that runs a device to the supervisor that registers them with the guard.
use device::SafeHandle;
use interconnect::{Link, LinkClosed};
use process_kit::{DESCRIPTORS_MAX, UnixLink};
use serde::{Deserialize, Serialize};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

/// Maximum time for which the other side may leave a frame unread.
const UNREAD: Duration = Duration::from_secs(5);

#[derive(Serialize, Deserialize)]
struct Text {
    device: String,
    /// Writes of each handle. The handle's descriptor has the same index in the frame.
    writes: Vec<Vec<(u64, Vec<u8>)>>,
    /// True for each handle whose written values stay in force.
    latches: Vec<bool>,
}

/// Sends the safe handles of a device, at most [`DESCRIPTORS_MAX`]; an empty list if the device is closed. The link must not carry
/// anything else.
///
/// # Errors
/// [`LinkClosed`] if the other side has disconnected or does not read, or there are too many handles.
pub fn send_handles(link: &UnixLink, device: &str, handles: &[SafeHandle]) -> Result<(), LinkClosed> {
    let text = Text {
        device: device.to_owned(),
        writes: handles.iter().map(|handle| handle.writes.clone()).collect(),
        latches: handles.iter().map(|handle| handle.latches).collect(),
    };
    let descriptors: Vec<BorrowedFd<'_>> = handles.iter().map(|handle| handle.descriptor.as_fd()).collect();
    if descriptors.len() > DESCRIPTORS_MAX {
        return Err(LinkClosed);
    }
    link.send_with(&crate::messages::encode(&text), &descriptors, Some(UNREAD))
}

/// Returns the next device and its safe handles, for [`Guard::hold`](crate::Guard::hold); `None` if none arrived within `limit`.
///
/// # Errors
/// [`LinkClosed`] if the other side has disconnected, or the message does not contain the handles of a device.
pub fn receive_handles(link: &UnixLink, limit: Duration) -> Result<Option<(String, Vec<SafeHandle>)>, LinkClosed> {
    let Some((frame, descriptors)) = link.receive_with(limit)? else { return Ok(None) };
    match serde_json::from_slice::<Text>(&frame) {
        Ok(text) if text.writes.len() == descriptors.len() && text.latches.len() == descriptors.len() => {
            let texts = text.writes.into_iter().zip(text.latches);
            let handles = descriptors.into_iter().zip(texts).map(|(descriptor, (writes, latches))| SafeHandle { descriptor, writes, latches }).collect();
            Ok(Some((text.device, handles)))
        }
        _ => {
            link.close();
            Err(LinkClosed)
        }
    }
}
