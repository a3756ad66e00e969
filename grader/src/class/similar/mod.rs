//! Shared parts of the sources of hand-ins, for people to judge.
//!
//! ```text
//! sources -> tokens -> k-grams ──> less those of starter code, and those that much of the class has
//!            tokens.rs              └─> fingerprints -> index -> pairs -> shared runs, token by token
//!                                       winnow.rs                         pair.rs
//! ```
//!
//! Renaming, retyping, comments, layout and the order of functions change nothing. A run is found if it has at least
//! [`Config::found_from`] tokens, and is never reported on the hash alone: its tokens are compared. Reading, hashing and
//! the index are linear in the tokens of the class. A fingerprint of more than [`Config::common`] hand-ins is left out of
//! the index, so that each adds at most that many pairs for each of its owners. Hand-ins with the same tokens count as one
//! there: the first is compared with the class, and with each of the others.

mod pair;
mod tokens;
mod winnow;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use rayon::prelude::*;

use crate::boundary::door::Door;
use crate::boundary::printed;
use crate::submission::hand_in::{HandIn, HandInError, WalkStep};
use tokens::{Language, Token};

/// Thresholds of sharing. The defaults of `k` and `window` are those of Dolos (Maertens et al., 2022).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Tokens of a k-gram: shorter runs never count. With 12, a loop over coordinates is enough to match; with 23, two
    /// programs by different authors in this repository share 0 to 3 %.
    pub k: usize,
    /// Hashes of a window: of so many k-grams in a row, at least one is in the index. A larger one makes the index
    /// smaller, and finds only longer runs.
    pub window: usize,
    /// Part of the class that may have a k-gram before it counts as common: a quarter still finds a group of a quarter of
    /// the class.
    pub common_part: f64,
    /// Number of hand-ins that may have a k-gram in any case: in a small class, a group would else be its own excuse.
    pub common_least: usize,
    /// Pairs are listed from this part on, of either hand-in.
    pub listed_from: f64,
    /// Hand-ins with fewer own tokens are not compared: at this length, little can be written in two ways.
    pub least_tokens: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            k: 23,
            window: 17,
            common_part: 0.25,
            common_least: 5,
            listed_from: 0.2,
            least_tokens: 100,
        }
    }
}

impl Config {
    /// Shared runs of so many tokens are always found.
    pub fn found_from(&self) -> usize {
        self.k + self.window - 1
    }

    /// The most hand-ins that may have a k-gram that is not common.
    pub fn common(&self, hand_ins: usize) -> usize {
        ((self.common_part * hand_ins as f64) as usize).max(self.common_least)
    }
}

/// Maximum size of a source file that is read, in bytes: longer ones are data.
const MAX_FILE: u64 = Door::Source.facts().limit.bytes();

/// Maximum size of all sources of a hand-in that are read, in bytes.
const MAX_SOURCES: u64 = 4 << 20;

/// Extensions of files that hold scenes, traces and text, and no code.
const DATA: [&str; 6] = ["xml", "json", "csv", "obj", "bin", "md"];

/// The tokens of a hand-in.
pub struct Sources {
    name: String,
    /// Paths of its files, for display.
    files: Vec<String>,
    /// The first token of each file, and the end of the last one.
    starts: Vec<usize>,
    tokens: Vec<Token>,
    /// Source files that were not read: too large, or beyond the limit of all.
    unread: usize,
}

/// Shared parts of a class.
#[derive(Debug, Clone, PartialEq)]
pub struct Similarity {
    /// The settings.
    pub config: Config,
    /// The most hand-ins that have a k-gram that is not common.
    pub common: usize,
    /// The hand-ins: those that were compared by name, then the others.
    pub hand_ins: Vec<HandInTokens>,
    /// Names of hand-ins with the same tokens, so many that are not of starter code that they could be compared.
    pub equal: Vec<Vec<String>>,
    /// The pairs that are listed: those that share most come first.
    pub pairs: Vec<Pair>,
    /// Hand-ins that were not compared, with the reason.
    pub not_compared: Vec<(String, String)>,
}

