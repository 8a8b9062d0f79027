// SPDX-License-Identifier: Apache-2.0
//! Types as trees with their layouts, for programming systems that read and write the bytes of values.
use super::Type;
use serde::Serialize;

/// A C type with its layout.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TypeTree {
    #[serde(flatten)]
    pub form: TypeForm,
    /// Normalised declaration.
    pub text: String,
    /// Size of a value in bytes, including padding.
    pub size: usize,
    /// Alignment, bytes.
    pub align: usize,
}

/// Structure of a type.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum TypeForm {
    /// C name of the scalar: `double`, `int32_t`, `bool`.
    Scalar(String),
    /// Type and number of the elements.
    Array(Box<TypeTree>, usize),
    /// Name, type and offset in bytes of each member.
    Struct(Vec<(String, TypeTree, usize)>),
}

impl Type {
    /// Returns the type as a tree with its layout.
    pub fn tree(&self) -> TypeTree {
        let form = match self {
            Type::Scalar(_) => TypeForm::Scalar(self.normalised()),
            Type::Array(element, count) => TypeForm::Array(Box::new(element.tree()), *count),
            Type::Struct(members) => {
                let members = members.iter().zip(self.offsets());
                TypeForm::Struct(members.map(|(member, offset)| (member.name.clone(), member.member_type.tree(), offset)).collect())
            }
        };
        TypeTree { form, text: self.normalised(), size: self.size(), align: self.align() }
    }
}
