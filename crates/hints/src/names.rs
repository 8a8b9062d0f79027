// SPDX-License-Identifier: Apache-2.0
//! "did you mean": the most similar existing name.

/// Returns the candidate that `word` most probably means, if one is similar: at most a third of the letters differ, or they are equal
/// except for case, or one is the last part of the other, or one is the other with one letter appended.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let most = word.chars().count() / 3;
    let lower = word.to_lowercase();
    let mut best: Option<(usize, &'a str)> = None;
    for candidate in candidates {
        let distance = if candidate.eq_ignore_ascii_case(word) {
            0
        } else if is_tail(candidate, word) || is_tail(word, candidate) || is_longer(candidate, word) || is_longer(word, candidate) {
            most.min(1)
        } else if candidate.len().abs_diff(word.len()) > most + 3 {
            continue;
        } else {
            distance(&lower, &candidate.to_lowercase())
        };
        if distance <= most && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Returns `did you mean 'x'?`, otherwise a list of the candidates (at most eight), or an empty string if there are none.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    let candidates: Vec<&str> = candidates.into_iter().take(10_000).collect();
    match nearest(word, candidates.iter().copied()) {
        Some(name) => format!("did you mean '{name}'?"),
        None if candidates.is_empty() => String::new(),
        None if candidates.len() > 8 => format!("there are {}, …", candidates[..8].join(", ")),
        None => format!("there {} {}", if candidates.len() == 1 { "is only" } else { "are" }, candidates.join(", ")),
    }
}

fn is_tail(long: &str, short: &str) -> bool {
    long.strip_suffix(short).is_some_and(|head| head.ends_with('.'))
}

fn is_longer(long: &str, short: &str) -> bool {
    !short.is_empty() && long.strip_prefix(short).is_some_and(|rest| rest.chars().count() == 1)
}

/// Returns the number of edits (insert, delete, replace, swap of adjacent letters) from one word to the other.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found() {
        assert_eq!(nearest("setpiont", ["setpoint", "measured"]), Some("setpoint"));
        assert_eq!(nearest("Setpoint", ["setpoint"]), Some("setpoint"));
        assert_eq!(nearest("fast", ["rtp0.fast", "rtp0.slow"]), Some("rtp0.fast"));
        assert_eq!(nearest("planner", ["generator", "near"]), None);
        assert_eq!(nearest("yy", ["u", "y"]), Some("y"));
        assert_eq!(nearest("c", ["a", "b"]), None, "one letter says nothing of another");
        assert_eq!(nearest("kd", ["kp"]), None);
    }

    #[test]
    fn without_a_near_name_all_are_listed() {
        assert_eq!(did_you_mean("planner", ["generator", "near"]), "there are generator, near");
        assert_eq!(did_you_mean("x", []), "");
        assert_eq!(did_you_mean("c", ["a", "b"]), "there are a, b");
    }
}
