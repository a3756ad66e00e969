//! Skeletons in the layout of the course's starter code: a file for each force and each integrator.
//!
//! ```text
//! FOSSSim/main.cpp, TwoDScene.h, …     reads scenes, takes steps, writes traces; complete
//! FOSSSim/SpringForce.{h,cpp}, …       a force of the assignment; its functions end the program with exit code 77
//! FOSSSim/SymplecticEuler.{h,cpp}, …   an integrator of it, likewise
//! ```
//!
//! Which forces and integrators there are, what they are built from and which derivatives a force has follow from the
//! assignment's scope and the registries. An integrator that the assignment lists in an entry without points comes with
//! its starter code: it is complete where this module knows its step.

use std::fmt::Write;

use scene::schema::{
    Coordinate, ForceSchema, Initial, IntegratorSchema, Matrix, ParameterSchema, Stencil,
};
use simulator::vocabulary;

use super::{Language, tag};
use crate::suite::assignment::Assignment;

/// Folder of the sources.
pub(super) const FOLDER: &str = "FOSSSim";

/// A function of a force: name, argument, and whether it is not zero for a force.
type Function = (&'static str, &'static str, fn(&ForceSchema) -> bool);

/// The functions of a force.
const FUNCTIONS: [Function; 3] = [
    ("addGradEToTotal", "VectorXs& gradE", |_| true),
    ("addHessXToTotal", "MatrixXs& hessE", |schema| schema.depends_on().position),
    ("addHessVToTotal", "MatrixXs& hessE", |schema| schema.depends_on().velocity),
];

/// Features that an assignment asks for.
pub(super) struct Course {
    forces: Vec<&'static ForceSchema>,
    /// The integrators, with their spellings and whether they come with the starter code.
    integrators: Vec<(&'static IntegratorSchema, Vec<String>, bool)>,
}

impl Course {
    /// The layout of an assignment, if it is one for the course's scenes: XML, two dimensions, forces and integrators by
    /// name, and no force that depends on the time, which the course's functions do not have.
    pub(super) fn of(assignment: &Assignment) -> Option<Self> {
        let scope = assignment.scope();
        let vocabulary = vocabulary();
        let is_flat = scope.formats.as_deref() == Some(&["xml".to_owned()])
            && scope.dimensions.as_deref() == Some(&[2]);
        let forces = scope.forces.as_ref()?.iter().filter_map(|tag| vocabulary.force(tag));
        let forces: Vec<&ForceSchema> = forces.collect();
        if !is_flat || forces.iter().any(|schema| schema.depends_on().time) {
            return None;
        }
        let mut integrators: Vec<(&IntegratorSchema, Vec<String>, bool)> = Vec::new();
        for spelling in scope.integrators.as_ref()? {
            let schema = vocabulary.integrator(spelling)?;
            match integrators.iter_mut().find(|(known, ..)| known.name == schema.name) {
                Some((_, spellings, _)) => spellings.push(spelling.clone()),
                None => {
                    let is_given =
                        assignment.comes_with(schema.name) && step(schema.name).is_some();
                    integrators.push((schema, vec![spelling.clone()], is_given));
                }
            }
        }
        Some(Self { forces, integrators })
    }

    /// Whether the skeleton moves particles on which no force acts.
    pub(super) fn moves(&self) -> bool {
        self.integrators.iter().any(|(.., is_given)| *is_given)
    }

    /// Whether some integrator needs Jacobians.
    fn needs_jacobians(&self) -> bool {
        self.integrators.iter().any(|(schema, ..)| schema.matrix == Matrix::Jacobians)
    }

