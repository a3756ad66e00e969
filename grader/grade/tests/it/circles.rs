//! No circle of imports in any crate, at the level of files.
//!
//! Files and folders of one folder import each other in one direction. A folder counts as all of its
//! files, so that this holds at every level. A `mod.rs` or `lib.rs` holds what its files share, and lists them: it and the
//! files below it may name each other. Its re-exports count as imports of the file that has them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::docs::crates;
use crate::folder::sources_below;

/// Path of a module from the root of its crate, which is empty.
type ModulePath = Vec<String>;

/// The sources of a crate without tests and comments.
type Sources = BTreeMap<ModulePath, String>;

/// The `use` items of each module.
type Imports = BTreeMap<ModulePath, Vec<Import>>;

fn sources(root: &Path) -> Sources {
    let mut sources = Sources::new();
    let mut tests = BTreeSet::new();
    for (path, text) in sources_below(root) {
        let inside = path.strip_prefix(root).unwrap().with_extension("");
        let mut module: ModulePath = inside.iter().map(|name| name.display().to_string()).collect();
        let is_folder = |name: &String| ["mod", "lib", "main"].contains(&name.as_str());
        module.pop_if(|name| is_folder(name));
        if text.contains("#[cfg(test)]\nmod tests;") {
            tests.insert([module.as_slice(), &["tests".to_owned()]].concat());
        }
        sources.insert(module, code(&text));
    }
    sources.retain(|module, _| !tests.contains(module));
    sources
}

/// The text without comments, and without the unit tests at its end.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    text.lines().map(|line| line.split("//").next().unwrap()).collect::<Vec<_>>().join("\n")
}

/// A path in a module, and its name there: `super::pair::PairLaw` as `PairLaw`.
struct Import {
    name: String,
    path: Vec<String>,
}

/// Adds the paths of a tree such as `super::{pair::{Pair, PairLaw as Law}, wind}`.
fn add_imports(tree: &str, before: &[String], imports: &mut Vec<Import>) {
    let tree = tree.trim();
    let (head, inner) = match tree.split_once('{') {
        Some((head, inner)) => (head, inner.rsplit_once('}').map(|(inner, _)| inner)),
        None => (tree, None),
    };
    let (head, alias) = head.split_once(" as ").map_or((head, None), |(a, b)| (a, Some(b)));
    let segments = head.split("::").map(str::trim).filter(|name| !name.is_empty());
    let mut path = [before, &segments.map(str::to_owned).collect::<Vec<_>>()].concat();
    if let Some(inner) = inner {
        let (mut depth, mut start) = (0, 0);
        for (at, character) in inner.char_indices().chain([(inner.len(), ',')]) {
            match character {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    add_imports(&inner[start..at], &path, imports);
                    start = at + 1;
                }
                _ => {}
            }
        }
    } else if let Some(last) = path.last().cloned() {
        if last == "self" && path.len() > 1 {
            path.pop();
        }
        let name = alias.map_or(path.last().unwrap().clone(), |alias| alias.trim().to_owned());
        imports.push(Import { name, path });
    }
}

/// The `use` items of a file.
fn imports_of(code: &str) -> Vec<Import> {
    let mut imports = Vec::new();
    for (at, _) in code.match_indices("use ") {
        let line = code[..at].rsplit('\n').next().unwrap().trim();
        if line.is_empty() || line.starts_with("pub") {
            let tree = code[at + 4..].split(';').next().unwrap();
            add_imports(tree, &[], &mut imports);
        }
    }
    imports
}

/// The paths of a file's code that begin with `crate`, `super` or `self`.
fn inline_paths(code: &str) -> Vec<Vec<String>> {
    let is_part = |character: char| character.is_alphanumeric() || character == '_';
    let mut paths = Vec::new();
    for start in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(start) {
            if !code[..at].ends_with(|before: char| is_part(before) || before == ':') {
                let end = code[at..].find(|character| !is_part(character) && character != ':');
                let path = &code[at..end.map_or(code.len(), |end| at + end)];
                let segments = path.split("::").filter(|name| !name.is_empty());
                paths.push(segments.map(str::to_owned).collect());
            }
        }
    }
    paths
}

/// The module whose file has what `path` names in `module`; `None` for a path that leads out of the crate.
fn resolve(
    modules: &Imports,
    module: &[String],
    path: &[String],
    depth: usize,
) -> Option<ModulePath> {
    let mut at = module.to_vec();
    let mut rest = path.iter().peekable();
    match path.first()?.as_str() {
        "crate" => at.clear(),
        "self" | "super" => {}
        name => {
            let child = [module, &[name.to_owned()]].concat();
            modules.get(&child)?;
        }
    }
    rest.next_if(|name| ["crate", "self"].contains(&name.as_str()));
    while rest.next_if(|name| *name == "super").is_some() {
        at.pop()?;
    }
    for name in rest {
        at.push(name.clone());
        if !modules.contains_key(&at) {
            at.pop();
            let mut imports = modules.get(&at)?.iter();
            let import = imports.find(|import| import.name == *name && at != module);
            let import = import.filter(|_| depth < 8);
            return match import {
                Some(import) => resolve(modules, &at, &import.path, depth + 1),
                None => Some(at),
            };
        }
    }
    Some(at)
}

