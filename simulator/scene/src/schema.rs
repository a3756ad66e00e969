//! Schemas of forces and integrators: the facts that the rest of the program derives from.
//!
//! Each force and each integrator states its facts here, once, in its registry entry. No fact has a default:
//! an entry that leaves one out does not compile. The parser, the help text, the grader's checks and the tables of
//! docs/methods.md all derive from these facts.

use super::{Dimension, ForceElement, Parameters};

/// All forces and integrators, for the parser.
#[derive(Debug, Clone)]
pub struct Vocabulary {
    /// The forces.
    pub forces: Vec<&'static ForceSchema>,
    /// The integrators.
    pub integrators: Vec<&'static IntegratorSchema>,
}

impl Vocabulary {
    /// The integrator that `spelling` names, by its name or one of its aliases.
    pub fn integrator(&self, spelling: &str) -> Option<&'static IntegratorSchema> {
        let is_named = |schema: &&&'static IntegratorSchema| {
            schema.name == spelling || schema.aliases.contains(&spelling)
        };
        self.integrators.iter().find(is_named).copied()
    }

    /// The force with this tag.
    pub fn force(&self, tag: &str) -> Option<&'static ForceSchema> {
        self.forces.iter().find(|schema| schema.tag == tag).copied()
    }
}

/// Facts about a force. Two schemas are equal if they have the same tag.
#[derive(Debug)]
pub struct ForceSchema {
    /// The element's tag.
    pub tag: &'static str,
    /// Its name in prose.
    pub title: &'static str,
    /// The law in a line of Markdown, as docs/methods.md shows it.
    pub formula: &'static str,
    /// Its derivatives and its energy, likewise.
    pub derivatives: Derivatives,
    /// The fewest dimensions of a scene that has it.
    pub least_dimension: Dimension,
    /// The particles that one element acts on.
    pub stencil: Stencil,
    /// Its parameters.
    pub parameters: &'static [ParameterSchema],
    /// Its parts, of which it is the sum; one or more.
    pub parts: &'static [PartSchema],
    /// How it depends on masses.
    pub masses: Masses,
    /// How it depends on initial positions, besides [coordinates](ParameterSchema::coordinate) that a file leaves out.
    pub initial: Initial,
    /// Attributes that a document mentions, and that have no effect.
    pub ignored: &'static [&'static str],
    /// Conserved quantities.
    pub conserves: Conserves,
    /// An element as it would stand in a file.
    pub example: &'static str,
}

impl ForceSchema {
    /// The number of the parameter `name` in [`ForceElement::parameters`].
    ///
    /// # Panics
    /// If the force has no such parameter.
    pub fn parameter_idx(&self, name: &str) -> usize {
        let found = self.parameters.iter().position(|parameter| parameter.name == name);
        found.unwrap_or_else(|| panic!("<{}> has no parameter {name}", self.tag))
    }

    /// Whether it has the parameter `name`.
    pub fn has_parameter(&self, name: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter.name == name)
    }

    /// The parameters of an element: those given by name, and for the others their defaults, or 0.
    ///
    /// # Panics
    /// If the force has no parameter of a given name.
    pub fn values(&self, given: &[(&str, f64)]) -> Parameters {
        let defaults = self.parameters.iter().map(|parameter| parameter.default.unwrap_or(0.0));
        let mut values: Parameters = defaults.collect();
        for (name, value) in given {
            values[self.parameter_idx(name)] = *value;
        }
        values
    }

    /// Whether an element has undeformed corners.
    pub fn is_element(&self) -> bool {
        self.parameters.iter().any(|parameter| parameter.coordinate.is_some())
    }

    /// Whether an element is a triangle with undeformed corners.
    pub fn is_triangle(&self) -> bool {
        self.stencil.size() == 3 && self.is_element()
    }

    /// Whether scenes of this dimension may have it.
    pub fn exists_in(&self, dimension: Dimension) -> bool {
        dimension.count() >= self.least_dimension.count()
    }

    /// A zero for each parameter.
    pub fn zeros(&self) -> Parameters {
        self.parameters.iter().map(|_| 0.0).collect()
    }

    /// The part `name`.
    ///
    /// # Panics
    /// If the force has no such part.
    pub fn part(&self, name: &str) -> &'static PartSchema {
        let found = self.parts.iter().find(|part| part.name == name);
        found.unwrap_or_else(|| panic!("<{}> has no part {name}", self.tag))
    }

    /// Whether a scene may have each part without the others.
    pub fn is_separable(&self) -> bool {
        self.parts.len() > 1 && self.parts.iter().all(|part| part.stands_alone)
    }

    /// Dependence of the force, all parts together.
    pub fn depends_on(&self) -> Dependence {
        self.parts.iter().fold(Dependence::NOTHING, |sum, part| sum.or(part.depends_on))
    }

    /// Dependence of the parts that `parameter` appears in, all together.
    pub fn depends_through(&self, parameter: &str) -> Dependence {
        let parts = self.parts.iter().filter(|part| part.names(parameter));
        parts.fold(Dependence::NOTHING, |sum, part| sum.or(part.depends_on))
    }
}

