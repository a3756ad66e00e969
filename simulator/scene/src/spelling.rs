//! Suggestions for misspelled words.

/// Minimum similarity of a suggestion, from 0 to 1.
pub const SIMILAR: f64 = 0.65;

/// Maximum length of a word that gets suggestions: similarity costs time in proportion to the product of the lengths.
const MAX_LENGTH: usize = 128;

/// Similarity of two words from 0 to 1, ignoring case: one minus the number of insertions, deletions, substitutions and
/// transpositions from one to the other, relative to the longer one. 0 for very long words.
pub fn similarity(word: &str, known: &str) -> f64 {
    if word.len() > MAX_LENGTH {
        return 0.0;
    }
    let [word, known] = [word, known].map(str::to_ascii_lowercase);
    strsim::normalized_damerau_levenshtein(&word, &known)
}

/// The known word most similar to `word`, if any is similar.
pub fn closest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let similar = known.iter().map(|known| (similarity(word, known), *known));
    // Of equally similar words, the first.
    let best = similar.rev().max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(similarity, _)| *similarity >= SIMILAR).map(|(_, known)| known)
}
