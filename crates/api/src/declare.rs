// SPDX-License-Identifier: Apache-2.0
//! Syntax for declaring a call.

/// Declares calls. Everything that is known of a call stands here, and nowhere else:
///
/// ```ignore
/// api::calls! {
///     /// Calls on lamps.
///     pub(crate) const LAMPS about "lamps" = [
///         /// Lights a lamp. Returns how long it has been dark, ns.
///         Operate light(
///             /// The name of the lamp.
///             must name: String,
///             /// How bright it is, 0 to 1; 1 where it is left out.
///             may brightness: Option<f64>,
///         ) -> u64: commands("name"), told
///             => |system| system.light(&name, brightness);
///     ];
/// }
/// ```
///
/// The role comes first: the lowest one that may make the call. An argument that `must` be given, or `may` be; the last one may be
/// `whole`: all that is left of the object, as one value. Behind the answer stand the properties of the call, each a method of
/// [`Call`](crate::Call). The body is an expression with the arguments by their names; a call that `lasts` has the slice of real time
/// that it may take as a second name, `|system, slice|`, and gives an [`Outcome`](crate::Outcome).
#[macro_export]
macro_rules! calls {
    ($(#[$about:meta])* $vis:vis const $CALLS:ident about $subject:literal = [$(
        $(#[doc = $doc:literal])*
        $role:ident $name:ident ( $($arguments:tt)* ) -> $answer:ty
        $(: $($flag:ident $( ( $($with:expr),* ) )?),+ )?
        => |$system:ident $(, $slice:ident)?| $body:expr;
    )*];) => {
        $(#[$about])*
        $vis const $CALLS: &[$crate::Call] = &[$(
            $crate::declared_call!(
                ($role $name $subject [$($doc),*] $answer; [$($($flag ($($($with),*)?)),+)?] [$system $(, $slice)?] $body)
                {} () () $($arguments)*
            )
        ),*];
    };
}

/// Declares one call of [`calls!`]: takes its arguments one at a time, then creates its [`Call`](crate::Call) from them.
#[doc(hidden)]
#[macro_export]
macro_rules! declared_call {
    ($head:tt {$($fields:tt)*} ($($named:tt)*) () $(#[$words:meta])* must $field:ident: $of:ty $(, $($rest:tt)*)?) => {
        $crate::declared_call!($head {$($fields)* $(#[$words])* $field: $of,} ($($named)* must $field: $of,) () $($($rest)*)?)
    };
    ($head:tt {$($fields:tt)*} ($($named:tt)*) () $(#[$words:meta])* may $field:ident: $of:ty $(, $($rest:tt)*)?) => {
        $crate::declared_call!($head {$($fields)* $(#[$words])* #[serde(default)] $field: $of,} ($($named)* may $field: $of,) () $($($rest)*)?)
    };
    ($head:tt $fields:tt $named:tt () whole $field:ident: $of:ty $(,)?) => {
        $crate::declared_call!($head $fields $named ($field: $of))
    };
    (
        ($role:ident $name:ident $subject:literal [$($doc:literal),*] $answer:ty; [$($flag:ident $with:tt),*] [$system:ident $(, $slice:ident)?] $body:expr)
        {$($fields:tt)*} ($($need:ident $field:ident: $of:ty,)*) ($($whole:ident: $all:ty)?)
    ) => {{
        #[derive(::serde::Deserialize, ::schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        struct Arguments {
            $($fields)*
        }

        fn careful(text: &str) -> Result<(Arguments, ($($all,)?)), $crate::Refusals> {
            #[allow(unused_mut, reason = "a call without arguments takes none")]
            let mut given = $crate::CallArguments::of(stringify!($name), text)?;
            $(let $field: $of = given.$need(stringify!($field))?;)*
            $(let $whole: $all = given.whole()?;)?
            given.none_left()?;
            Ok((Arguments { $($field),* }, ($($whole,)?)))
        }

        fn make(system: &$crate::System, text: &str, slice: ::std::time::Duration) -> Result<$crate::Outcome<$answer>, $crate::Refusals> {
            let (Arguments { $($field),* }, ($($whole,)?)) = match $crate::quick_arguments!(text [$($field)*] [$($whole)?]) {
                Some(quick) => quick,
                None => careful(text)?,
            };
            let ($system, _slice) = (system, slice);
            $(let $slice = _slice;)?
            $body.map(Into::into)
        }

        $crate::Call::of(
            (stringify!($name), $subject, &[$($doc),*]),
            $crate::Role::$role,
            |generator| <Arguments as ::schemars::JsonSchema>::json_schema(generator),
            |generator| generator.subschema_for::<$answer>(),
            |system, text, slice| make(system, text, slice)?.answered(),
            |system, text, slice| make(system, text, slice)?.answered(),
        )
        $(.whole(stringify!($whole), |generator| generator.subschema_for::<$all>()))?
        $(.$flag $with)*
    }};
}

/// Parses arguments directly into their types if they are correct. Otherwise the slow path determines the message; it is also used for a
/// `whole` argument in addition to named ones.
#[doc(hidden)]
#[macro_export]
macro_rules! quick_arguments {
    ($text:ident [$($field:ident)*] []) => {
        $crate::quick::<Arguments>($text).map(|named| (named, ()))
    };
    ($text:ident [] [$whole:ident]) => {
        $crate::quick($text).map(|whole| (Arguments {}, (whole,)))
    };
    ($text:ident [$($field:ident)+] [$whole:ident]) => {
        None
    };
}