/// The numbers of tokens of a hand-in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HandInTokens {
    /// Its name.
    pub name: String,
    /// All.
    pub tokens: usize,
    /// Those of starter code.
    pub starter: usize,
    /// Those that much of the class has.
    pub common: usize,
    /// Source files that were not read.
    pub unread: usize,
}

impl HandInTokens {
    /// Tokens outside of shared code.
    pub fn own(&self) -> usize {
        self.tokens - self.starter - self.common
    }
}

/// Two hand-ins that share code.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Their places in [`Similarity::hand_ins`].
    pub hand_ins: [usize; 2],
    /// The number of each one's own tokens that the other has too.
    pub shared: [usize; 2],
    /// The shared runs, longest first.
    pub runs: Vec<Run>,
}

/// Tokens in a row that two hand-ins share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Run {
    /// Their number.
    pub tokens: usize,
    /// Where they stand in each hand-in.
    pub places: [Place; 2],
}

/// Lines of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file's path in the hand-in, for display.
    pub file: String,
    /// The first line, from 1.
    pub first: u32,
    /// The last line.
    pub last: u32,
}

impl Similarity {
    /// The part of a hand-in's own tokens that a pair shares.
    pub fn part(&self, pair: &Pair, side: usize) -> f64 {
        pair.shared[side] as f64 / self.hand_ins[pair.hand_ins[side]].own().max(1) as f64
    }
}

impl Sources {
    /// Whether nothing was read.
    pub fn is_empty(&self) -> bool {
        self.tokens.is_empty()
    }

    /// Reads the sources of a hand-in: of regular files with an extension of a known language, and of files whose name stands in
    /// one of those, as in `#include "code.txt"`.
    ///
    /// # Errors
    /// If the hand-in cannot be read, or exceeds a limit.
    pub fn read(name: &str, path: &Path) -> Result<Self, HandInError> {
        let mut sources = Self::new(name);
        let mut left = MAX_SOURCES;
        // The last parts of paths in strings, each with the language that it stands in.
        let mut named: HashMap<String, &'static Language> = HashMap::new();
        sources.walk((path, &mut left), &tokens::language, &mut |text, language| {
            for string in text.split(['"', '\'']).filter(|string| string.len() < 256) {
                let file = string.rsplit(['/', '\\']).next().unwrap_or(string);
                named.entry(file.to_owned()).or_insert(language);
            }
        })?;
        let is_code = |file: &str| !file.rsplit('.').next().is_some_and(|it| DATA.contains(&it));
        let others = |file: &str| {
            named.get(file).copied().filter(|_| tokens::language(file).is_none() && is_code(file))
        };
        sources.walk((path, &mut left), &others, &mut |_, _| {})?;
        Ok(sources)
    }

    /// Adds the files for which there is a language; `left` bytes may be read.
    fn walk(
        &mut self,
        (path, left): (&Path, &mut u64),
        language_of: &dyn Fn(&str) -> Option<&'static Language>,
        seen: &mut dyn FnMut(&str, &'static Language),
    ) -> Result<(), HandInError> {
        HandIn::open(path)?.walk(&mut |step| {
            let WalkStep::File(node) = step else { return Ok(()) };
            let file = node.name.to_string_lossy();
            // The Mac's copies of a file's attributes.
            let language = language_of(&file).filter(|_| !file.starts_with("._"));
            let Some(language) = language else { return Ok(()) };
            if node.size() > MAX_FILE.min(*left) {
                self.unread += 1;
                return Ok(());
            }
            *left -= node.size();
            let text = node.read()?;
            let text = String::from_utf8_lossy(&text);
            let shown = if node.path.is_empty() {
                printed::path(file.as_bytes())
            } else {
                printed::path(node.path.as_encoded_bytes())
            };
            seen(&text, language);
            self.add(shown, &text, language);
            Ok(())
        })
    }

    /// Sources in memory: the path and text of each file. Files of unknown languages do not count.
    pub fn of<'a>(name: &str, files: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let mut sources = Self::new(name);
        for (path, text) in files {
            if let Some(language) = tokens::language(path) {
                sources.add(path.to_owned(), text, language);
            }
        }
        sources
    }

