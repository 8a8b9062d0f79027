// SPDX-License-Identifier: Apache-2.0
//! `#[derive(FunctionBlock)]`: generates the memory of an instance, its entry and its descriptor in the block's own crate, so that the
//! compiler keeps the values in registers.

use crate::item::{Item, Kind};
use crate::text;
use proc_macro2::{Ident, TokenStream};
use quote::quote;
use syn::{Data, DeriveInput, Fields, spanned::Spanned};

const ITEMS_MAX: usize = 32;

/// Generates the implementation of `opengpac::FunctionBlock`.
pub fn expand(input: &DeriveInput) -> syn::Result<TokenStream> {
    let items = items(input)?;
    let ident = &input.ident;
    let name = match text::given_name(&input.attrs)? {
        Some(name) => name,
        None => text::snake(&ident.to_string()),
    };
    let doc = text::description(&text::doc(&input.attrs));
    if doc.is_empty() {
        return Err(syn::Error::new(ident.span(), "a block needs a description: write a doc comment above it whose first sentence says what it computes"));
    }
    let size = items.iter().find(|item| item.kind == Kind::Size);
    let memory = memory(ident, &items);
    let entry = entry(ident, &items, size);
    let specs = items.iter().map(|item| spec(item, size)).collect::<Vec<_>>();
    let image = items.iter().map(initial).collect::<Vec<_>>();
    let bound = items.iter().filter(|item| is_bound(item)).map(|item| &item.name).collect::<Vec<_>>();
    let types = items.iter().filter(|item| !item.opaque && !matches!(item.kind, Kind::Condition | Kind::Size)).map(value_type).collect::<Vec<_>>();
    Ok(quote! {
        const _: () = {
            #[cfg(panic = "abort")]
            compile_error!("a function block needs panic = \"unwind\": a panic in it must become the condition `fault`, not the end of the process");
            #memory
            #entry
            impl ::opengpac::FunctionBlock for #ident {
                fn descriptor() -> &'static ::opengpac::abi::Descriptor {
                    static DESCRIPTOR: ::std::sync::OnceLock<&'static ::opengpac::abi::Descriptor> = ::std::sync::OnceLock::new();
                    *DESCRIPTOR.get_or_init(|| ::opengpac::generated::describe_block(
                        #name, #doc, file!(), line!(), run, bank, vec![#(#specs),*],
                        Instance {
                            header: ::opengpac::abi::Header { number: 0, activated: 0 },
                            at: At { #(#bound: ::core::ptr::null_mut()),* },
                            own: #ident { #(#image),* },
                        }))
                }
                fn types() -> ::std::vec::Vec<&'static ::opengpac::abi::TypeDescriptor> {
                    let mut found = ::std::vec::Vec::new();
                    #(<#types as ::opengpac::Type>::types(&mut found);)*
                    found
                }
            }
        };
    })
}

fn items(input: &DeriveInput) -> syn::Result<Vec<Item>> {
    let Data::Struct(structure) = &input.data else { return Err(syn::Error::new(input.span(), "a function block must be a struct: its fields are its items")) };
    let Fields::Named(fields) = &structure.fields else {
        return Err(syn::Error::new(input.span(), "the items of a block must have names: use a struct with named fields"));
    };
    if !input.generics.params.is_empty() {
        return Err(syn::Error::new(
            input.generics.span(),
            "a function block cannot have generic parameters: its interface is fixed; use #[size(least, most)] for any number of elements",
        ));
    }
    let items = fields.named.iter().map(Item::new).collect::<syn::Result<Vec<_>>>()?;
    if items.len() > ITEMS_MAX {
        return Err(syn::Error::new(
            items[ITEMS_MAX].name.span(),
            "a block can have at most 32 items: put several values into an array or a struct with #[derive(Type)]",
        ));
    }
    let mut sizes = items.iter().filter(|item| item.kind == Kind::Size);
    let first = sizes.next();
    if let Some(second) = sizes.next() {
        return Err(syn::Error::new(second.name.span(), "a block can have only one size"));
    }
    if let (None, Some(item)) = (first, items.iter().find(|item| item.sized)) {
        return Err(syn::Error::new(item.name.span(), "a `sized` item needs the block's size: #[size(1, 16)] n: u32"));
    }
    Ok(items)
}