    /// The sources, by path.
    pub(super) fn files(&self, language: Language) -> Option<Vec<(String, String)>> {
        let path = |name: &str| format!("{FOLDER}/{name}");
        let plain = |files: &[(&str, &str)]| {
            files.iter().map(|(name, text)| (path(name), (*text).to_owned())).collect::<Vec<_>>()
        };
        let mut files = match language {
            Language::Cpp => plain(&[
                ("MathDefs.h", include_str!("course/MathDefs.h")),
                ("Force.h", include_str!("course/Force.h")),
                ("SceneStepper.h", include_str!("course/SceneStepper.h")),
                ("TwoDScene.h", include_str!("course/TwoDScene.h")),
            ]),
            Language::Python => plain(&[
                ("MathDefs.py", include_str!("course/MathDefs.py")),
                ("TwoDScene.py", include_str!("course/TwoDScene.py")),
            ]),
            Language::Rust => return None,
        };
        for schema in &self.forces {
            let name = force_class(schema);
            match language {
                Language::Cpp => {
                    files.push((path(&format!("{name}.h")), cpp_header(schema)));
                    files.push((path(&format!("{name}.cpp")), self.cpp_force(schema)));
                }
                _ => files.push((path(&format!("{name}.py")), self.python_force(schema))),
            }
        }
        for (schema, _, is_given) in &self.integrators {
            let name = camel(schema.name);
            let given = step(schema.name).filter(|_| *is_given);
            match language {
                Language::Cpp => {
                    let header = format!(
                        "#pragma once\n// {}: {}.\n\n#include \"SceneStepper.h\"\n\nclass {name} : public \
                         SceneStepper {{\npublic:\n    bool stepScene(TwoDScene& scene, scalar dt) override;\n}};\n",
                        schema.name, schema.summary
                    );
                    let body = given.map_or_else(|| cpp_stub(schema.name), |step| cpp_step(&step));
                    let source = format!(
                        "#include \"{name}.h\"\n\nbool {name}::stepScene(TwoDScene& scene, scalar dt) {{\n{body}}}\n"
                    );
                    files.push((path(&format!("{name}.h")), header));
                    files.push((path(&format!("{name}.cpp")), source));
                }
                _ => {
                    let body =
                        given.map_or_else(|| python_stub(schema.name), |step| python_step(&step));
                    let text = format!(
                        "\"\"\"{}: {}.\"\"\"\n\nfrom MathDefs import not_implemented, solve, zero_matrix, zeros\n\n\n\
                         class {name}:\n    def stepScene(self, scene, dt):\n        \"\"\"Takes one step of length \
                         dt: changes scene.x and scene.v.\"\"\"\n{body}",
                        schema.name, schema.summary
                    );
                    files.push((path(&format!("{name}.py")), text));
                }
            }
        }
        files.push(match language {
            Language::Cpp => (path("main.cpp"), self.cpp_main()),
            _ => (path("main.py"), self.python_main()),
        });
        Some(files)
    }

    /// Tags of the forces that the assignment does not have.
    fn others(&self) -> Vec<&'static str> {
        let all = vocabulary().forces.into_iter();
        all.filter(|schema| !self.forces.contains(schema)).map(|schema| schema.tag).collect()
    }

    fn cpp_main(&self) -> String {
        let forces = self.forces.iter().map(|schema| force_class(schema));
        let steppers = self.integrators.iter().map(|(schema, ..)| camel(schema.name));
        let includes: String =
            forces.chain(steppers).map(|name| format!("#include \"{name}.h\"\n")).collect();
        let mut steppers = String::new();
        for (schema, spellings, _) in &self.integrators {
            for spelling in spellings {
                let name = camel(schema.name);
                let _ = writeln!(
                    steppers,
                    "    if (type == \"{spelling}\") return std::make_unique<{name}>();"
                );
            }
        }
        let mut forces = String::new();
        for schema in &self.forces {
            let ends: Vec<String> = match schema.stencil {
                Stencil::Edge => vec!["edge.first".to_owned(), "edge.second".to_owned()],
                stencil => {
                    let end = |name| format!("static_cast<int>(element.number(\"{name}\"))");
                    stencil.attributes().iter().map(end).collect()
                }
            };
            let number = |(name, source): (&str, Source)| match source {
                Source::Required => format!("element.number(\"{name}\")"),
                Source::Default(default) => format!("element.number(\"{name}\", {default:?})"),
                Source::Initial(Coordinate { particle, axis }) => {
                    format!(
                        "element.number(\"{name}\", scene.getX()[2 * {} + {axis}])",
                        ends[particle]
                    )
                }
                Source::PathLength => format!("pathLength(scene.getX(), {{{}}})", ends.join(", ")),
            };
            let numbers = arguments(schema).into_iter().map(number);
            let arguments: Vec<String> = ends.iter().cloned().chain(numbers).collect();
            let (class, arguments) = (force_class(schema), arguments.join(", "));
            let _ = writeln!(forces, "        if (element.name == \"{}\") {{", schema.tag);
            if schema.stencil == Stencil::Edge {
                forces += "            const auto edge = edges.at(static_cast<std::size_t>(element.number(\"edge\")));\n";
            }
            let _ = writeln!(
                forces,
                "            scene.insertForce(std::make_unique<{class}>({arguments}));\n        }}"
            );
        }
        let others: Vec<String> = self.others().iter().map(|tag| format!("\"{tag}\"")).collect();
        let _ = write!(
            forces,
            "        for (const char* other : {{{}}})\n            if (element.name == other) notImplemented(other);",
            others.join(", ")
        );
        include_str!("course/main.cpp")
            .replace("INCLUDES\n", &includes)
            .replace("STEPPERS\n", &steppers)
            .replace("FORCES", &forces)
    }