    fn new(name: &str) -> Self {
        let name = name.to_owned();
        Self { name, files: Vec::new(), starts: vec![0], tokens: Vec::new(), unread: 0 }
    }

    fn add(&mut self, path: String, text: &str, language: &Language) {
        self.tokens.extend(tokens::tokens(text, language));
        self.files.push(path);
        self.starts.push(self.tokens.len());
    }

    /// The kinds of its tokens, file by file, whatever the names of the files.
    fn kinds(&self) -> Vec<Vec<u32>> {
        let of_file = |ends: &[usize]| {
            self.tokens[ends[0]..ends[1]].iter().map(|token| token.kind).collect::<Vec<_>>()
        };
        let mut files: Vec<_> = self.starts.windows(2).map(of_file).collect();
        files.sort_unstable();
        files
    }

    /// Its k-grams: the place of the first token, and the hash. None spans two files.
    fn k_grams(&self, k: usize) -> impl Iterator<Item = (usize, u64)> {
        self.starts.windows(2).flat_map(move |ends| {
            let hashes = winnow::k_grams(&self.tokens[ends[0]..ends[1]], k);
            hashes.into_iter().enumerate().map(move |(place, hash)| (ends[0] + place, hash))
        })
    }
}

/// A hand-in that is compared.
struct Compared {
    sources: Sources,
    /// The first hand-in with the same tokens, by its place in the class.
    equals: usize,
    /// Whether each token is its own: neither of starter code nor common.
    own: Vec<bool>,
    counts: HandInTokens,
    /// Its fingerprints, with the places of each.
    fingerprints: BTreeMap<u64, Vec<usize>>,
}

/// Compares the hand-ins of a class with each other.
pub fn compare(mut class: Vec<Sources>, starter: &[Sources], config: Config) -> Similarity {
    class.sort_by(|a, b| a.name.cmp(&b.name));
    let k = config.k;
    let of_starter: HashSet<u64> =
        starter.iter().flat_map(|sources| sources.k_grams(k)).map(|(_, hash)| hash).collect();
    // The first hand-in with the same tokens as each.
    let mut first_with: HashMap<Vec<Vec<u32>>, usize> = HashMap::new();
    let equals: Vec<usize> = class
        .iter()
        .enumerate()
        .map(|(place, sources)| *first_with.entry(sources.kinds()).or_insert(place))
        .collect();
    // The number of different hand-ins with each k-gram.
    let mut owners: HashMap<u64, usize> = HashMap::new();
    let different = || class.iter().enumerate().filter(|(place, _)| equals[*place] == *place);
    for (_, sources) in different() {
        let distinct: HashSet<u64> = sources.k_grams(k).map(|(_, hash)| hash).collect();
        for hash in distinct {
            *owners.entry(hash).or_default() += 1;
        }
    }
    let most = config.common(different().count());
    let is_common = |hash: &u64| owners.get(hash).is_some_and(|owners| *owners > most);
    let compared = class.into_par_iter().zip(equals);
    let compared: Vec<Compared> = compared
        .map(|(sources, equals)| {
            let is_starter = |hash: &u64| of_starter.contains(hash);
            Compared::new((sources, equals), config, is_starter, is_common)
        })
        .collect();
    let mut equal: BTreeMap<usize, Vec<String>> = BTreeMap::new();
    for Compared { equals, counts, .. } in &compared {
        if counts.tokens - counts.starter >= config.least_tokens {
            equal.entry(*equals).or_default().push(counts.name.clone());
        }
    }
    let equal = equal.into_values().filter(|names| names.len() > 1).collect();
    let (compared, too_short): (Vec<_>, Vec<_>) =
        compared.into_iter().partition(|hand_in| hand_in.counts.own() >= config.least_tokens);
    let not_compared = too_short.iter().map(|Compared { counts, .. }| {
        let reason = match counts {
            HandInTokens { tokens: 0, unread: 0, .. } => {
                "it has no sources in a known language".to_owned()
            }
            HandInTokens { tokens, starter, common, .. } => format!(
                "{} tokens of its own; of {tokens}, {starter} are starter code and {common} are common",
                counts.own()
            ),
        };
        (counts.name.clone(), reason)
    });
    let not_compared = not_compared.collect();
    let pairs = candidates(&compared, config);
    let mut pairs: Vec<Pair> =
        pairs.into_par_iter().map(|pair| pair::pair(&compared, pair, config)).collect();
    let hand_ins = compared.into_iter().chain(too_short).map(|hand_in| hand_in.counts).collect();
    let mut similarity =
        Similarity { config, common: most, hand_ins, equal, pairs: Vec::new(), not_compared };
    let larger = |pair: &Pair| similarity.part(pair, 0).max(similarity.part(pair, 1));
    pairs.retain(|pair| larger(pair) >= config.listed_from);
    pairs.sort_by(|a, b| {
        larger(b)
            .total_cmp(&larger(a))
            .then(b.shared.cmp(&a.shared))
            .then(a.hand_ins.cmp(&b.hand_ins))
    });
    similarity.pairs = pairs;
    similarity
}

