//! The known word closest to a mistyped one.

/// The candidate that the word begins, else the one with the smallest edit distance,
/// where that is at most a third of the word's length (at least one): farther ones
/// mislead.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let candidates: Vec<_> = candidates.into_iter().collect();
    if let Some(longer) = candidates.iter().find(|candidate| candidate.starts_with(word)) {
        return Some(longer);
    }
    let limit = (word.chars().count() / 3).max(1);
    let scored = candidates.into_iter().map(|candidate| (distance(word, candidate), candidate));
    scored.filter(|(cost, _)| *cost <= limit).min_by_key(|(cost, _)| *cost).map(|(_, word)| word)
}

/// Levenshtein distance in characters, letters compared without case.
fn distance(a: &str, b: &str) -> usize {
    strsim::levenshtein(&a.to_ascii_lowercase(), &b.to_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_neighbour_and_nothing_far() {
        assert_eq!(distance("kitten", "sitting"), 3);
        let keys = ["rate-hz", "filter-hz", "noise-a"];
        assert_eq!(nearest("rate_hz", keys), Some("rate-hz"));
        assert_eq!(nearest("rate", ["date", "rate-hz"]), Some("rate-hz"));
        assert_eq!(nearest("FILTER-HZ", keys), Some("filter-hz"));
        assert_eq!(nearest("temperature", keys), None);
    }
}
