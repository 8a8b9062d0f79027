// SPDX-License-Identifier: Apache-2.0
//! Name patterns with `*` and `?`.

/// Returns true if `name` matches the pattern, in which `*` matches any sequence of characters and `?` matches a single character.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut at, mut from) = (0, 0);
    // Position of the last `*`, and position in the name at which the rest was tried.
    let mut star: Option<(usize, usize)> = None;
    while from < name.len() {
        match pattern.get(at) {
            Some('*') => {
                star = Some((at, from));
                at += 1;
            }
            Some(letter) if *letter == '?' || *letter == name[from] => {
                at += 1;
                from += 1;
            }
            _ => {
                let Some((place, tried)) = star else { return false };
                star = Some((place, tried + 1));
                at = place + 1;
                from = tried + 1;
            }
        }
    }
    pattern[at..].iter().all(|letter| *letter == '*')
}

/// Returns true if the pattern can match more than one name.
pub(crate) fn is_open(pattern: &str) -> bool {
    pattern.contains(['*', '?'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_is_any_letters_and_a_question_mark_is_one() {
        for (pattern, name, expected) in [
            ("*", "", true),
            ("*", "arm.joint1", true),
            ("arm.*", "arm.joint1", true),
            ("arm.*", "leg.joint1", false),
            ("*.sensed", "arm.joint1.sensed", true),
            ("*.sensed", "arm.joint1.sensed2", false),
            ("joint?.q", "joint1.q", true),
            ("joint?.q", "joint12.q", false),
            ("a*b*c", "aXbYbZc", true),
            ("a", "a", true),
            ("a", "ab", false),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }
}