/// A part of a force. Each part may need those before it, unless it [stands alone](Self::stands_alone).
#[derive(Debug, PartialEq)]
pub struct PartSchema {
    /// Its name; `all` where it is the only one.
    pub name: &'static str,
    /// Its name in prose, after that of the force; empty where it is the only one.
    pub title: &'static str,
    /// Description, in a report on this part alone.
    pub meaning: &'static str,
    /// The parameters that scale it: it is zero if all of them are.
    pub scaled_by: &'static [&'static str],
    /// The other parameters that it depends on.
    pub shaped_by: &'static [&'static str],
    /// Whether a scene may have it without the parts before it, and those without it.
    pub stands_alone: bool,
    /// Its dependence on the state.
    pub depends_on: Dependence,
    /// The function that it derives from, if any.
    pub derives_from: Potential,
}

impl PartSchema {
    /// The only part of a force.
    pub const fn whole(
        scaled_by: &'static [&'static str],
        shaped_by: &'static [&'static str],
        depends_on: Dependence,
        derives_from: Potential,
    ) -> Self {
        Self {
            name: "all",
            title: "",
            meaning: "the force",
            scaled_by,
            shaped_by,
            stands_alone: true,
            depends_on,
            derives_from,
        }
    }

    /// Whether `parameter` appears in it.
    pub fn names(&self, parameter: &str) -> bool {
        self.scaled_by.iter().chain(self.shaped_by).any(|name| *name == parameter)
    }
}

/// Dependence of a force on the state, besides its parameters and masses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dependence {
    /// Positions.
    pub position: bool,
    /// Velocities.
    pub velocity: bool,
    /// Time.
    pub time: bool,
}

impl Dependence {
    /// The same at every state and time.
    pub const NOTHING: Self = Self { position: false, velocity: false, time: false };
    /// On positions alone.
    pub const POSITION: Self = Self { position: true, velocity: false, time: false };
    /// On velocities alone.
    pub const VELOCITY: Self = Self { position: false, velocity: true, time: false };
    /// On positions and velocities.
    pub const STATE: Self = Self { position: true, velocity: true, time: false };
    /// On positions and the time.
    pub const POSITION_AND_TIME: Self = Self { position: true, velocity: false, time: true };
    /// On the time alone.
    pub const TIME: Self = Self { position: false, velocity: false, time: true };

    /// On what either depends on.
    pub const fn or(self, other: Self) -> Self {
        Self {
            position: self.position || other.position,
            velocity: self.velocity || other.velocity,
            time: self.time || other.time,
        }
    }

    /// Whether it has a Jacobian that is not zero.
    pub const fn has_jacobian(self) -> bool {
        self.position || self.velocity
    }
}

/// The function that a part of a force is the derivative of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Potential {
    /// A potential energy `U(x)`: `F = −∂U/∂x`, and `∂F/∂x` is symmetric.
    Energy,
    /// A dissipation function `R(v)`, which does not depend on positions: `F = −∂R/∂v`, and `∂F/∂v` is symmetric.
    Dissipation,
    /// Neither. The Jacobians need not be symmetric, and a method that minimises does not take the part.
    Neither,
}

/// How a force depends on masses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Masses {
    /// Not at all.
    None,
    /// In proportion to the particle's: the parameters are accelerations.
    Own,
    /// In proportion to the product of both particles'.
    Product,
}

/// How a force depends on the initial positions of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Initial {
    /// Not at all.
    None,
    /// In inverse proportion to the initial length of the path through the particles of its stencil, in their order.
    PathLength,
    /// In proportion to [`ForceElement::hinge_weight`].
    Hinge,
    /// Through the diagonal of the box around all particles of the scene.
    BoxDiagonal,
}

