// SPDX-License-Identifier: Apache-2.0
//! Names that generated C cannot use: keywords, and macros of the headers that blocks include.

/// Keywords of C, and the name of the block inside its body.
const KEYWORDS: &str = "
    alignas alignof asm auto bool break case char const constexpr continue default do double else enum extern false float for goto if
    inline int long nullptr register restrict return self short signed sizeof static static_assert struct switch thread_local true typedef
    typeof typeof_unqual union unsigned void volatile while
";
const KEYWORDS_OF_CXX: &str = "
    and and_eq asm bitand bitor catch char16_t char32_t char8_t class co_await co_return co_yield compl concept const_cast consteval constinit
    decltype delete dynamic_cast explicit export friend mutable namespace new noexcept not not_eq operator or or_eq private protected public
    reinterpret_cast requires static_cast template this throw try typeid typename using virtual wchar_t xor xor_eq
";
const MACROS: &str = "
    BIG_ENDIAN BUFSIZ BYTE_ORDER DECIMAL_DIG EOF FAULT FILENAME_MAX FOPEN_MAX
    INFINITY LITTLE_ENDIAN MATH_ERREXCEPT MATH_ERRNO NAN NULL OK PDP_ENDIAN linux unix errno math_errhandling stderr stdin stdout offsetof
    FP_ILOGB0 FP_ILOGBNAN FP_INFINITE FP_NAN FP_NORMAL FP_SUBNORMAL FP_ZERO HUGE_VAL HUGE_VALF HUGE_VALL M_1_PI M_2_PI M_2_SQRTPI M_E
    M_LN10 M_LN2 M_LOG10E M_LOG2E M_PI M_PI_2 M_PI_4 M_SQRT1_2 M_SQRT2
";

/// Prefixes of the macros for floating-point types and of this project's header, followed by prefixes of the macros for integer limits.
const BEGINNINGS: [&str; 6] = ["DBL_", "FLT_", "LDBL_", "OG_", "OPENGPAC", "opengpac"];
const LIMITS: [&str; 19] = [
    "CHAR_",
    "INT",
    "LLONG_",
    "LONG_",
    "MB_",
    "PTRDIFF_",
    "SCHAR_",
    "SHRT_",
    "SIG_ATOMIC_",
    "SIZE_",
    "SSIZE_",
    "UCHAR_",
    "UINT",
    "ULLONG_",
    "ULONG_",
    "USHRT_",
    "WCHAR_",
    "WINT_",
    "RAND_",
];

/// Words of a block's declaration and body. Items may have these names, but a hand-written body cannot use them.
const OF_BLOCKS: [&str; 3] = ["in", "out", "report"];

/// Returns true if a name has another meaning in C, in one of the headers that blocks include, or in the declaration of a block.
pub fn is_word_of_c(name: &str) -> bool {
    OF_BLOCKS.contains(&name) || is_taken_in_c(name)
}

/// Returns true if a name has another meaning in C or in one of the headers that blocks include.
pub(crate) fn is_taken_in_c(name: &str) -> bool {
    let is_limit = ["_MAX", "_MIN", "_BIT", "_WIDTH", "_LEN_MAX"].iter().any(|end| name.ends_with(end)) && LIMITS.iter().any(|begin| name.starts_with(begin));
    is_keyword(name) || is_macro(name) || is_limit || name.starts_with('_') || BEGINNINGS.iter().any(|begin| name.starts_with(begin))
}

/// Returns true if a name is a keyword of C, or `self`.
pub(super) fn is_keyword(name: &str) -> bool {
    KEYWORDS.split_whitespace().any(|word| word == name)
}

/// Returns true if a name is a keyword of C++ but not of C.
pub(super) fn is_keyword_of_cxx(name: &str) -> bool {
    KEYWORDS_OF_CXX.split_whitespace().any(|word| word == name)
}

/// Returns true if a name is a macro of a header that blocks include.
pub(super) fn is_macro(name: &str) -> bool {
    MACROS.split_whitespace().any(|word| word == name)
}
