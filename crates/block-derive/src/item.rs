// SPDX-License-Identifier: Apache-2.0
//! Field of a block, as declared by its attribute.

use crate::text;
use proc_macro2::{Ident, TokenStream};
use quote::quote;
use syn::{Attribute, Field, Meta, Type, spanned::Spanned};

/// Kind of a field.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Input,
    Output,
    DeviceRead,
    DeviceWrite,
    Condition,
    ConditionOf,
    Parameter,
    State,
    Size,
}

/// A field with its attribute.
pub struct Item {
    pub kind: Kind,
    pub name: Ident,
    pub ty: Type,
    pub doc: String,
    pub unit: TokenStream,
    pub asynchronous: bool,
    pub ratio: Option<TokenStream>,
    pub value: Option<TokenStream>,
    pub keep: bool,
    pub opaque: bool,
    pub nonfinite: bool,
    pub sized: bool,
    pub history: bool,
    pub in_place: bool,
    pub least: TokenStream,
    pub most: TokenStream,
}

const WORDS: &str = "every field must be an item of the block: give it #[input], #[output], #[param(default = ...)], #[state], #[device(read)], \
                     #[device(write)], #[condition] or #[size(least, most)]";

impl Item {
    /// Reads a field.
    pub fn new(field: &Field) -> syn::Result<Item> {
        let name = field.ident.clone().ok_or_else(|| syn::Error::new(field.span(), "the items of a block must have names: use a struct with named fields"))?;
        let mut declared = None;
        for attribute in &field.attrs {
            let word = attribute.path().get_ident().map(ToString::to_string).unwrap_or_default();
            if matches!(word.as_str(), "input" | "output" | "param" | "state" | "device" | "condition" | "size") {
                if declared.is_some() {
                    return Err(syn::Error::new(attribute.span(), "an item can have only one role: keep one attribute"));
                }
                declared = Some((word, attribute));
            }
        }
        let Some((word, attribute)) = declared else { return Err(syn::Error::new(name.span(), WORDS)) };
        let doc = text::doc(&field.attrs);
        if doc.is_empty() {
            return Err(syn::Error::new(name.span(), "an item needs a description: write a doc comment above it, `/// what it is`"));
        }
        let mut item = Item {
            kind: kind(&word, &field.ty),
            name,
            ty: field.ty.clone(),
            doc,
            unit: quote!(""),
            asynchronous: false,
            ratio: None,
            value: None,
            keep: false,
            opaque: false,
            nonfinite: false,
            sized: false,
            history: false,
            in_place: false,
            least: quote!(0),
            most: quote!(0),
        };
        item.read(&word, attribute)?;
        Ok(item)
    }

    fn read(&mut self, word: &str, attribute: &Attribute) -> syn::Result<()> {
        let given = match &attribute.meta {
            Meta::List(list) => text::arguments(list.tokens.clone())?,
            _ => Vec::new(),
        };
        if word == "size" {
            let [(least, None), (most, None)] = &given[..] else {
                return Err(syn::Error::new(attribute.span(), "a size needs the minimum and maximum number of elements: #[size(1, 16)] n: u32"));
            };
            self.least = quote!(#least);
            self.most = quote!(#most);
            return Ok(());
        }
        let (mut way, mut unit, mut range) = (false, quote!(""), None);
        for (name, value) in given {
            match (word, name.to_string().as_str(), value) {
                (_, "unit", Some(text)) => unit = text,
                ("input" | "param" | "condition", "range", Some(text)) => range = Some(text),
                (_, "sized", None) => self.sized = true,
                ("input" | "output", "asynchronous", None) => self.asynchronous = true,
                ("input", "history", None) => (self.history, self.asynchronous) = (true, true),
                ("input" | "output", "in_place", None) => self.in_place = true,
                ("input" | "output", "ratio", Some(n)) => self.ratio = Some(n),
                ("input" | "param", "default", Some(value)) | ("state", "initial", Some(value)) | ("condition", "preset", Some(value)) => {
                    self.value = Some(value)
                }
                ("output", "nonfinite", None) => self.nonfinite = true,
                ("state", "keep", None) => self.keep = true,
                ("state", "opaque", None) => self.opaque = true,
                ("device", "read", None) => (self.kind, way) = (Kind::DeviceRead, true),
                ("device", "write", None) => (self.kind, way) = (Kind::DeviceWrite, true),
                (_, other, _) => return Err(syn::Error::new(name.span(), format!("`{other}` cannot be used like this in #[{word}]: {}", forms(word)))),
            }
        }
        // A descriptor has a single text for unit and range: "rad/s (0, 10]".
        self.unit = match range {
            Some(range) => quote!(concat!(#unit, " ", #range)),
            None => unit,
        };
        if word == "param" && self.value.is_none() {
            return Err(syn::Error::new(attribute.span(), "a parameter needs a default: #[param(default = 0.1)]"));
        }
        if word == "device" && !way {
            return Err(syn::Error::new(attribute.span(), "a device channel must be read or written: #[device(read)] or #[device(write)]"));
        }
        if self.asynchronous && self.ratio.is_some() {
            return Err(syn::Error::new(attribute.span(), "a port can have only one mode: `asynchronous` or `ratio = n`"));
        }
        if self.in_place && (self.sized || self.history || self.value.is_some() || self.ratio.is_some()) {
            return Err(syn::Error::new(
                attribute.span(),
                "a port that is used in place cannot have a size, history, default or ratio: #[input(asynchronous, in_place)] table: InPlace<[f64; 65536]>",
            ));
        }
        if self.history && (self.sized || self.value.is_some()) {
            return Err(syn::Error::new(
                attribute.span(),
                "a history has as many values as its array, and cannot have a default: #[input(history)] u: [f64; 8]",
            ));
        }
        Ok(())
    }
}

fn kind(word: &str, ty: &Type) -> Kind {
    match word {
        "input" => Kind::Input,
        "output" => Kind::Output,
        "param" => Kind::Parameter,
        "state" => Kind::State,
        "device" => Kind::DeviceRead,
        "size" => Kind::Size,
        _ => match ty {
            Type::Path(path) if path.path.segments.last().is_some_and(|last| last.ident == "ConditionOf") => Kind::ConditionOf,
            _ => Kind::Condition,
        },
    }
}

fn forms(word: &str) -> &'static str {
    match word {
        "input" => "#[input(asynchronous, ratio = n, history, default = value, sized, in_place, unit = \"rad\", range = \"[0, 1]\")]",
        "output" => "#[output(asynchronous, ratio = n, nonfinite, sized, in_place, unit = \"rad\")]",
        "param" => "#[param(default = value, sized, unit = \"rad\", range = \"[0, 1]\")]",
        "state" => "#[state(initial = value, keep, opaque, sized, unit = \"rad\")]",
        "device" => "#[device(read)] or #[device(write)], unit = \"rad\"",
        _ => "#[condition(preset = value, unit = \"rad\", range = \"[0, 1]\")]",
    }
}
