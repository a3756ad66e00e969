//! The runs of tokens that two hand-ins share: shared fingerprints, extended token by token.
//!
//! A run ends at the end of a file, and at a token that is starter code or common.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use super::{Compared, Config, Pair, Place, Run};

/// The most places of a fingerprint in a hand-in that are tried: a table of numbers repeats one at every line.
const MAX_PLACES: usize = 16;

/// Two equal stretches of tokens: their beginnings and their length.
struct Stretch {
    begins: [usize; 2],
    length: usize,
}

/// Shared parts of a pair of hand-ins.
pub(super) fn pair(compared: &[Compared], hand_ins: [usize; 2], config: Config) -> Pair {
    let both = hand_ins.map(|number| &compared[number]);
    let mut stretches = stretches(both, config);
    let shared = [0, 1].map(|side| {
        let mut is_shared = vec![false; both[side].own.len()];
        for Stretch { begins, length } in &stretches {
            is_shared[begins[side]..begins[side] + length].fill(true);
        }
        is_shared.into_iter().filter(|is| *is).count()
    });
    stretches.sort_by_key(|stretch| (Reverse(stretch.length), stretch.begins));
    // A run that longer runs cover up to less than a k-gram adds nothing.
    let mut covered = both.map(|hand_in| vec![false; hand_in.own.len()]);
    let mut runs = Vec::new();
    for Stretch { begins, length } in stretches {
        let ranges = begins.map(|begin| begin..begin + length);
        let is_new = |side: usize| {
            let covered = &covered[side][ranges[side].clone()];
            covered.iter().filter(|covered| !**covered).count() >= config.k
        };
        if !(is_new(0) && is_new(1)) {
            continue;
        }
        for side in [0, 1] {
            covered[side][ranges[side].clone()].fill(true);
        }
        let places = [0, 1].map(|side| both[side].place(begins[side], length));
        runs.push(Run { tokens: length, places });
    }
    Pair { hand_ins, shared, runs }
}

/// The longest stretch around each pair of equal fingerprints, once each.
fn stretches(both: [&Compared; 2], config: Config) -> Vec<Stretch> {
    let mut anchors: Vec<[usize; 2]> = Vec::new();
    for (hash, places) in &both[0].fingerprints {
        let others = both[1].fingerprints.get(hash).map_or(&[][..], |others| others);
        for place in places.iter().take(MAX_PLACES) {
            anchors.extend(others.iter().take(MAX_PLACES).map(|other| [*place, *other]));
        }
    }
    anchors.sort_unstable();
    // The end of the last stretch, in the first hand-in, by the distance of the two places.
    let mut ends: BTreeMap<isize, usize> = BTreeMap::new();
    let mut found = Vec::new();
    for anchor in anchors {
        let distance = anchor[1] as isize - anchor[0] as isize;
        if ends.get(&distance).is_some_and(|end| *end > anchor[0]) {
            continue;
        }
        let stretch = extended(both, anchor);
        // Else two k-grams have the same hash by chance.
        if stretch.length >= config.k {
            ends.insert(distance, stretch.begins[0] + stretch.length);
            found.push(stretch);
        }
    }
    found
}

/// The longest stretch that contains a pair of places.
fn extended(both: [&Compared; 2], anchor: [usize; 2]) -> Stretch {
    let limits = [0, 1].map(|side| both[side].file(anchor[side]).1);
    let is_equal = |places: [usize; 2]| {
        let kinds = [0, 1].map(|side| both[side].sources.tokens[places[side]].kind);
        kinds[0] == kinds[1] && [0, 1].into_iter().all(|side| both[side].own[places[side]])
    };
    let room = |side: usize| limits[side].1 - anchor[side];
    let after = (0..room(0).min(room(1)))
        .take_while(|step| is_equal(anchor.map(|place| place + step)))
        .count();
    let room = |side: usize| anchor[side] - limits[side].0;
    let before = (1..=room(0).min(room(1)))
        .take_while(|step| is_equal(anchor.map(|place| place - step)))
        .count();
    Stretch { begins: anchor.map(|place| place - before), length: before + after }
}

impl Compared {
    /// The number of the file of a token, and the range of its tokens.
    fn file(&self, token: usize) -> (usize, (usize, usize)) {
        let starts = &self.sources.starts;
        let file = starts.partition_point(|start| *start <= token) - 1;
        (file, (starts[file], starts[file + 1]))
    }

    fn place(&self, begin: usize, length: usize) -> Place {
        let line = |token: usize| self.sources.tokens[token].line;
        let file = self.sources.files[self.file(begin).0].clone();
        Place { file, first: line(begin), last: line(begin + length - 1) }
    }
}