/// Derivatives and energy of a force in Markdown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Derivatives {
    /// `∂F_i/∂d` of a pair, or how an element of another stencil depends on positions.
    pub by_position: &'static str,
    /// `∂F_i/∂w`, or how it depends on velocities.
    pub by_velocity: &'static str,
    /// The energy or the dissipation function.
    pub energy: &'static str,
}

/// Quantities that a force conserves for any masses: the sum of its forces is zero, or that of its torques as well.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Conserves {
    /// Neither.
    Nothing,
    /// Momentum.
    Momentum,
    /// Momentum and angular momentum.
    AngularMomentum,
}

impl PartialEq for ForceSchema {
    fn eq(&self, other: &Self) -> bool {
        self.tag == other.tag
    }
}

/// The particles that a force element acts on, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stencil {
    /// Each particle of the scene by itself: a field.
    EveryParticle,
    /// The particles that these attributes name, all different.
    Named(&'static [&'static str]),
    /// The two particles of the edge named by the attribute `edge`.
    Edge,
}

impl Stencil {
    /// The attributes that name the particles.
    pub const fn attributes(self) -> &'static [&'static str] {
        match self {
            Self::EveryParticle => &[],
            Self::Named(attributes) => attributes,
            Self::Edge => &["edge"],
        }
    }

    /// The number of particles.
    pub const fn size(self) -> usize {
        self.particles().len()
    }

    /// The names of the particles in formulas.
    pub const fn particles(self) -> &'static [&'static str] {
        match self {
            Self::EveryParticle => &["i"],
            Self::Named(attributes) => attributes,
            Self::Edge => &["i", "j"],
        }
    }

    /// Whether it is each particle of the scene by itself.
    pub const fn is_field(self) -> bool {
        matches!(self, Self::EveryParticle)
    }
}

/// A parameter of a force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSchema {
    /// The attribute.
    pub name: &'static str,
    /// Description, in the field's terms.
    pub meaning: &'static str,
    /// The accepted values.
    pub domain: Domain,
    /// Its value if the attribute is missing; `None` if the attribute is required, or a [coordinate](Self::coordinate).
    pub default: Option<f64>,
    /// The coordinate that it is, of a particle's place in the undeformed element. If the attribute is missing, it is that of
    /// the particle's initial position.
    pub coordinate: Option<Coordinate>,
    /// Whether it belongs to three dimensions only.
    pub three_dimensional: bool,
    /// Whether it is a length, which is compared with distances of particles.
    pub is_length: bool,
    /// Lower and upper bound of values that checks and benches draw from.
    pub typical: (f64, f64),
    /// Three values with few binary digits, for checks of a few elements whose inputs must be exact in single
    /// precision. Not zero.
    pub samples: [f64; 3],
}

impl ParameterSchema {
    /// A required parameter, any finite number.
    pub const fn new(
        name: &'static str,
        meaning: &'static str,
        typical: (f64, f64),
        samples: [f64; 3],
    ) -> Self {
        Self {
            name,
            meaning,
            domain: Domain::Finite,
            default: None,
            coordinate: None,
            three_dimensional: false,
            is_length: false,
            typical,
            samples,
        }
    }

    /// The same, but never negative.
    pub const fn non_negative(mut self) -> Self {
        self.domain = Domain::NonNegative;
        self
    }

    /// The same, but above zero.
    pub const fn positive(mut self) -> Self {
        self.domain = Domain::Positive;
        self
    }

    /// The same, with a value for where it is missing.
    pub const fn default_to(mut self, value: f64) -> Self {
        self.default = Some(value);
        self
    }

    /// The same, a coordinate of a particle in the undeformed element; z in scenes of three dimensions only.
    pub const fn coordinate_of(mut self, particle: usize, axis: usize) -> Self {
        self.coordinate = Some(Coordinate { particle, axis });
        self.three_dimensional = axis == 2;
        self
    }

    /// The same, any finite number but 1 and −1.
    pub const fn except_unit(mut self) -> Self {
        self.domain = Domain::ExceptUnit;
        self
    }

    /// The same, Poisson's ratio of a stable solid.
    pub const fn of_solid(mut self) -> Self {
        self.domain = Domain::SolidPoissonRatio;
        self
    }

    /// Whether a file has to give it.
    pub const fn is_required(&self) -> bool {
        self.default.is_none() && self.coordinate.is_none()
    }

    /// The same, a length.
    pub const fn length(mut self) -> Self {
        self.is_length = true;
        self
    }

