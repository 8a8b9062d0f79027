// SPDX-License-Identifier: Apache-2.0
//! Safe handles on their way from the process that runs a device to the supervisor that registers them with the guard.
use device::SafeHandle;
use interconnect::{Link, LinkClosed};
use process_kit::{DESCRIPTORS_MAX, UnixLink};
use serde::{Deserialize, Serialize};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

/// Time for which the other side may leave a frame unread.
const UNREAD: Duration = Duration::from_secs(5);

#[derive(Serialize, Deserialize)]
struct Text {
    device: String,
    /// The writes of each handle; its descriptor has the same place among those of the frame.
    writes: Vec<Vec<(u64, Vec<u8>)>>,
    /// True for each handle whose values stay in force.
    latches: Vec<bool>,
}

/// Sends what makes a device safe, at most [`DESCRIPTORS_MAX`] handles; none: the device is closed. Over a link that carries nothing else.
///
/// # Errors
/// [`LinkClosed`]: the other side is gone, does not read, or there are too many handles.
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

/// Returns the next device and what makes it safe, for [`Guard::hold`](crate::Guard::hold); none if `limit` passed without one.
///
/// # Errors
/// [`LinkClosed`]: the other side is gone, or what came is no handles of a device.
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
