//! Selection of scenes by patterns, for `--only`.
//!
//! A pattern has the first of these meanings that applies:
//!
//! | pattern | chooses |
//! | --- | --- |
//! | a scene's name, `Spring/two-springs` | that scene |
//! | a group, `Spring` or `Spring/` | the scenes of exactly that group |
//! | an integrator, by any of its names | the scenes of that integrator |
//! | with `*` or `?` | the scenes whose whole name matches; `*` is any text, `?` any character |
//! | with `/` | the scenes whose name starts with it |
//! | any other text | the scenes whose name contains it |

use scene::spelling::{SIMILAR, similarity};

use crate::suite::{Case, Suite};

/// Maximum number of suggestions for a pattern without a match.
const SUGGESTIONS: usize = 3;

/// A scene that patterns can choose.
#[derive(Debug, Clone, Copy)]
pub struct Candidate<'a> {
    /// The scene's name, `group/scene`.
    pub name: &'a str,
    /// The scene's group; `None` where there are no groups.
    pub group: Option<&'a str>,
    /// The primary name of its integrator; `None` where the entry names none.
    pub integrator: Option<&'a str>,
}

impl<'a> From<&'a Case> for Candidate<'a> {
    fn from(case: &'a Case) -> Self {
        let group = Some(case.feature.group.as_str());
        Self { name: &case.id, group, integrator: Some(case.feature.integrator) }
    }
}

/// A pattern that chooses nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("nothing matches {pattern:?}{}", did_you_mean(near))]
pub struct NoMatch {
    /// The pattern.
    pub pattern: String,
    /// Similar names, the most similar first.
    pub near: Vec<String>,
}

fn did_you_mean(near: &[String]) -> String {
    match near {
        [] => String::new(),
        [one] => format!("\n  help: did you mean {one}?"),
        [first @ .., last] => format!("\n  help: did you mean {} or {last}?", first.join(", ")),
    }
}

