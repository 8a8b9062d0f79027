// SPDX-License-Identifier: Apache-2.0
//! Names and descriptions taken from a declaration.

use proc_macro2::{TokenStream, TokenTree};
use syn::{Attribute, Expr, Lit, Meta};

/// Returns the doc comment as one line.
pub fn doc(attributes: &[Attribute]) -> String {
    let mut lines = Vec::new();
    for attribute in attributes {
        if let Meta::NameValue(pair) = &attribute.meta
            && pair.path.is_ident("doc")
            && let Expr::Lit(literal) = &pair.value
            && let Lit::Str(line) = &literal.lit
        {
            lines.push(line.value().trim().to_string());
        }
    }
    lines.join(" ").trim().to_string()
}

/// Returns the text up to the full stop that ends the first sentence; the dots of `u_1 + ... + u_n` do not end a sentence.
pub fn first_sentence(doc: &str) -> String {
    match doc.match_indices(". ").map(|(at, _)| at).find(|at| !doc[..*at].ends_with('.')) {
        Some(end) => doc[..=end].to_string(),
        None => doc.to_string(),
    }
}

/// Returns the description of a block for its descriptor, in lines: the first sentence; the rest of the comment, if any; and the meaning
/// of its fault codes, if the comment lists them (`Faults: 1 a limit is not above 0; 2 a goal is out of range.`).
pub fn description(doc: &str) -> String {
    let first = first_sentence(doc);
    let rest = &doc[first.len()..];
    let (more, faults) = rest.split_at(rest.find("Faults: ").unwrap_or(rest.len()));
    [first.as_str(), more.trim(), faults.trim()].iter().filter(|part| !part.is_empty()).copied().collect::<Vec<_>>().join("\n")
}

/// Converts `SetpointGenerator` to `setpoint_generator`.
pub fn snake(name: &str) -> String {
    let mut snake = String::new();
    for (i, c) in name.chars().enumerate() {
        if c.is_uppercase() && i > 0 {
            snake.push('_');
        }
        snake.extend(c.to_lowercase());
    }
    snake
}

/// Parses `a, b = expression, c` into names with optional values.
pub fn arguments(tokens: TokenStream) -> syn::Result<Vec<(TokenTree, Option<TokenStream>)>> {
    let mut arguments = Vec::new();
    let mut tokens = tokens.into_iter().peekable();
    while let Some(name) = tokens.next() {
        let mut value: Option<TokenStream> = None;
        for token in tokens.by_ref() {
            match &token {
                TokenTree::Punct(p) if p.as_char() == ',' => break,
                TokenTree::Punct(p) if p.as_char() == '=' && value.is_none() => value = Some(TokenStream::new()),
                _ => match &mut value {
                    Some(value) => value.extend([token]),
                    None => return Err(syn::Error::new(token.span(), "expected `name` or `name = value` between commas")),
                },
            }
        }
        arguments.push((name, value));
    }
    Ok(arguments)
}

/// Returns the name set by `#[block(name = "...")]`, if there is one.
pub fn given_name(attributes: &[Attribute]) -> syn::Result<Option<String>> {
    let Some(attribute) = attributes.iter().find(|attribute| attribute.path().is_ident("block")) else { return Ok(None) };
    let list = attribute.meta.require_list()?;
    match arguments(list.tokens.clone())?.as_slice() {
        [(word, Some(value))] if word.to_string() == "name" => Ok(Some(syn::parse2::<syn::LitStr>(value.clone())?.value())),
        _ => Err(syn::Error::new_spanned(attribute, "expected #[block(name = \"...\")]")),
    }
}
