// SPDX-License-Identifier: Apache-2.0
//! `#[derive(Type)]`.

use crate::text;
use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Fields, Meta, spanned::Spanned};

/// Generates the implementation of `opengpac::Type` for a `#[repr(C)]` struct.
pub fn expand(input: &DeriveInput) -> syn::Result<TokenStream> {
    let Data::Struct(structure) = &input.data else { return Err(syn::Error::new(input.span(), "a type of items must be a struct")) };
    let Fields::Named(fields) = &structure.fields else { return Err(syn::Error::new(input.span(), "the members of a type must have names")) };
    let c_layout = input.attrs.iter().any(|attribute| {
        attribute.path().is_ident("repr") && matches!(&attribute.meta, Meta::List(list) if list.tokens.to_string().split(',').any(|word| word.trim() == "C"))
    });
    if !c_layout {
        return Err(syn::Error::new(input.ident.span(), "a type of items needs the layout of C: add #[repr(C)]"));
    }
    let name = match text::given_name(&input.attrs)? {
        Some(name) => name,
        None => text::snake(&input.ident.to_string()),
    };
    let doc = text::first_sentence(&text::doc(&input.attrs));
    let ident = &input.ident;
    let members: Vec<_> = fields.named.iter().map(|field| field.ident.clone().expect("named fields have names")).collect();
    let names: Vec<_> = members.iter().map(ToString::to_string).collect();
    let types: Vec<_> = fields.named.iter().map(|field| &field.ty).collect();
    let nexts = members.iter().skip(1).map(|next| quote!(::core::mem::offset_of!(Self, #next))).chain([quote!(::core::mem::size_of::<Self>())]);
    Ok(quote! {
        // SAFETY: the struct has the layout of C and all its members are types of items.
        unsafe impl ::opengpac::Type for #ident {
            fn text() -> ::std::string::String { ::std::string::String::from(#name) }
            fn zero() -> Self { Self { #(#members: <#types as ::opengpac::Type>::zero()),* } }
            #[inline]
            fn nonfinite(&self) -> u64 { 0 #(| <#types as ::opengpac::Type>::nonfinite(&self.#members))* }
            fn types(found: &mut ::std::vec::Vec<&'static ::opengpac::abi::TypeDescriptor>) {
                static DESCRIPTOR: ::std::sync::OnceLock<&'static ::opengpac::abi::TypeDescriptor> = ::std::sync::OnceLock::new();
                #(<#types as ::opengpac::Type>::types(found);)*
                let this: &'static ::opengpac::abi::TypeDescriptor = DESCRIPTOR.get_or_init(|| ::opengpac::generated::describe_type::<Self>(
                    #name, #doc, &[#((<#types as ::opengpac::Type>::text(), #names)),*]));
                if !found.iter().any(|other| ::std::ptr::eq(*other, this)) { found.push(this); }
            }
            const IS_PADDED: bool =
                0 #(+ ::core::mem::size_of::<#types>())* != ::core::mem::size_of::<Self>() #(|| <#types as ::opengpac::Type>::IS_PADDED)*;
            #[inline]
            unsafe fn clear_padding(at: *mut Self) {
                // SAFETY: the members of the caller's value, and the bytes between them.
                unsafe {
                    #(
                        <#types as ::opengpac::Type>::clear_padding(&raw mut (*at).#members);
                        let end = ::core::mem::offset_of!(Self, #members) + ::core::mem::size_of::<#types>();
                        at.cast::<u8>().add(end).write_bytes(0, #nexts - end);
                    )*
                }
            }
        }
    })
}
