//! Winnowing (Schleimer, Wilkerson and Aiken, "Winnowing: Local Algorithms for Document Fingerprinting", SIGMOD 2003).
//!
//! ```text
//! k-grams       every k tokens in a row have a hash
//! fingerprints  of every w hashes in a row, the smallest, and of equal ones the last
//! ```
//!
//! Two texts that share `w + k − 1` tokens in a row share a fingerprint; fewer than `k` shared tokens never match. About
//! `2 / (w + 1)` of all hashes are fingerprints. Linear in the number of tokens.

use super::tokens::Token;

/// Odd, so that no power of it vanishes modulo 2⁶⁴.
const BASE: u64 = 0x9e37_79b9_7f4a_7c15;

/// The hash of every `k` tokens in a row, by the place of the first one.
pub(super) fn k_grams(tokens: &[Token], k: usize) -> Vec<u64> {
    if k == 0 || tokens.len() < k {
        return Vec::new();
    }
    let leaving = BASE.wrapping_pow(k as u32);
    let mut sum = 0_u64;
    let mut hashes = Vec::with_capacity(tokens.len() - k + 1);
    for (place, token) in tokens.iter().enumerate() {
        sum = sum.wrapping_mul(BASE).wrapping_add(value(token.kind));
        if place >= k {
            sum = sum.wrapping_sub(leaving.wrapping_mul(value(tokens[place - k].kind)));
        }
        if place + 1 >= k {
            hashes.push(mixed(sum));
        }
    }
    hashes
}

/// The places of the fingerprints among hashes. A hash that is `None` is never one.
pub(super) fn fingerprints(hashes: &[Option<u64>], window: usize) -> Vec<usize> {
    let mut chosen = Vec::new();
    // Places in a window whose hashes increase, so that the first one is the smallest.
    let mut smallest: std::collections::VecDeque<(usize, u64)> = std::collections::VecDeque::new();
    let window = window.clamp(1, hashes.len().max(1));
    for (place, hash) in hashes.iter().enumerate() {
        if let Some(hash) = *hash {
            while smallest.back().is_some_and(|(_, last)| *last >= hash) {
                smallest.pop_back();
            }
            smallest.push_back((place, hash));
        }
        while smallest.front().is_some_and(|(first, _)| first + window <= place) {
            smallest.pop_front();
        }
        if place + 1 >= window
            && let Some((first, _)) = smallest.front()
            && chosen.last() != Some(first)
        {
            chosen.push(*first);
        }
    }
    chosen
}

/// Spreads small numbers over all bits.
fn value(kind: u32) -> u64 {
    mixed(u64::from(kind) + 1)
}

/// SplitMix64's finaliser: sums that differ in high bits alone differ in all.
fn mixed(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(kinds: &[u32]) -> Vec<Token> {
        kinds.iter().map(|kind| Token { kind: *kind, line: 1 }).collect()
    }

    #[test]
    fn k_gram_hashes_do_not_depend_on_position() {
        let hashes = k_grams(&tokens(&[9, 1, 2, 3, 7, 7, 1, 2, 3, 8]), 3);
        assert_eq!(hashes.len(), 8);
        assert_eq!(hashes[1], hashes[6]);
        let others: std::collections::BTreeSet<u64> = hashes.iter().copied().collect();
        assert_eq!(others.len(), 7);
        assert!(k_grams(&tokens(&[1, 2]), 3).is_empty());
    }

    /// The example of the paper's figure 2, with windows of 4.
    #[test]
    fn the_papers_example_has_its_fingerprints() {
        let hashes = [77, 74, 42, 17, 98, 50, 17, 98, 8, 88, 67, 39, 77, 74, 42, 17, 98];
        let chosen = fingerprints(&hashes.map(Some), 4);
        assert_eq!(
            chosen.iter().map(|place| hashes[*place]).collect::<Vec<_>>(),
            [17, 17, 8, 39, 17]
        );
    }

    #[test]
    fn every_shared_run_of_window_and_k_has_a_common_fingerprint() {
        let (k, window) = (5, 7);
        let mut random = fastrand::Rng::with_seed(3);
        for _ in 0..500 {
            let mut draw = |count| (0..count).map(|_| random.u32(0..40)).collect::<Vec<u32>>();
            let shared = draw(k + window - 1);
            let text = |parts: [Vec<u32>; 3]| {
                let hashes = k_grams(&tokens(&parts.concat()), k);
                let hashes: Vec<Option<u64>> = hashes.into_iter().map(Some).collect();
                let chosen = fingerprints(&hashes, window);
                chosen.into_iter().map(|place| hashes[place]).collect::<Vec<_>>()
            };
            let one = text([draw(31), shared.clone(), draw(12)]);
            let other = text([draw(8), shared, draw(40)]);
            assert!(one.iter().any(|hash| other.contains(hash)));
        }
    }
}