fn is_bound(item: &Item) -> bool {
    matches!(item.kind, Kind::Input | Kind::Output | Kind::DeviceRead | Kind::DeviceWrite)
}

/// Returns the type of an item's value or, for a condition, of the value it reports.
fn value_type(item: &Item) -> TokenStream {
    let ty = &item.ty;
    match item.kind {
        Kind::ConditionOf => quote!(<#ty as ::opengpac::generated::ValuedCondition>::Value),
        _ if item.in_place => quote!(<#ty as ::opengpac::generated::Lying>::Value),
        _ => quote!(#ty),
    }
}

fn memory(ident: &Ident, items: &[Item]) -> TokenStream {
    let (names, types): (Vec<_>, Vec<_>) = items.iter().filter(|item| is_bound(item)).map(|item| (&item.name, &item.ty)).unzip();
    quote! {
        #[repr(C)]
        struct At { #(#names: *mut #types),* }
        #[repr(C)]
        struct Instance { header: ::opengpac::abi::Header, at: At, own: #ident }
    }
}

/// Returns the value of a field in the image of a new instance.
fn initial(item: &Item) -> TokenStream {
    let (name, ty, value) = (&item.name, &item.ty, &item.value);
    match (item.kind, value) {
        (Kind::Condition, _) => quote!(#name: ::opengpac::Condition::new()),
        (Kind::ConditionOf, Some(value)) => quote!(#name: <#ty>::new(#value)),
        (Kind::ConditionOf, None) => quote!(#name: <#ty>::new(::opengpac::Type::zero())),
        (Kind::Size, _) => {
            let least = &item.least;
            quote!(#name: #least)
        }
        (_, Some(value)) => quote!(#name: #value),
        (_, None) if item.in_place => quote!(#name: <#ty as ::opengpac::generated::Lying>::NOWHERE),
        (_, None) if item.opaque => quote!(#name: <#ty as ::core::default::Default>::default()),
        (_, None) => quote!(#name: <#ty as ::opengpac::Type>::zero()),
    }
}

fn entry(ident: &Ident, items: &[Item], size: Option<&Item>) -> TokenStream {
    let count = match size {
        Some(item) => {
            let (name, most) = (&item.name, &item.most);
            quote!(let count = ::core::cmp::min((*m).own.#name, #most) as usize;)
        }
        None => quote!(),
    };
    let load = items.iter().map(load);
    let top = items.iter().map(top);
    let which = items.iter().enumerate().map(|(index, item)| which(index as u64, item));
    let store = items.iter().map(store);
    let reports = items.iter().enumerate().filter(|(_, item)| matches!(item.kind, Kind::Condition | Kind::ConditionOf)).map(|(index, item)| {
        let (name, bit) = (&item.name, 8 + index as u32);
        quote!(reports |= (local.#name.is_reported() as u64) << #bit;)
    });
    let values = items.iter().filter(|item| item.kind == Kind::ConditionOf).map(|item| {
        let name = &item.name;
        quote!((*m).own.#name.value = local.#name.value;)
    });
    quote! {
        unsafe extern "C" fn run(memory: *mut ::core::ffi::c_void, given: *const ::opengpac::Invocation) -> u64 {
            // SAFETY: `abi::Run` asks of its caller what `once` does.
            unsafe { once(memory, given) }
        }
        unsafe extern "C" fn bank(calls: *const ::opengpac::bank::Call, step: *mut u32, from: u32, to: u32) -> u64 {
            // SAFETY: `bank::Bank` asks of its caller what this does.
            unsafe { ::opengpac::bank::run(calls, step, from, to, |memory, given| once(memory, given)) }
        }
        /// Runs one invocation; shared by both entries.
        #[inline(always)]
        unsafe fn once(memory: *mut ::core::ffi::c_void, given: *const ::opengpac::Invocation) -> u64 {
            use ::opengpac::abi::outcome;
            let m = memory as *mut Instance;
            // SAFETY: the kernel passes the memory of an instance of this block with every address bound, and an invocation;
            // `abi::Run` says so.
            unsafe {
                let number = (*m).header.number;
                // Volatile, because a signal handler that may end the invocation reads it.
                let next = &raw mut (*m).header.number;
                next.write_volatile(number.wrapping_add(1) | ::opengpac::abi::RUNNING);
                let invocation = ::opengpac::Invocation { number, time_ns: (*given).time_ns, now_ns: (*given).now_ns };
                #count
                let mut local = #ident { #(#load),* };
                match ::opengpac::generated::contain(|| <#ident as ::opengpac::Step>::step(&mut local, &invocation)) {
                    ::core::option::Option::Some(::opengpac::Outcome::Done) => {}
                    ::core::option::Option::Some(::opengpac::Outcome::Fault(code)) => {
                        next.write_volatile(number.wrapping_add(1));
                        return outcome::FAULT | (code as u64) << outcome::SHIFT;
                    }
                    ::core::option::Option::None => {
                        next.write_volatile(number.wrapping_add(1));
                        return outcome::PANIC;
                    }
                }
                let top: u64 = 0 #(#top)*;
                next.write_volatile(number.wrapping_add(1));
                // From this point it is not ended: no store below may precede clearing the mark.
                ::core::sync::atomic::compiler_fence(::core::sync::atomic::Ordering::SeqCst);
                if (top as i64) < 0 {
                    #(#which)*
                }
                #(#store)*
                let mut reports: u64 = 0;
                #(#reports)*
                if reports != 0 {
                    #(#values)*
                }
                reports
            }
        }
    }
}

fn load(item: &Item) -> TokenStream {
    let (name, ty) = (&item.name, &item.ty);
    match item.kind {
        _ if item.in_place => quote!(#name: <#ty as ::opengpac::generated::Lying>::at((*m).at.#name)),
        Kind::Input | Kind::DeviceRead if item.sized => quote!(#name: ::opengpac::generated::load_sized((*m).at.#name, count)),
        Kind::Input | Kind::DeviceRead => quote!(#name: *(*m).at.#name),
        Kind::Condition => quote!(#name: ::opengpac::Condition::new()),
        Kind::ConditionOf => quote!(#name: ::opengpac::ConditionOf::of((*m).own.#name.preset, (*m).own.#name.value)),
        _ => quote!(#name: (*m).own.#name),
    }
}

fn nonfinite(item: &Item) -> Option<TokenStream> {
    let (name, ty) = (&item.name, &item.ty);
    if !matches!(item.kind, Kind::Output | Kind::DeviceWrite) || item.nonfinite || item.in_place {
        return None;
    }
    Some(match item.sized {
        true => quote!(::opengpac::generated::nonfinite_sized(&local.#name, count)),
        false => quote!(<#ty as ::opengpac::Type>::nonfinite(&local.#name)),
    })
}

fn top(item: &Item) -> TokenStream {
    nonfinite(item).map(|check| quote!(| #check)).unwrap_or_default()
}

fn which(index: u64, item: &Item) -> TokenStream {
    nonfinite(item).map(|check| quote!(if (#check as i64) < 0 { return outcome::NONFINITE | #index << outcome::SHIFT; })).unwrap_or_default()
}

fn store(item: &Item) -> TokenStream {
    let name = &item.name;
    let through = match item.sized {
        true => quote!(::opengpac::generated::store_sized((*m).at.#name, &local.#name, count);),
        false => quote!(::opengpac::generated::store((*m).at.#name, &local.#name);),
    };
    match (item.kind, &item.ratio) {
        _ if item.in_place => quote!(),
        (Kind::Output, Some(n)) => quote! {
            if number.wrapping_sub((*m).header.activated).wrapping_add(1) % (#n as u64) == 0 { #through }
            (*m).own.#name = local.#name;
        },
        (Kind::Output | Kind::DeviceWrite, _) => quote!(#through (*m).own.#name = local.#name;),
        (Kind::State, _) => quote!((*m).own.#name = local.#name;),
        _ => quote!(),
    }
}

/// Generates the item's `opengpac::generated::ItemSpec`.
fn spec(item: &Item, size: Option<&Item>) -> TokenStream {
    let (name, doc, unit, ty) = (&item.name, &item.doc, &item.unit, value_type(item));
    let text = name.to_string();
    let text = text.strip_prefix("r#").unwrap_or(&text);
    let size_name = size.map(|item| item.name.to_string()).unwrap_or_default();
    let kind = match item.kind {
        Kind::Input => quote!(INPUT),
        Kind::Output => quote!(OUTPUT),
        Kind::DeviceRead => quote!(DEVICE_READ),
        Kind::DeviceWrite => quote!(DEVICE_WRITE),
        Kind::Condition | Kind::ConditionOf => quote!(CONDITION),
        Kind::Parameter => quote!(PARAMETER),
        Kind::State => quote!(STATE),
        Kind::Size => quote!(SIZE),
    };
    let (mode, mut ratio) = match (&item.ratio, item.asynchronous) {
        (Some(n), _) => (quote!(RATIO), quote!(#n)),
        (None, true) => (quote!(ASYNCHRONOUS), quote!(0)),
        (None, false) => (quote!(SYNCHRONOUS), quote!(0)),
    };
    let has_default = item.kind == Kind::Input && item.value.is_some();
    let (nonfinite, keep, sized, history) = (item.nonfinite || item.in_place && item.kind == Kind::Output, item.keep, item.sized, item.history);
    let value = match (item.kind, item.opaque, item.sized) {
        _ if history => quote!(::opengpac::generated::ValueSpec::history::<#ty>()),
        (Kind::Condition, ..) => quote!(::opengpac::generated::ValueSpec::none()),
        (Kind::Size, ..) => {
            let (least, most) = (&item.least, &item.most);
            ratio = quote!(#least);
            quote!(::opengpac::generated::ValueSpec::size::<#ty>(#most))
        }
        (_, true, _) => quote!(::opengpac::generated::ValueSpec::opaque::<#ty>()),
        (_, _, true) => quote!(::opengpac::generated::ValueSpec::sized::<#ty>(#size_name)),
        _ => quote!(::opengpac::generated::ValueSpec::of::<#ty>()),
    };
    let offset = match item.kind {
        Kind::Condition => quote!(None),
        _ if item.in_place => quote!(None),
        Kind::ConditionOf => quote!(Some(::core::mem::offset_of!(Instance, own.#name.preset))),
        _ => quote!(Some(::core::mem::offset_of!(Instance, own.#name))),
    };
    let report = match item.kind {
        Kind::ConditionOf => quote!(Some(::core::mem::offset_of!(Instance, own.#name.value))),
        _ => quote!(None),
    };
    let address = match is_bound(item) {
        true => quote!(Some(::core::mem::offset_of!(Instance, at.#name))),
        false => quote!(None),
    };
    quote! {
        ::opengpac::generated::ItemSpec {
            kind: ::opengpac::abi::kind::#kind, mode: ::opengpac::abi::mode::#mode, ratio: #ratio, name: #text, unit: #unit, doc: #doc,
            has_default: #has_default, nonfinite: #nonfinite, keep: #keep, sized: #sized, history: #history,
            value: #value, offset: #offset, address: #address, report: #report,
        }
    }
}