    /// The same, in scenes of three dimensions only.
    pub const fn in_three_dimensions(mut self) -> Self {
        self.three_dimensional = true;
        self
    }
}

/// A coordinate of a particle of a stencil.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coordinate {
    /// The particle's place in the stencil.
    pub particle: usize,
    /// 0, 1 or 2 for x, y or z.
    pub axis: usize,
}

/// The numbers that an attribute accepts. All of them are finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// Any.
    Finite,
    /// 0 or more.
    NonNegative,
    /// More than 0.
    Positive,
    /// From 0 to 1.
    UnitInterval,
    /// Any but 1 and −1.
    ExceptUnit,
    /// Between −1 and 1/2.
    SolidPoissonRatio,
}

impl Domain {
    /// Whether `value` is one of them.
    pub fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Finite => true,
                Self::NonNegative => value >= 0.0,
                Self::Positive => value > 0.0,
                Self::UnitInterval => (0.0..=1.0).contains(&value),
                Self::ExceptUnit => value.abs() != 1.0,
                Self::SolidPoissonRatio => -1.0 < value && value < 0.5,
            }
    }

    /// Description of the accepted numbers; follows "must be".
    pub fn describe(self) -> &'static str {
        match self {
            Self::Finite => "a finite number",
            Self::NonNegative => "a finite number, 0 or more",
            Self::Positive => "a finite number above 0",
            Self::UnitInterval => "between 0 and 1",
            Self::ExceptUnit => "a finite number other than 1 and -1",
            Self::SolidPoissonRatio => "above -1 and below 0.5",
        }
    }
}

/// Facts about an integrator. Two schemas are equal if they have the same name.
#[derive(Debug)]
pub struct IntegratorSchema {
    /// Its name: the spelling that this project writes.
    pub name: &'static str,
    /// Other spellings of the same method.
    pub aliases: &'static [&'static str],
    /// Its update rule in a line.
    pub summary: &'static str,
    /// The same in Markdown and in full, as docs/methods.md shows it.
    pub formula: &'static str,
    /// The equation that a step obeys.
    pub equation: StepEquation,
    /// Its family.
    pub family: Family,
    /// The matrix that it factorises.
    pub matrix: Matrix,
    /// Its stopping criterion.
    pub convergence: Convergence,
    /// Its order.
    pub order: Order,
    /// Its options: further attributes of its element.
    pub options: &'static [OptionSchema],
    /// The reason if it cannot simulate a force.
    pub refuses: fn(&ForceElement) -> Option<Refusal>,
}

impl PartialEq for IntegratorSchema {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// The equation of a step from `(x, v)` at time `t` to `(x', v')`, with `h` the time step and `M` the masses. The
/// grader's `reference` crate states each a second time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepEquation {
    /// `x' = x + h v`, `M (v' − v) = h F(x, v, t)`.
    ExplicitEuler,
    /// `M (v' − v) = h F(x, v, t)`, `x' = x + h v'`.
    SymplecticEuler,
    /// `(M − h² ∂F/∂x − h ∂F/∂v) (v' − v) = h F`, all at `(x + h v, v, t + h)`; `x' = x + h v'`.
    LinearizedImplicitEuler,
    /// `M (v' − v) = h F(x', v', t + h)`, `x' = x + h v'`.
    ImplicitEuler,
    /// Rounds of local and global steps: springs towards their rest lengths, other forces at `(x, v, t)`. Only
    /// `x' = x + h v'` holds for any number of rounds.
    LocalGlobal,
    /// `a = M⁻¹ F(x, v, t)`, `x' = x + h v + h²/2 a`, `v' = v + h/2 (a + M⁻¹ F(x', v + h a, t + h))`.
    VelocityVerlet,
    /// The classical Runge–Kutta method of four stages.
    RungeKutta4,
    /// `M (v' − v) = h F((x + x')/2, (v + v')/2, t + h/2)`, `x' = x + h (v + v')/2`.
    ImplicitMidpoint,
    /// Steps of Dormand and Prince's pair of orders 5 and 4, as many as error control asks for.
    DormandPrince,
    /// `M (v' − v̂) = 2/3 h F(x', v', t + h)`, `x' = x̂ + 2/3 h v'`, with `x̂ = 4/3 x − 1/3 x₋` and `v̂ = 4/3 v − 1/3 v₋`, where
    /// `(x₋, v₋)` is the state one step before; without one, the step is implicit Euler's.
    BackwardDifferentiation2,
}

