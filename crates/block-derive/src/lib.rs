// SPDX-License-Identifier: Apache-2.0
//! `#[derive(FunctionBlock)]` and `#[derive(Type)]`: the Rust form of the block interface. The crate `opengpac` re-exports and documents
//! both.

mod block;
mod item;
mod text;
mod types;

use proc_macro::TokenStream;
use syn::{DeriveInput, parse_macro_input};

/// Makes a struct a function block: each field is an item of its interface.
#[proc_macro_derive(FunctionBlock, attributes(block, input, output, param, state, device, condition, size))]
pub fn function_block(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    block::expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}

/// Makes a `#[repr(C)]` struct a type that items may have.
#[proc_macro_derive(Type, attributes(block))]
pub fn type_of_items(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    types::expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}