impl Compared {
    fn new(
        (sources, equals): (Sources, usize),
        config: Config,
        is_starter: impl Fn(&u64) -> bool,
        is_common: impl Fn(&u64) -> bool,
    ) -> Self {
        let total = sources.tokens.len();
        let (mut starter, mut common) = (vec![false; total], vec![false; total]);
        for (place, hash) in sources.k_grams(config.k) {
            if is_starter(&hash) {
                starter[place..place + config.k].fill(true);
            } else if is_common(&hash) {
                common[place..place + config.k].fill(true);
            }
        }
        let mut fingerprints: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        let own: Vec<bool> = starter.iter().zip(&common).map(|(a, b)| !a && !b).collect();
        for ends in sources.starts.windows(2) {
            let hashes = winnow::k_grams(&sources.tokens[ends[0]..ends[1]], config.k);
            let of_own = hashes.iter().enumerate().map(|(place, hash)| {
                let place = ends[0] + place;
                own[place..place + config.k].iter().all(|own| *own).then_some(*hash)
            });
            for place in winnow::fingerprints(&of_own.collect::<Vec<_>>(), config.window) {
                fingerprints.entry(hashes[place]).or_default().push(ends[0] + place);
            }
        }
        let count = |of: &mut dyn Iterator<Item = bool>| of.filter(|is| *is).count();
        let counts = HandInTokens {
            name: sources.name.clone(),
            tokens: total,
            starter: count(&mut starter.iter().copied()),
            common: count(&mut starter.iter().zip(&common).map(|(a, b)| !a && *b)),
            unread: sources.unread,
        };
        Self { sources, equals, own, counts, fingerprints }
    }
}

/// The pairs of which a fingerprint is in both, in order, if their shared fingerprints could make up half of the part from
/// which pairs are listed. Of hand-ins with the same tokens, the first is in pairs with all others, the rest with the first.
fn candidates(compared: &[Compared], config: Config) -> Vec<[usize; 2]> {
    let mut index: HashMap<u64, Vec<usize>> = HashMap::new();
    let mut firsts: HashMap<usize, usize> = HashMap::new();
    let mut pairs: Vec<[usize; 2]> = Vec::new();
    for (number, hand_in) in compared.iter().enumerate() {
        let first = *firsts.entry(hand_in.equals).or_insert(number);
        if first != number {
            pairs.push([first, number]);
            continue;
        }
        for hash in hand_in.fingerprints.keys() {
            index.entry(*hash).or_default().push(number);
        }
    }
    let mut shared: HashMap<[usize; 2], usize> = HashMap::new();
    for owners in index.values() {
        for (place, first) in owners.iter().enumerate() {
            for second in &owners[place + 1..] {
                *shared.entry([*first, *second]).or_default() += 1;
            }
        }
    }
    let is_enough = |(pair, shared): &([usize; 2], usize)| {
        let fewest = pair.map(|number| compared[number].fingerprints.len()).into_iter().min();
        *shared as f64 >= 0.5 * config.listed_from * fewest.unwrap_or(0) as f64
    };
    pairs.extend(shared.into_iter().filter(is_enough).map(|(pair, _)| pair));
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests;