impl StepEquation {
    /// Whether a step uses the state one step before its start.
    pub fn is_two_step(self) -> bool {
        match self {
            Self::ExplicitEuler
            | Self::SymplecticEuler
            | Self::LinearizedImplicitEuler
            | Self::ImplicitEuler
            | Self::LocalGlobal
            | Self::VelocityVerlet
            | Self::RungeKutta4
            | Self::ImplicitMidpoint
            | Self::DormandPrince => false,
            Self::BackwardDifferentiation2 => true,
        }
    }
}

/// Families of integrators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Forces are evaluated only at known states.
    Explicit,
    /// The same, and the step is a symplectic map if forces depend only on positions: momentum and angular momentum are
    /// conserved up to rounding.
    Symplectic,
    /// The new velocities, or those of the step's middle, are the solution of an equation.
    Implicit,
    /// The new positions minimise a function, and the new velocities are their change over `h`.
    Minimization,
}

/// The matrix that an integrator factorises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Matrix {
    /// None.
    None,
    /// `M − h² ∂F/∂x − h ∂F/∂v`, with `h` the time step or a part of it, recomputed at every iterate.
    Jacobians,
    /// A matrix that is constant over a run.
    Constant,
}

/// Stopping criterion of the iteration in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Convergence {
    /// No iteration: the step is explicit, or solves one linear system.
    Direct,
    /// The l2 norm of an update of the velocities is below this number.
    Update(f64),
    /// No component of the next update of the velocities is larger than the value of this option. A step may make more
    /// updates than that needs.
    UpdateOption(&'static str),
    /// The step is divided until the estimated error of each part is at most the value of this option.
    ErrorEstimate(&'static str),
    /// The number of rounds is the value of this option.
    Rounds(&'static str),
}

impl Convergence {
    /// The largest last update of the velocities in a step of `scene`; 0 if it has no such bound.
    pub fn tolerance(self, scene: &super::Scene) -> f64 {
        match self {
            Self::Direct | Self::ErrorEstimate(_) | Self::Rounds(_) => 0.0,
            Self::Update(tolerance) => tolerance,
            Self::UpdateOption(name) => scene.integrator_options.number(name),
        }
    }
}

/// Order of accuracy: for a smooth motion, the error is proportional to this power of the time step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Order {
    /// If no force depends on velocities.
    pub without_velocity: u32,
    /// If a force does.
    pub with_velocity: u32,
}

impl Order {
    /// The same order for all forces.
    pub const fn always(order: u32) -> Self {
        Self { without_velocity: order, with_velocity: order }
    }
}

/// Why an integrator does not simulate a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// The lack of the force; follows "because it".
    pub because: &'static str,
    /// The remedy.
    pub remedy: &'static str,
}

/// For integrators that simulate every force.
pub fn refuses_nothing(_: &ForceElement) -> Option<Refusal> {
    None
}

/// An option of an integrator.
#[derive(Debug, PartialEq)]
pub struct OptionSchema {
    /// The attribute.
    pub name: &'static str,
    /// Description, in the field's terms.
    pub meaning: &'static str,
    /// The accepted values, and the default.
    pub kind: OptionKind,
    /// The same values and meaning in Markdown, as docs/methods.md shows them.
    pub formats: OptionText,
    /// The values under which accuracy is measured; none where it does not depend on the option.
    pub accuracy: &'static [AccuracySetting],
}

/// An option in docs/methods.md.
#[derive(Debug, PartialEq)]
pub struct OptionText {
    /// Its values.
    pub values: &'static str,
    /// Description of the option.
    pub meaning: &'static str,
}

/// A value of an option under which accuracy is measured.
#[derive(Debug, PartialEq)]
pub struct AccuracySetting {
    /// The value, as written in a file.
    pub value: &'static str,
    /// Whether the error vanishes with the time step.
    pub converges: bool,
}

/// The values of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OptionKind {
    /// A number.
    Number {
        /// Which numbers.
        domain: Domain,
        /// Its value if the attribute is missing.
        default: f64,
    },
    /// A whole number.
    Count {
        /// The smallest one.
        least: u64,
        /// Its value if the attribute is missing.
        default: u64,
        /// The option, also a whole number, that it may not exceed.
        at_most: Option<&'static str>,
    },
    /// One of several words.
    Choice {
        /// The words; the first is the default.
        words: &'static [&'static str],
    },
}

