// SPDX-License-Identifier: Apache-2.0
//! `#[derive(FunctionBlock)]` and `#[derive(Type)]`: the block interface in Rust. The crate `opengpac` re-exports and documents both.

mod block;
mod item;
mod text;
mod types;

use proc_macro::TokenStream;
use syn::{DeriveInput, parse_macro_input};

/// Turns a struct into a function block: each field is an item of its interface.
#[proc_macro_derive(FunctionBlock, attributes(block, input, output, param, state, device, condition, size))]
pub fn function_block(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    block::expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}

/// Turns a `#[repr(C)]` struct into a type that items may have.
#[proc_macro_derive(Type, attributes(block))]
pub fn type_of_items(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    types::expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}
