// SPDX-License-Identifier: Apache-2.0
//! Fields of a compiled model, by name.
use super::arm::Arm;
use super::functions::BatchConfig;
use super::refusals;
use device::DriverError;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;

/// Access to the model's fields by name.
pub(super) struct Fields<'a> {
    arm: &'a Arm,
    batch: *mut c_void,
}

impl Drop for Fields<'_> {
    fn drop(&mut self) {
        // SAFETY: the batch was made by `new` and is freed only here.
        unsafe { (self.arm.mujoco.mjb_deleteBatch)(self.batch) }
    }
}

impl<'a> Fields<'a> {
    pub fn new(arm: &'a Arm, path: &Path) -> Result<Fields<'a>, DriverError> {
        let mut message = [0 as c_char; 1000];
        let config = BatchConfig { threads: 1, persistent: true };
        // SAFETY: the model is valid, the configuration lives through the call, the message has the size that is passed.
        let batch = unsafe { (arm.mujoco.mjb_makeBatch)(arm.model, 1, &config, message.as_mut_ptr(), message.len() as c_int) };
        if batch.is_null() {
            // SAFETY: MuJoCo ends the message in NUL.
            let problem = unsafe { CStr::from_ptr(message.as_ptr()) }.to_string_lossy().into_owned();
            return Err(refusals::model(path, &problem));
        }
        Ok(Fields { arm, batch })
    }

    /// Copies the fields, including changes, into the model of the arm.
    pub fn apply(self) {
        // SAFETY: the batch was made from this very model, so the sizes are equal.
        unsafe { (self.arm.mujoco.mjb_getModel)(self.batch, 0, self.arm.model) };
    }

    /// Returns the address of a field in the batch, its number of elements and the element size; a null address for a field without
    /// elements.
    fn place(&self, name: &str) -> (*mut c_void, usize, usize) {
        let name = CString::new(name).expect("field names contain no NUL");
        let (mut count, mut size): (c_int, c_int) = (0, 0);
        // SAFETY: the batch is valid, the name ends in NUL, both results are written before the call returns.
        let place = unsafe { (self.arm.mujoco.mjb_expand)(self.batch, name.as_ptr(), &mut count, &mut size) };
        if place.is_null() { (place, 0, 0) } else { (place, count as usize, size as usize) }
    }

    fn read<T: Copy>(&self, name: &str) -> Vec<T> {
        let (place, count, size) = self.place(name);
        assert!(count == 0 || size == size_of::<T>(), "the field '{name}' has elements of {size} bytes");
        // SAFETY: MuJoCo reports `count` elements of this size at the address; they live as long as the batch.
        (0..count).map(|i| unsafe { *place.cast::<T>().add(i) }).collect()
    }

    pub fn reals(&self, name: &str) -> Vec<f64> {
        self.read(name)
    }

    /// Returns single-precision numbers, as used for colours and meshes.
    pub fn floats(&self, name: &str) -> Vec<f32> {
        self.read(name)
    }

    pub fn ints(&self, name: &str) -> Vec<i32> {
        self.read(name)
    }

    pub fn flags(&self, name: &str) -> Vec<bool> {
        self.read::<u8>(name).into_iter().map(|b| b != 0).collect()
    }

    pub fn set_reals(&self, name: &str, values: &[f64]) {
        let (place, count, size) = self.place(name);
        if count == values.len() && size == 8 {
            // SAFETY: the field has that number of elements of eight bytes.
            values.iter().enumerate().for_each(|(i, value)| unsafe { *place.cast::<f64>().add(i) = *value });
        }
    }

    pub fn set_flags(&self, name: &str, bits: i32) {
        let (place, count, size) = self.place(name);
        if count > 0 && size == 4 {
            // SAFETY: the field has one element of four bytes.
            unsafe { *place.cast::<i32>() |= bits };
        }
    }
}