    fn python_main(&self) -> String {
        let forces = self.forces.iter().map(|schema| force_class(schema));
        let steppers = self.integrators.iter().map(|(schema, ..)| camel(schema.name));
        let includes: String =
            forces.chain(steppers).map(|name| format!("from {name} import {name}\n")).collect();
        let mut steppers = String::new();
        for (schema, spellings, _) in &self.integrators {
            for spelling in spellings {
                let _ = writeln!(steppers, "    \"{spelling}\": {},", camel(schema.name));
            }
        }
        let mut forces = String::new();
        for schema in &self.forces {
            let ends: Vec<String> = match schema.stencil {
                Stencil::Edge => vec!["*edges[int(number(\"edge\"))]".to_owned()],
                stencil => {
                    let end = |name| format!("int(number(\"{name}\"))");
                    stencil.attributes().iter().map(end).collect()
                }
            };
            let number = |(name, source): (&str, Source)| match source {
                Source::Required => format!("number(\"{name}\")"),
                Source::Default(default) => format!("number(\"{name}\", {default:?})"),
                Source::Initial(Coordinate { particle, axis }) => {
                    format!("number(\"{name}\", scene.x[2 * {} + {axis}])", ends[particle])
                }
                Source::PathLength => format!("path_length(scene, [{}])", ends.join(", ")),
            };
            let numbers = arguments(schema).into_iter().map(number);
            let arguments: Vec<String> = ends.iter().cloned().chain(numbers).collect();
            let _ = writeln!(
                forces,
                "        if element.tag == \"{}\":\n            scene.forces.append({}({}))",
                schema.tag,
                force_class(schema),
                arguments.join(", ")
            );
        }
        let others: Vec<String> = self.others().iter().map(|tag| format!("\"{tag}\"")).collect();
        let _ = write!(
            forces,
            "        if element.tag in ({},):\n            not_implemented(element.tag)",
            others.join(", ")
        );
        include_str!("course/main.py")
            .replace("INCLUDES\n", &includes)
            .replace("STEPPER_LIST\n", &steppers)
            .replace("FORCES", &forces)
    }

    fn cpp_force(&self, schema: &ForceSchema) -> String {
        let class = force_class(schema);
        let mut text = format!("#include \"{class}.h\"\n");
        for (function, argument, has) in FUNCTIONS {
            let body = self.body(schema, function, has(schema), cpp_stub);
            let body = body.unwrap_or_else(|| "    // Zero.\n".to_owned());
            let _ = write!(
                text,
                "\nvoid {class}::{function}(const VectorXs& x, const VectorXs& v, const VectorXs& m, {argument}) \
                 {{\n{body}}}\n"
            );
        }
        text
    }

    fn python_force(&self, schema: &ForceSchema) -> String {
        let names: Vec<String> = names(schema).map(|(_, name)| name.to_owned()).collect();
        let mut text = format!(
            "\"\"\"{}: {}.\"\"\"\n\nfrom MathDefs import not_implemented\n\n\nclass {}:\n    def __init__(self, {}):\n",
            tag(schema),
            schema.title,
            force_class(schema),
            names.join(", ")
        );
        for name in &names {
            let _ = writeln!(text, "        self.{name} = {name}");
        }
        for (function, argument, has) in FUNCTIONS {
            let argument = argument.rsplit(' ').next().unwrap_or_default().trim_start_matches('&');
            let body = self.body(schema, function, has(schema), python_stub);
            let body = body.unwrap_or_else(|| "        pass  # zero\n".to_owned());
            let _ = write!(text, "\n    def {function}(self, x, v, m, {argument}):\n{body}");
        }
        text
    }

    /// Last line of a function of a force, unless it is zero.
    fn body(
        &self,
        schema: &ForceSchema,
        function: &str,
        has: bool,
        stub: fn(&str) -> String,
    ) -> Option<String> {
        let is_asked = function == FUNCTIONS[0].0 || self.needs_jacobians();
        let what = if function == FUNCTIONS[0].0 {
            schema.tag.to_owned()
        } else {
            format!("{}: {function}", schema.tag)
        };
        // No method of the assignment calls it.
        (has && is_asked).then(|| stub(&what))
    }
}

