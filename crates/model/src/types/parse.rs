// SPDX-License-Identifier: Apache-2.0
//! Parser of C type declarations.
use super::{Member, Scalar, Type};
use crate::refusal::{Class, Refusal};
use indexmap::IndexMap;

/// Maximum size of a value, bytes.
const SIZE_MAX: usize = 1 << 30;
/// Maximum depth of nested structs and of names that refer to names.
const DEPTH_MAX: usize = 32;

impl Type {
    /// Parses a C type: `double`, `double[6]`, `double[3][2]`, `struct { double x; double q[4]; }`, or a name in `types`.
    ///
    /// # Errors
    /// `DefinitionError` that names the unknown word and suggests a correction.
    pub fn parse(text: &str, types: &IndexMap<String, String>) -> Result<Type, Refusal> {
        Type::parse_sized(text, types, None)
    }

    /// Parses as [`Type::parse`] does; a name in brackets (`double[n]`) stands for `size` elements.
    ///
    /// # Errors
    /// Fails as [`Type::parse`] does, and if a name is in brackets and `size` is `None`.
    pub fn parse_sized(text: &str, types: &IndexMap<String, String>, size: Option<u32>) -> Result<Type, Refusal> {
        let mut reader = Reader { text, tokens: tokens(text), at: 0, types, size, depth: 0 };
        let base = reader.base()?;
        let read = reader.dimensions(base)?;
        match reader.next() {
            "" => Ok(read),
            token => Err(reader.refusal(format!("'{token}' is not expected here"))),
        }
    }
}

fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut start = None;
    for (at, c) in text.char_indices() {
        let word = c.is_alphanumeric() || c == '_';
        if word && start.is_none() {
            start = Some(at);
        }
        if !word {
            tokens.extend(start.take().map(|from: usize| &text[from..at]));
            if !c.is_whitespace() {
                tokens.push(&text[at..at + c.len_utf8()]);
            }
        }
    }
    tokens.extend(start.map(|from| &text[from..]));
    tokens
}

struct Reader<'a> {
    text: &'a str,
    tokens: Vec<&'a str>,
    at: usize,
    types: &'a IndexMap<String, String>,
    size: Option<u32>,
    depth: usize,
}