/// For each candidate, whether a pattern chooses it. Without patterns, all are chosen.
///
/// # Errors
/// If a pattern chooses none.
pub fn choose(patterns: &[String], candidates: &[Candidate<'_>]) -> Result<Vec<bool>, NoMatch> {
    let mut chosen = vec![patterns.is_empty(); candidates.len()];
    for pattern in patterns {
        let matches = matching(pattern, candidates);
        if !matches.contains(&true) {
            return Err(NoMatch { pattern: pattern.clone(), near: near(pattern, candidates) });
        }
        chosen.iter_mut().zip(matches).for_each(|(chosen, matches)| *chosen |= matches);
    }
    Ok(chosen)
}

impl Suite {
    /// Keeps the scenes that the patterns choose; all, if there are no patterns.
    ///
    /// # Errors
    /// If a pattern chooses none.
    pub fn keep_only(&mut self, patterns: &[String]) -> Result<(), NoMatch> {
        let candidates: Vec<Candidate<'_>> = self.cases.iter().map(Candidate::from).collect();
        let mut chosen = choose(patterns, &candidates)?.into_iter();
        self.cases.retain(|_| chosen.next() == Some(true));
        Ok(())
    }
}

fn matching(pattern: &str, candidates: &[Candidate<'_>]) -> Vec<bool> {
    let those = |fits: &dyn Fn(&Candidate<'_>) -> bool| candidates.iter().map(fits).collect();
    let group = pattern.strip_suffix('/').unwrap_or(pattern);
    let integrator = simulator::vocabulary().integrator(pattern).map(|schema| schema.name);
    let exact: [&dyn Fn(&Candidate<'_>) -> bool; 3] = [
        &|candidate| candidate.name == pattern,
        &|candidate| candidate.group == Some(group),
        &|candidate| integrator.is_some() && candidate.integrator == integrator,
    ];
    if let Some(fits) = exact.into_iter().find(|fits| candidates.iter().any(fits)) {
        return those(fits);
    }
    match pattern {
        _ if pattern.contains(['*', '?']) => those(&|candidate| is_like(candidate.name, pattern)),
        _ if pattern.contains('/') => those(&|candidate| candidate.name.starts_with(pattern)),
        _ => those(&|candidate| candidate.name.contains(pattern)),
    }
}

/// Whether all of `name` matches `pattern`. Cost: at most the product of their lengths.
pub(crate) fn is_like(name: &str, pattern: &str) -> bool {
    // Entry k: whether the name so far matches the first k characters of the pattern.
    let pattern: Vec<char> = pattern.chars().collect();
    let mut states = vec![false; pattern.len() + 1];
    states[0] = true;
    let skip_stars = |states: &mut [bool]| {
        for (place, character) in pattern.iter().enumerate() {
            states[place + 1] |= states[place] && *character == '*';
        }
    };
    skip_stars(&mut states);
    for character in name.chars() {
        let mut next = vec![false; pattern.len() + 1];
        for (place, wanted) in pattern.iter().enumerate().filter(|(place, _)| states[*place]) {
            match wanted {
                '*' => next[place] = true,
                wanted => next[place + 1] |= *wanted == '?' || *wanted == character,
            }
        }
        skip_stars(&mut next);
        states = next;
    }
    states[pattern.len()]
}

/// Names, groups and integrators similar to `pattern`, the most similar first.
fn near(pattern: &str, candidates: &[Candidate<'_>]) -> Vec<String> {
    let pattern = pattern.trim_end_matches('/');

    let mut near: Vec<(f64, &str)> = Vec::new();
    for Candidate { name, group, integrator } in candidates {
        let words = [Some(*name), *group, *integrator].into_iter().flatten();
        let words = words.map(|word| (similarity(pattern, word), word));
        near.extend(
            words.chain([(similarity(pattern, name.rsplit('/').next().unwrap_or(name)), *name)]),
        );
    }
    if near.iter().any(|(similarity, _)| *similarity >= SIMILAR) {
        near.retain(|(similarity, _)| *similarity >= SIMILAR);
    } else {
        // The scenes of the group that it names.
        let group = pattern.rsplit_once('/').map(|(group, _)| group);
        near.retain(|(_, name)| group.is_some() && name.rsplit_once('/').map(|(g, _)| g) == group);
    }
    // Stable: of equally similar names, the first.
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut names: Vec<String> = Vec::new();
    for (_, name) in near {
        if names.len() < SUGGESTIONS && !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [(&str, &str); 6] = [
        ("FastMassSpring/net", "fast-mass-spring"),
        ("GreenSpring/two-springs", "implicit-euler"),
        ("Spring/chain-of-ten", "explicit-euler"),
        ("Spring/two-springs", "explicit-euler"),
        ("Spring/two-springs-damped", "implicit-euler"),
        ("SpringDamping/chain", "linearized-implicit-euler"),
    ];

    fn chosen(patterns: &[&str]) -> Result<Vec<&'static str>, NoMatch> {
        let candidate = |(name, integrator): &(&'static str, &'static str)| Candidate {
            name,
            group: name.split('/').next(),
            integrator: Some(integrator),
        };
        let candidates: Vec<Candidate<'_>> = NAMES.iter().map(candidate).collect();
        let patterns: Vec<String> = patterns.iter().map(|&pattern| pattern.to_owned()).collect();
        let chosen = choose(&patterns, &candidates)?;
        Ok(NAMES.iter().zip(chosen).filter_map(|((name, _), is)| is.then_some(*name)).collect())
    }

    #[test]
    fn first_matching_meaning_of_a_pattern_applies() {
        let [net, green, ten, two, damped, chain] = NAMES.map(|(name, _)| name);
        for (pattern, names) in [
            ("Spring/two-springs", &[two][..]),
            ("Spring/", &[ten, two, damped]),
            ("Spring", &[ten, two, damped]),
            ("explicit-euler", &[ten, two]),
            ("implicit", &[green, damped]),
            ("*Spring/*", &[net, green, ten, two, damped]),
            ("Spring/*", &[ten, two, damped]),
            ("*two-springs", &[green, two]),
            ("Spring/two?springs", &[two]),
            ("Spring/two", &[two, damped]),
            ("two-springs", &[green, two, damped]),
            ("chain", &[ten, chain]),
            ("*", &NAMES.map(|(name, _)| name)),
        ] {
            assert_eq!(chosen(&[pattern]).as_deref(), Ok(names), "{pattern}");
        }
        assert_eq!(chosen(&["net", "Spring/chain-of-ten"]), Ok(vec![net, ten]));
        assert_eq!(chosen(&[]).unwrap().len(), NAMES.len());
    }

    #[test]
    fn a_pattern_without_a_match_gets_suggestions() {
        let message = |patterns: &[&str]| chosen(patterns).unwrap_err().to_string();
        assert_eq!(
            message(&["net", "two-sprigns"]),
            "nothing matches \"two-sprigns\"\n  help: did you mean GreenSpring/two-springs or \
             Spring/two-springs?"
        );
        assert_eq!(
            message(&["springdamping/"]),
            "nothing matches \"springdamping/\"\n  help: did you mean SpringDamping or SpringDamping/chain?"
        );
        assert_eq!(message(&["qqqq"]), "nothing matches \"qqqq\"");
        assert_eq!(
            message(&["Spring/qqqq"]),
            "nothing matches \"Spring/qqqq\"\n  help: did you mean Spring/two-springs, Spring/chain-of-ten or \
             Spring/two-springs-damped?"
        );
    }

    #[test]
    fn many_stars_are_matched_in_polynomial_time() {
        let name = "a".repeat(200);
        assert!(!is_like(&name, &("*a".repeat(100) + "b")));
        assert!(is_like(&name, &"*a".repeat(100)));
        assert!(is_like("", "*") && is_like("", "") && !is_like("", "?"));
    }
}
