//! Skeletons in the layout of a document's own code.

use scene::schema::OptionKind;
use simulator::vocabulary;

use crate::suite::assignment::Assignment;

/// The program of the lecture's files.
pub(super) const SIMULATOR: &str = "simulator.py";

/// The method of the lecture, and its force.
const LECTURE: [&str; 2] = ["projected-newton", "greenspringforce"];

/// The six functions of the fast mass-spring assignment, each dense and sparse.
const FUNCTIONS: [&str; 3] =
    ["signed_incidence_matrix", "fast_mass_springs_precomputation", "fast_mass_springs_step"];

/// The fast mass-spring assignment in C++: a file for each of its six functions.
pub(super) fn fast_mass_springs() -> Vec<(String, String)> {
    let header = include_str!("springs/fast_mass_springs.h");
    let mut files = vec![
        ("main.cpp".to_owned(), include_str!("springs/main.cpp").to_owned()),
        ("include/fast_mass_springs.h".to_owned(), header.to_owned()),
    ];
    for function in FUNCTIONS {
        for solver in ["dense", "sparse"] {
            let name = format!("{function}_{solver}");
            files.push((format!("src/{name}.cpp"), stub(header, &name)));
        }
    }
    files
}

/// The definition of a function that a header declares, as a stub.
fn stub(header: &str, name: &str) -> String {
    let at = header.find(&format!(" {name}(")).unwrap_or(0);
    let begin = header[..at].rfind('\n').map_or(0, |end| end + 1);
    let end = header[begin..].find(';').map_or(header.len(), |length| begin + length);
    let declaration = &header[begin..end];
    format!(
        "#include \"fast_mass_springs.h\"\n\n{declaration} {{\n    // your code here\n    \
         notImplemented(\"{name}\");\n}}\n"
    )
}

/// The lecture's files in Python, for an assignment of its method.
pub(super) fn lecture(assignment: &Assignment) -> Option<Vec<(String, String)>> {
    let [method, force] = LECTURE;
    let scope = assignment.scope();
    let has = |words: &Option<Vec<String>>, word: &str| {
        words.as_ref().is_some_and(|words| words.iter().any(|known| known == word))
    };
    if !(has(&scope.integrators, method) && has(&scope.forces, force)) {
        return None;
    }
    let vocabulary = vocabulary();
    let option = vocabulary.integrator(method)?.options.iter().find(|o| o.name == "tolerance")?;
    let OptionKind::Number { default, .. } = option.kind else { return None };
    let others = vocabulary.forces.iter().filter(|schema| schema.tag != force);
    let others: Vec<String> = others.map(|schema| format!("\"{}\"", schema.tag)).collect();
    let simulator = include_str!("lecture/simulator.py")
        .replace("TOLERANCE", &format!("{default:?}"))
        .replace("OTHERS", &others.join(", "));
    let others = [
        ("InertiaEnergy.py", include_str!("lecture/InertiaEnergy.py")),
        ("MassSpringEnergy.py", include_str!("lecture/MassSpringEnergy.py")),
        ("time_integrator.py", include_str!("lecture/time_integrator.py")),
        ("square_mesh.py", include_str!("lecture/square_mesh.py")),
        ("utils.py", include_str!("lecture/utils.py")),
    ];
    let mut files = vec![(SIMULATOR.to_owned(), simulator)];
    files.extend(others.map(|(name, text)| (name.to_owned(), text.to_owned())));
    Some(files)
}