impl OptionKind {
    /// The value if the attribute is missing.
    pub fn default(self) -> OptionValue {
        match self {
            Self::Number { default, .. } => OptionValue::Number(default),
            Self::Count { default, .. } => OptionValue::Count(default),
            Self::Choice { words } => OptionValue::Choice(words.first().copied().unwrap_or("")),
        }
    }

    /// Parses a value.
    ///
    /// # Errors
    /// If the text is not accepted: a description that follows "must be".
    pub fn parse(self, text: &str) -> Result<OptionValue, String> {
        let text = text.trim();
        match self {
            Self::Number { domain, .. } => match text.parse() {
                Ok(value) if domain.contains(value) => Ok(OptionValue::Number(value)),
                _ => Err(domain.describe().to_owned()),
            },
            Self::Count { least, .. } => match text.parse() {
                Ok(value) if value >= least => Ok(OptionValue::Count(value)),
                _ => Err(format!("a whole number, {least} or more")),
            },
            Self::Choice { words } => {
                let word = words.iter().find(|word| **word == text);
                word.map(|word| OptionValue::Choice(word))
                    .ok_or_else(|| format!("one of {}", words.join(", ")))
            }
        }
    }
}

/// The value of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OptionValue {
    /// Of an [`OptionKind::Number`].
    Number(f64),
    /// Of an [`OptionKind::Count`].
    Count(u64),
    /// Of an [`OptionKind::Choice`].
    Choice(&'static str),
}

/// The values of all options of an integrator.
#[derive(Debug, Clone, PartialEq)]
pub struct IntegratorOptions {
    integrator: &'static str,
    schema: &'static [OptionSchema],
    values: Vec<OptionValue>,
}

impl IntegratorOptions {
    /// The defaults of `integrator`.
    pub fn defaults(integrator: &IntegratorSchema) -> Self {
        let values = integrator.options.iter().map(|option| option.kind.default()).collect();
        Self { integrator: integrator.name, schema: integrator.options, values }
    }

    /// Whether these are the options of `integrator`.
    pub fn is_of(&self, integrator: &IntegratorSchema) -> bool {
        self.integrator == integrator.name
    }

    /// Sets the option `name`.
    ///
    /// # Errors
    /// If there is no such option, or it cannot have that value.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), OptionError> {
        let Some(place) = self.schema.iter().position(|option| option.name == name) else {
            return Err(OptionError::Unknown);
        };
        let value = self.schema[place].kind.parse(text);
        self.values[place] = value.map_err(|must_be| OptionError::Value { must_be })?;
        Ok(())
    }

    /// The first option that exceeds another one which it may not, with the description that follows "must be".
    pub fn excess(&self) -> Option<(&'static OptionSchema, String)> {
        self.iter().find_map(|(option, value)| {
            let OptionKind::Count { at_most: Some(other), .. } = option.kind else { return None };
            let (OptionValue::Count(count), most) = (value, self.count(other)) else { return None };
            (count > most).then(|| (option, format!("at most {other}, which is {most}")))
        })
    }

    /// Every option with its value, in the order of the schema.
    pub fn iter(&self) -> impl Iterator<Item = (&'static OptionSchema, OptionValue)> {
        self.schema.iter().zip(self.values.iter().copied())
    }

    /// The value of a number.
    ///
    /// # Panics
    /// If the schema has no such number.
    pub fn number(&self, name: &str) -> f64 {
        match self.value(name) {
            OptionValue::Number(value) => value,
            other => unreachable!("{name} is {other:?}, and not a number"),
        }
    }

    /// The value of a count.
    ///
    /// # Panics
    /// If the schema has no such count.
    pub fn count(&self, name: &str) -> u64 {
        match self.value(name) {
            OptionValue::Count(value) => value,
            other => unreachable!("{name} is {other:?}, and not a count"),
        }
    }

    /// The word chosen.
    ///
    /// # Panics
    /// If the schema has no such choice.
    pub fn choice(&self, name: &str) -> &'static str {
        match self.value(name) {
            OptionValue::Choice(word) => word,
            other => unreachable!("{name} is {other:?}, and not a choice"),
        }
    }

    fn value(&self, name: &str) -> OptionValue {
        let found = self.iter().find(|(option, _)| option.name == name);
        found.unwrap_or_else(|| panic!("the schema has no option {name}")).1
    }
}

/// An option that cannot be set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OptionError {
    /// The integrator has no option of that name.
    Unknown,
    /// The option cannot have that value.
    Value {
        /// Description of the accepted values; follows "must be".
        must_be: String,
    },
}
