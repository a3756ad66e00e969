//! Errors in JSON scenes and their meshes, with remedies.

/// A problem in a JSON scene or its OBJ file.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum JsonProblem {
    #[error("the file is empty")]
    Empty,
    #[error("this is not well-formed JSON: {detail}")]
    Malformed { detail: String },
    #[error("the file ends too early: {detail}")]
    Truncated { detail: String },
    #[error("a JSON scene must be an object")]
    NotAnObject,
    #[error("unknown key {key:?}")]
    UnknownKey { key: String, suggestion: Option<&'static str> },
    #[error("the key {key:?} is given a second time; the first is at line {first}")]
    RepeatedKey { key: String, first: u32 },
    #[error("there is no key {key:?}")]
    MissingKey { key: &'static str, example: &'static str },
    #[error("{key:?}: {text} must be {must_be}")]
    Value { key: &'static str, text: String, must_be: &'static str },
    #[error("{key:?}: {text} is out of the range of an f64")]
    Overflow { key: &'static str, text: String },
    #[error("\"b\" pins vertex {text}, and there is no such vertex")]
    NoSuchPin { text: String, count: usize },
    #[error("\"b\" pins vertex {vertex} a second time")]
    PinnedTwice { vertex: usize },
    #[error("the mesh {mesh} cannot be read: {source}")]
    MeshUnreadable { mesh: String, source: std::io::Error },
    #[error("{key:?} names {name:?}, which is not below the scene's folder")]
    Outside { key: &'static str, name: String },
    #[error("the mesh has no vertices")]
    NoVertices,
    #[error("the mesh has no faces or lines, and so no springs")]
    NoSprings,
    #[error("the statement {statement:?} adds no vertex and no spring")]
    UnknownStatement { statement: String },
    #[error("\"v\" has {count} numbers")]
    VertexNumbers { count: usize },
    #[error("{text:?} is not a number")]
    NotANumber { text: String },
    #[error("{text:?} is not a finite number")]
    NotFinite { text: String },
    #[error("{text:?} does not name a vertex")]
    NotAVertex { text: String },
    #[error("there is no vertex {text}")]
    NoSuchVertex { text: String, count: usize },
    #[error("{statement:?} joins fewer than two vertices")]
    TooFewVertices { statement: String },
    #[error("a face or line names vertex {vertex} twice")]
    SameVertex { vertex: usize },
    #[error("the line ends in a backslash, and no line follows")]
    NothingContinued,
    #[error("vertices {i} and {j} are joined a second time")]
    JoinedTwice { i: usize, j: usize },
    #[error("the faces and lines up to here join more than {limit} pairs of vertices")]
    TooManyPairs { limit: usize },
    #[error("the spring between vertices {i} and {j} is too long for an f64")]
    RestLength { i: usize, j: usize },
    #[error("vertex {vertex} has no mass: the scene has no \"m\", and no face at it has an area")]
    NoArea { vertex: usize },
    #[error("the area of the faces at vertex {vertex} is out of the range of an f64")]
    AreaOverflow { vertex: usize },
}

impl JsonProblem {
    /// A remedy for the user.
    pub fn remedy(&self) -> String {
        match self {
            Self::Empty | Self::NotAnObject => {
                "write an object that names a mesh: {\"obj\": \"net.obj\", \"k\": 100, \"m\": 1}"
                    .into()
            }
            Self::Malformed { .. } => "correct the text here or shortly before".into(),
            Self::Truncated { .. } => "restore the lost end of the file".into(),
            Self::UnknownKey { suggestion: Some(suggestion), .. } => {
                format!("did you mean {suggestion:?}?")
            }
            Self::UnknownKey { .. } => "it is ignored; remove it".into(),
            Self::RepeatedKey { .. } | Self::PinnedTwice { .. } => "keep one of them".into(),
            Self::MissingKey { example, .. } => format!("add for instance {example}"),
            Self::Value { key, must_be, .. } => format!("give {key:?} a value that is {must_be}"),
            Self::Overflow { .. } | Self::NotFinite { .. } => {
                "write a number below 1.8e308 in magnitude".into()
            }
            Self::NoSuchPin { count, .. } | Self::NoSuchVertex { count, .. } => {
                format!("the mesh has {count} vertices, counted from 1")
            }
            Self::MeshUnreadable { .. } => {
                "name an OBJ file by its path from the scene's folder".into()
            }
            Self::Outside { .. } => {
                "put the file into the scene's folder, and name it by its path from there; `simulate --unconfined` reads it \
                 elsewhere"
                    .into()
            }
            Self::NoVertices => "check that this is an OBJ file: a vertex is \"v 0.5 1 0\"".into(),
            Self::NoSprings => "join vertices, for instance by \"f 1 2\"".into(),
            Self::UnknownStatement { .. } => "it is ignored; remove it".into(),
            Self::VertexNumbers { .. } => {
                "write the coordinates x y z, and after them at most a weight and a colour".into()
            }
            Self::NotANumber { .. } => "write a decimal number, such as 0.5 or 1e-3".into(),
            Self::NotAVertex { .. } => {
                "write its number from 1 up, or from -1 down to count from the last; 1/2/3 with \
                 texture and normal"
                    .into()
            }
            Self::TooFewVertices { .. } => "name two vertices or more".into(),
            Self::SameVertex { .. } => "join different vertices".into(),
            Self::NothingContinued => "remove the backslash, or restore the lost end".into(),
            Self::JoinedTwice { .. } => "one spring counts; remove the other".into(),
            Self::TooManyPairs { .. } => "use a coarser mesh, or faces with fewer vertices".into(),
            Self::RestLength { .. } | Self::AreaOverflow { .. } => {
                "use units in which the mesh is smaller".into()
            }
            Self::NoArea { .. } => {
                "give all vertices a mass in the scene, \"m\": 1, or remove this one".into()
            }
        }
    }
}
