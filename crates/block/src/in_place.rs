// SPDX-License-Identifier: Apache-2.0
//! Values that a block uses in place. Normally an invocation copies its inputs before it runs and its outputs afterwards, which suits a
//! few numbers but is too slow for a table of a megabyte.

use crate::Type;
use core::ops::{Deref, DerefMut};

/// An input that is read in place: `#[input(asynchronous, in_place)] table: InPlace<[f64; 65536]>`. The value does not change while the
/// block runs.
pub struct InPlace<T>(*const T);

/// An output that is written in place: `#[output(in_place)] table: InPlaceMut<[f64; 65536]>`, initialised with zeros at each start.
///
/// Values that an invocation has written are kept, even if the invocation faults or is aborted. A table should therefore be marked as
/// complete by a number that is written last. The values are not checked for infinities and NaNs.
pub struct InPlaceMut<T>(*mut T);

/// A port that is used in place, for the derive macro.
pub trait Lying {
    /// Type of the value.
    type Value: Type;
    /// Image of an unbound port.
    const NOWHERE: Self;
    /// Returns the port bound to an address.
    ///
    /// # Safety
    /// `address` must point to a value that no other code accesses during the lifetime of the port.
    unsafe fn at(address: *mut Self) -> Self;
}

impl<T: Type> Lying for InPlace<T> {
    type Value = T;
    const NOWHERE: InPlace<T> = InPlace(core::ptr::null());
    unsafe fn at(address: *mut Self) -> Self {
        InPlace(address.cast())
    }
}

impl<T: Type> Lying for InPlaceMut<T> {
    type Value = T;
    const NOWHERE: InPlaceMut<T> = InPlaceMut(core::ptr::null_mut());
    unsafe fn at(address: *mut Self) -> Self {
        InPlaceMut(address.cast())
    }
}

const BOUND: &str = "the kernel binds every port before it runs a block";

impl<T> Deref for InPlace<T> {
    type Target = T;
    fn deref(&self) -> &T {
        // SAFETY: who made it has promised so; one that leads nowhere is null.
        unsafe { self.0.as_ref() }.expect(BOUND)
    }
}

impl<T> Deref for InPlaceMut<T> {
    type Target = T;
    fn deref(&self) -> &T {
        // SAFETY: as of `InPlace`.
        unsafe { self.0.as_ref() }.expect(BOUND)
    }
}

impl<T> DerefMut for InPlaceMut<T> {
    fn deref_mut(&mut self) -> &mut T {
        // SAFETY: as of `InPlace`; the value is borrowed as the port is.
        unsafe { self.0.as_mut() }.expect(BOUND)
    }
}