fn cpp_header(schema: &ForceSchema) -> String {
    let class = force_class(schema);
    let arguments: Vec<String> =
        names(schema).map(|(kind, name)| format!("{kind} {name}")).collect();
    let members: Vec<String> = names(schema).map(|(_, name)| format!("m_{name}({name})")).collect();
    let mut text = format!(
        "#pragma once\n// {}: {}.\n\n#include \"Force.h\"\n\nclass {class} : public Force {{\npublic:\n    \
         {class}({}) : {} {{}}\n\n",
        tag(schema),
        schema.title,
        arguments.join(", "),
        members.join(", ")
    );
    for (function, argument, _) in FUNCTIONS {
        let _ = writeln!(
            text,
            "    void {function}(const VectorXs& x, const VectorXs& v, const VectorXs& m, {argument}) override;"
        );
    }
    text += "\nprivate:\n";
    for argument in names(schema).map(|(kind, name)| format!("    {kind} m_{name};\n")) {
        text += &argument;
    }
    text + "};\n"
}

fn cpp_stub(what: &str) -> String {
    format!("    // your code here\n    notImplemented(\"{what}\");\n")
}

fn python_stub(what: &str) -> String {
    format!("        # your code here\n        not_implemented(\"{what}\")\n")
}

/// The step of an integrator that comes with starter code.
struct Step {
    /// Whether positions move with the new velocities.
    new_velocities: bool,
}

fn step(name: &str) -> Option<Step> {
    match name {
        "explicit-euler" => Some(Step { new_velocities: false }),
        "symplectic-euler" => Some(Step { new_velocities: true }),
        _ => None,
    }
}

fn cpp_step(step: &Step) -> String {
    let position = "        x[k] += dt * v[k];\n";
    let velocity = "        if (!scene.isFixed(k / 2)) v[k] -= dt * gradU[k] / scene.getM()[k];\n";
    let [first, second] =
        if step.new_velocities { [velocity, position] } else { [position, velocity] };
    format!(
        "    VectorXs &x = scene.getX(), &v = scene.getV();\n    VectorXs gradU(x.size(), 0.0);\n    \
         scene.accumulateGradU(gradU);\n    for (std::size_t k = 0; k < x.size(); ++k) {{\n{first}{second}    }}\n    \
         return true;\n"
    )
}

fn python_step(step: &Step) -> String {
    let position = "            scene.x[k] += dt * scene.v[k]\n";
    let velocity = "            if not scene.fixed[k // 2]:\n                scene.v[k] -= dt * gradU[k] / scene.m[k]\n";
    let [first, second] =
        if step.new_velocities { [velocity, position] } else { [position, velocity] };
    format!(
        "        gradU = zeros(len(scene.x))\n        scene.accumulateGradU(gradU)\n        for k in \
         range(len(scene.x)):\n{first}{second}"
    )
}

/// The source of a number that a force is made with.
#[derive(Clone, Copy)]
enum Source {
    /// An attribute.
    Required,
    /// An attribute with a default.
    Default(f64),
    /// An attribute, or an initial position.
    Initial(Coordinate),
    /// The initial positions of its particles.
    PathLength,
}

/// The numbers that a force is made with in two dimensions, by name.
fn arguments(schema: &ForceSchema) -> Vec<(&'static str, Source)> {
    let parameters = schema.parameters.iter().filter(|parameter| !parameter.three_dimensional);
    let source = |parameter: &ParameterSchema| match (parameter.default, parameter.coordinate) {
        (Some(default), _) => Source::Default(default),
        (None, Some(coordinate)) => Source::Initial(coordinate),
        (None, None) => Source::Required,
    };
    let length = ("length", Source::PathLength);
    let length = (schema.initial == Initial::PathLength).then_some(length);
    parameters.map(|parameter| (parameter.name, source(parameter))).chain(length).collect()
}

/// The members of a force: type and name.
fn names(schema: &ForceSchema) -> impl Iterator<Item = (&'static str, &'static str)> {
    let ends = match schema.stencil {
        Stencil::Edge => &["i", "j"],
        stencil => stencil.attributes(),
    };
    let ends = ends.iter().map(|end| ("int", *end));
    ends.chain(arguments(schema).into_iter().map(|(name, _)| ("scalar", name)))
}

/// The course's name of a force's class. A tag shows no word boundaries but that before "force".
fn force_class(schema: &ForceSchema) -> String {
    let words = match schema.tag {
        "simplegravity" => "simple-gravity",
        "dragdamping" => "drag-damping",
        "greenspringforce" => "green-spring",
        "elasticbodyspringforce" => "elastic-body-spring",
        "elasticbodybendingforce" => "elastic-body-bending",
        "elasticbodycstforce" => "elastic-body-CST",
        tag => tag.trim_end_matches("force"),
    };
    camel(words) + "Force"
}

/// `SymplecticEuler` of `symplectic-euler`.
fn camel(words: &str) -> String {
    let capital = |word: &str| {
        let mut letters = word.chars();
        let first = letters.next().map(|letter| letter.to_ascii_uppercase());
        first.into_iter().chain(letters).collect::<String>()
    };
    words.split('-').map(capital).collect()
}
