// SPDX-License-Identifier: Apache-2.0
//! Safe handles on their way to the supervisor.
use device::SafeHandle;
use guard::{receive_handles, send_handles};
use interconnect::{Link, LinkClosed};
use process_kit::{SharedMemory, UnixLink};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(300);

fn pair() -> (UnixLink, UnixLink) {
    let (ours, theirs) = UnixLink::pair().unwrap();
    (ours, UnixLink::from_descriptor(theirs).unwrap())
}

#[test]
fn safe_handles_reach_the_supervisor_with_their_device() {
    let (a, b) = pair();
    let memory = SharedMemory::new(16).unwrap();
    let handle = |writes| SafeHandle { descriptor: memory.descriptor().unwrap(), writes, latches: true };
    send_handles(&a, "arm", &[handle(vec![(0, vec![1; 8])]), handle(vec![(8, vec![2; 4]), (12, vec![3; 4])])]).unwrap();
    send_handles(&a, "lamp", &[]).unwrap();
    let (device, handles) = receive_handles(&b, LIMIT).unwrap().expect("in time");
    let writes: Vec<_> = handles.iter().map(|handle| handle.writes.clone()).collect();
    assert!(handles.iter().all(|handle| handle.latches));
    assert_eq!((device.as_str(), writes), ("arm", vec![vec![(0, vec![1; 8])], vec![(8, vec![2; 4]), (12, vec![3; 4])]]));
    assert!(handles.into_iter().all(|handle| SharedMemory::received(handle.descriptor, 16).is_ok()));
    assert!(receive_handles(&b, LIMIT).unwrap().is_some_and(|(device, handles)| device == "lamp" && handles.is_empty()));
    assert!(receive_handles(&b, Duration::ZERO).unwrap().is_none());
    a.send(br#"{"device": "arm", "writes": [[]], "latches": [true]}"#).unwrap();
    assert_eq!(receive_handles(&b, LIMIT).err(), Some(LinkClosed), "a handle without its descriptor");
}