/// The circles of imports: for each folder that has some, the files and folders in them, and which imports which.
fn circles(sources: &Sources) -> Vec<String> {
    let modules: Imports =
        sources.iter().map(|(module, code)| (module.clone(), imports_of(code))).collect();
    let mut folders: BTreeMap<ModulePath, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (module, code) in sources {
        let used =
            modules[module].iter().map(|import| import.path.clone()).chain(inline_paths(code));
        for target in used.filter_map(|path| resolve(&modules, module, &path, 0)) {
            let common = module.iter().zip(&target).take_while(|(a, b)| a == b).count();
            // One is in the folder of the other, or they are one.
            let (Some(from), Some(to)) = (module.get(common), target.get(common)) else { continue };
            let folder = folders.entry(module[..common].to_vec()).or_default();
            folder.entry(from.clone()).or_default().insert(to.clone());
        }
    }
    let mut circles = Vec::new();
    for (folder, mut left) in folders {
        // A name that imports none of the others, or that none of them imports, is in no circle.
        loop {
            let names: BTreeSet<String> = left.keys().cloned().collect();
            let imported: BTreeSet<String> = left.values().flatten().cloned().collect();
            left.retain(|name, used| {
                used.retain(|used| names.contains(used));
                !used.is_empty() && imported.contains(name)
            });
            if left.len() == names.len() {
                break;
            }
        }
        for (from, to) in left {
            circles.push(format!("in crate::{}: {from} imports {to:?}", folder.join("::")));
        }
    }
    circles
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let found: Vec<String> = crates()
        .iter()
        .flat_map(|(name, folder)| {
            let circles = circles(&sources(&folder.join("src")));
            circles.into_iter().map(move |circle| format!("{name}: {circle}"))
        })
        .collect();
    assert!(found.is_empty(), "circles of imports:\n{}", found.join("\n"));
}

fn planted(files: &[(&str, &str)]) -> Vec<String> {
    let sources = files.iter().map(|(path, text)| {
        let names = path.split('/').filter(|name| !name.is_empty());
        (names.map(str::to_owned).collect(), code(text))
    });
    circles(&sources.collect())
}

#[test]
fn planted_circles_are_found() {
    let planted_circles: [(&str, &[(&str, &str)]); 7] = [
        ("of two files", &[("a", "use crate::b::B;"), ("b", "use super::a::A;")]),
        ("of three", &[("a", "use super::b::B;"), ("b", "use super::c;"), ("c", "use super::a;")]),
        (
            "in braces",
            &[("a", "use crate::{x::Y, b::{self, B}};"), ("b", "fn f() { crate::a::f() }")],
        ),
        (
            "in a folder",
            &[("f", ""), ("f/a", "use super::b::B;"), ("f/b", "use super::a::A as Other;")],
        ),
        (
            "through a re-export",
            &[("", "pub use a::A;"), ("a", "use crate::b::B;"), ("b", "use crate::A;")],
        ),
        (
            "of folders, and of none of their files",
            &[
                ("f", ""),
                ("g", ""),
                ("f/a", "use crate::g::a::A;"),
                ("g/a", ""),
                ("g/b", "use crate::f::b::B;"),
                ("f/b", ""),
            ],
        ),
        (
            "below a test",
            &[("a", "#[cfg(test)]\nmod tests;\nuse crate::b::B;"), ("b", "use crate::a::A;")],
        ),
    ];
    for (name, files) in planted_circles {
        assert!(!planted(files).is_empty(), "a circle {name} is not found");
    }
}

#[test]
fn imports_without_a_circle_pass() {
    let files = [
        ("", "mod a;\npub use a::A;\nfn f() { f::f() }"),
        (
            "a",
            "use crate::b::B; // use crate::c::C;\n#[cfg(test)]\nmod tests {\n    use crate::c::C;\n}",
        ),
        ("b", "use crate::Shared;\nuse clap::a::A;"),
        ("c", "use crate::{A, b};"),
        ("f", "mod a;\nuse a::A;\nuse super::c::C;\npub trait T {}"),
        ("f/a", "use super::T;\nuse crate::a::A;"),
    ];
    let found = planted(&files);
    assert!(found.is_empty(), "{found:?}");
}
