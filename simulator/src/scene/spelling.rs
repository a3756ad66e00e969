//! Suggestions for misspelled words.

/// The known word most like `word`, if any is like it; upper and lower case are alike.
pub(super) fn closest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    closest_above(0.75, word, known)
}

/// The same for words whose similarity, from 0 to 1, is at least `cutoff`: short words need a lower one.
pub(super) fn closest_above<'a>(cutoff: f32, word: &str, known: &[&'a str]) -> Option<&'a str> {
    // Similarity is quadratic in the length, and no known word is long.
    if word.len() > 64 {
        return None;
    }
    let lower: Vec<String> = known.iter().map(|known| known.to_ascii_lowercase()).collect();
    let candidates: Vec<&str> = lower.iter().map(String::as_str).collect();
    let matches = similar::get_close_matches(&*word.to_ascii_lowercase(), &candidates, 1, cutoff);
    let index = lower.iter().position(|candidate| Some(&&**candidate) == matches.first())?;
    Some(known[index])
}
