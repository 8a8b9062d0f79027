// SPDX-License-Identifier: Apache-2.0
//! Types that items may have.

use crate::abi::TypeDescriptor;

/// A type of ports, parameters and states: the fixed-width integers, `f32`, `f64`, `bool`, arrays, and structs with `#[derive(Type)]`.
///
/// # Safety
/// The type must have the layout of the C type named by `text`, and must contain no pointers or references, because the real-time system copies it bytewise.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the type of an item",
    label = "not a type that an item can have",
    note = "an item must be an integer of fixed width, f32, f64, bool, an array of these, or a #[repr(C)] struct with #[derive(opengpac::Type)]"
)]
pub unsafe trait Type: Copy + 'static {
    /// Returns the C type: `"double"`, `"double[6]"`, `"pose"`.
    fn text() -> String;
    /// Returns the value with all bytes zero.
    fn zero() -> Self;
    /// Returns a word whose top bit is set if a floating-point number in the value is infinite or NaN.
    fn nonfinite(&self) -> u64;
    /// Adds the struct types that this type contains to `found`, unless already present.
    fn types(found: &mut Vec<&'static TypeDescriptor>);

    /// True if a value has padding between its members or after them.
    const IS_PADDED: bool = false;
    /// Sets the padding of a value to zero, so that equal values have equal bytes. Needed because a replay compares bytes.
    ///
    /// # Safety
    /// `at` must point to a value, and no other code may access the value during the call.
    unsafe fn clear_padding(_at: *mut Self) {}
}

macro_rules! exact {
    ($($rust:ty, $c:literal, $zero:literal;)+) => {$(
        // SAFETY: a scalar with the layout of its C namesake.
        unsafe impl Type for $rust {
            fn text() -> String { $c.to_string() }
            fn zero() -> Self { $zero }
            #[inline(always)]
            fn nonfinite(&self) -> u64 { 0 }
            fn types(_: &mut Vec<&'static TypeDescriptor>) {}
        }
    )+};
}

exact! {
    i8, "int8_t", 0; i16, "int16_t", 0; i32, "int32_t", 0; i64, "int64_t", 0;
    u8, "uint8_t", 0; u16, "uint16_t", 0; u32, "uint32_t", 0; u64, "uint64_t", 0; bool, "bool", false;
}

// SAFETY: a C double.
unsafe impl Type for f64 {
    fn text() -> String {
        "double".to_string()
    }
    fn zero() -> Self {
        0.0
    }
    #[inline(always)]
    fn nonfinite(&self) -> u64 {
        // For an exponent of all ones, adding one carries into the top bit.
        (self.to_bits() & 0x7ff0_0000_0000_0000) + 0x0010_0000_0000_0000
    }
    fn types(_: &mut Vec<&'static TypeDescriptor>) {}
}

// SAFETY: a C float.
unsafe impl Type for f32 {
    fn text() -> String {
        "float".to_string()
    }
    fn zero() -> Self {
        0.0
    }
    #[inline(always)]
    fn nonfinite(&self) -> u64 {
        u64::from((self.to_bits() & 0x7f80_0000) + 0x0080_0000) << 32
    }
    fn types(_: &mut Vec<&'static TypeDescriptor>) {}
}

// SAFETY: a Rust array lies as a C array does.
unsafe impl<T: Type, const N: usize> Type for [T; N] {
    fn text() -> String {
        // The outer length comes first, as in C: [[f64; 3]; 2] is double[2][3].
        let element = T::text();
        match element.find('[') {
            Some(bracket) => format!("{}[{N}]{}", &element[..bracket], &element[bracket..]),
            None => format!("{element}[{N}]"),
        }
    }
    fn zero() -> Self {
        [T::zero(); N]
    }
    #[inline(always)]
    fn nonfinite(&self) -> u64 {
        self.iter().fold(0, |top, element| top | element.nonfinite())
    }
    fn types(found: &mut Vec<&'static TypeDescriptor>) {
        T::types(found);
    }

    const IS_PADDED: bool = T::IS_PADDED;
    #[inline(always)]
    unsafe fn clear_padding(at: *mut Self) {
        if T::IS_PADDED {
            // SAFETY: the elements of the caller's array.
            (0..N).for_each(|index| unsafe { T::clear_padding(at.cast::<T>().add(index)) });
        }
    }
}