impl<'a> Reader<'a> {
    fn peek(&self) -> &'a str {
        self.tokens.get(self.at).copied().unwrap_or("")
    }

    fn next(&mut self) -> &'a str {
        let token = self.peek();
        self.at += 1;
        token
    }

    fn expect(&mut self, wanted: &str) -> Result<(), Refusal> {
        match self.next() {
            token if token == wanted => Ok(()),
            "" => Err(self.refusal(format!("'{wanted}' is missing at the end"))),
            token => Err(self.refusal(format!("'{wanted}' is expected before '{token}'"))),
        }
    }

    fn refusal(&self, why: String) -> Refusal {
        Refusal::new(Class::DefinitionError, format!("cannot read the type '{}': {why}", self.text))
    }

    /// Parses a scalar, a struct or a name, without trailing dimensions.
    fn base(&mut self) -> Result<Type, Refusal> {
        if self.depth > DEPTH_MAX {
            return Err(self.refusal(format!("it is nested more than {DEPTH_MAX} types deep")).remedy("a type cannot contain itself"));
        }
        while matches!(self.peek(), "const" | "volatile" | "typedef") {
            self.at += 1;
        }
        if self.peek() == "struct" {
            self.at += 1;
            let tag = if is_name(self.peek()) { self.next() } else { "" };
            return if self.peek() == "{" { self.members() } else { self.named(tag) };
        }
        let mut words = Vec::new();
        while is_name(self.peek()) && (words.is_empty() || is_word_of_scalar(self.peek()) && is_word_of_scalar(words[0])) {
            words.push(self.next());
        }
        match words[..] {
            [] if self.peek().is_empty() => Err(self.refusal("it is empty".into())),
            [] => Err(self.refusal(format!("'{}' is not a type", self.peek()))),
            _ => self.scalar(&words),
        }
    }

    fn scalar(&mut self, words: &[&str]) -> Result<Type, Refusal> {
        let joined = words.join(" ");
        let scalar = match joined.as_str() {
            "double" => Scalar::Double,
            "float" => Scalar::Float,
            "bool" | "_Bool" => Scalar::Bool,
            "int8_t" | "signed char" => Scalar::Int8,
            "uint8_t" | "unsigned char" => Scalar::Uint8,
            "int16_t" | "short" | "short int" | "signed short" => Scalar::Int16,
            "uint16_t" | "unsigned short" | "unsigned short int" | "short unsigned int" => Scalar::Uint16,
            "int32_t" | "int" | "signed" | "signed int" => Scalar::Int32,
            "uint32_t" | "unsigned" | "unsigned int" => Scalar::Uint32,
            "int64_t" | "long long" | "long long int" | "signed long long" => Scalar::Int64,
            "uint64_t" | "unsigned long long" | "unsigned long long int" | "long long unsigned int" => Scalar::Uint64,
            "long" | "long int" | "signed long" => return Err(self.width(&joined, "int64_t")),
            "unsigned long" | "size_t" | "long unsigned int" => return Err(self.width(&joined, "uint64_t")),
            "char" => return Err(self.refusal("'char' is signed only on some machines".into()).remedy("write int8_t or uint8_t")),
            "long double" => return Err(self.width(&joined, "double")),
            "void" => return Err(self.refusal("'void' has no value".into())),
            _ => return self.named(&joined),
        };
        if self.peek() == "*" {
            let why = "it is a pointer, which means nothing in another process".to_owned();
            return Err(self.refusal(why).remedy(format!("write an array, for example {joined}[6]")));
        }
        Ok(Type::Scalar(scalar))
    }

    fn width(&self, word: &str, instead: &str) -> Refusal {
        self.refusal(format!("'{word}' does not have the same width on all machines")).remedy(format!("write {instead}"))
    }

    fn named(&mut self, name: &str) -> Result<Type, Refusal> {
        let Some(declaration) = self.types.get(name) else {
            let known = ["double", "float", "bool", "int32_t", "int64_t", "uint32_t", "uint64_t", "int8_t", "uint8_t", "int16_t", "uint16_t"];
            let meant = hints::nearest(name, known.into_iter().chain(self.types.keys().map(String::as_str)));
            let remedy = meant.map_or_else(|| "declare it as a struct of the module".to_owned(), |m| format!("did you mean '{m}'?"));
            return Err(self.refusal(format!("there is no type '{name}'")).remedy(remedy));
        };
        let types = self.types;
        let mut inner = Reader { text: declaration, tokens: tokens(declaration), at: 0, types, size: self.size, depth: self.depth + 1 };
        let base = inner.base()?;
        inner.dimensions(base)
    }

    fn members(&mut self) -> Result<Type, Refusal> {
        self.expect("{")?;
        self.depth += 1;
        let mut members: Vec<Member> = Vec::new();
        while self.peek() != "}" {
            let base = self.base()?;
            let base = self.dimensions(base)?;
            loop {
                let name = self.next();
                if !is_name(name) {
                    return Err(self.refusal(format!("a member's name is missing before '{name}'")));
                }
                if members.iter().any(|m| m.name == name) {
                    return Err(self.refusal(format!("the member '{name}' appears twice")));
                }
                let member_type = self.dimensions(base.clone())?;
                members.push(Member { name: name.to_owned(), member_type });
                if self.peek() != "," {
                    break;
                }
                self.at += 1;
            }
            self.expect(";")?;
        }
        self.expect("}")?;
        self.depth -= 1;
        if members.is_empty() {
            return Err(self.refusal("a struct must have at least one member".into()));
        }
        self.bounded(Type::Struct(members))
    }

    /// Parses dimensions such as `[3][2]` after a type or a member's name: 3 elements of 2 elements each, as in C.
    fn dimensions(&mut self, base: Type) -> Result<Type, Refusal> {
        let mut counts = Vec::new();
        while self.peek() == "[" {
            self.at += 1;
            counts.push(self.count()?);
            self.expect("]")?;
        }
        let mut read = base;
        for count in counts.into_iter().rev() {
            read = self.bounded(Type::Array(Box::new(read), count))?;
        }
        Ok(read)
    }

    fn count(&mut self) -> Result<usize, Refusal> {
        let token = self.next();
        if let Ok(count) = token.parse::<u32>() {
            return match count {
                0 => Err(self.refusal("an array must have at least one element".into())),
                count if count as usize > SIZE_MAX => Err(self.refusal("it is too large".into())),
                count => Ok(count as usize),
            };
        }
        match self.size {
            Some(size) if is_name(token) && size > 0 => Ok(size as usize),
            _ => Err(self.refusal(format!("the number of elements '{token}' is not a number"))),
        }
    }

    fn bounded(&self, read: Type) -> Result<Type, Refusal> {
        let fits = match &read {
            Type::Array(element, count) => element.size().checked_mul(*count).is_some_and(|size| size <= SIZE_MAX),
            _ => read.size() <= SIZE_MAX,
        };
        if fits { Ok(read) } else { Err(self.refusal(format!("it has more than {SIZE_MAX} bytes"))) }
    }
}

fn is_name(token: &str) -> bool {
    token.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_')
}

fn is_word_of_scalar(word: &str) -> bool {
    matches!(word, "unsigned" | "signed" | "long" | "short" | "int" | "char" | "double")
}
