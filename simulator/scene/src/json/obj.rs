//! Parser for Wavefront OBJ meshes: vertices, faces and lines.
//!
//! ```text
//! v x y z [w] [r g b]      a vertex; weight and colour are ignored
//! vt u v [w]               texture coordinates
//! f 1 2 3 ...              a face of two vertices or more; in f 1/2/3 ... the 1 is the vertex, the 2 its texture coordinates
//! l 1 2 3 ...              a line from vertex to vertex
//! mtllib FILE ...          libraries of materials, for drawings
//! usemtl NAME              the material of the faces that follow, for drawings
//! ```
//!
//! Vertices count from 1, in the order of the file; -1 is the last one before the statement. A `#` starts
//! a comment, and a line that ends in a backslash goes on in the next. Statements that say how to draw
//! or to group are skipped; those of free-form curves and surfaces, and unknown ones, are remarked upon.
//! One pass, time and memory in proportion to the file. Source: Wavefront's Advanced Visualizer manual,
//! appendix B1.
//!
//! It is read here, and by no crate, because a scene needs what none of them keeps: positions in f64, the
//! file's own numbers of the vertices, faces of two vertices, polygons as they are, and the line and
//! column of what is wrong.

use super::source::{Source, Warnings, excerpt};
use crate::error::{JsonProblem, SceneError};
use crate::{Mention, SurfaceCorner};

/// Statements that say nothing of the mesh's shape.
const SKIPPED: &[&str] = &[
    "vn",
    "vp",
    "p",
    "o",
    "g",
    "s",
    "mg",
    "usemap",
    "maplib",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
];

/// The content of an OBJ file. Vertices are numbered from 0.
#[derive(Default)]
pub(super) struct Mesh {
    /// Position of each vertex.
    pub(super) positions: Vec<[f64; 3]>,
    /// Where each vertex stands in the file.
    pub(super) places: Vec<u32>,
    corners: Vec<Corner>,
    elements: Vec<(ElementKind, usize)>,
    /// Texture coordinates; `None` for a statement that has no such numbers.
    textures: Vec<Option<[f64; 2]>>,
    /// Faces so far, as [`Self::faces`] counts them.
    n_faces: usize,
    /// Libraries of materials.
    pub(super) libraries: Vec<Mention>,
    /// Materials, each with the number of the first face that has it.
    pub(super) materials: Vec<(usize, Mention)>,
}

/// A vertex as a face or a line names it.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    /// The vertex.
    pub(super) vertex: u32,
    /// Where it is named.
    pub(super) place: u32,
    /// Its texture coordinates by their number in the file; `u32::MAX` if it has none.
    texture: u32,
}

/// Kinds of elements that connect vertices.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementKind {
    /// `f`: each vertex with each.
    Face,
    /// `l`: each vertex with the next.
    Line,
}

impl Mesh {
    /// Every face and line, in the order of the file; each has two corners or more, at different
    /// vertices but for a line's that are no neighbours.
    pub(super) fn elements(&self) -> impl Iterator<Item = (ElementKind, &[Corner])> {
        let ends = self.elements.iter().skip(1).map(|(_, start)| *start);
        let ends = ends.chain([self.corners.len()]);
        self.elements
            .iter()
            .zip(ends)
            .map(|((kind, start), end)| (*kind, &self.corners[*start..end]))
    }

    /// The faces of three corners or more. Texture coordinates that are not there are left out: only drawings need them.
    pub(super) fn faces(&self) -> Vec<Vec<SurfaceCorner>> {
        let corner = |corner: &Corner| SurfaceCorner {
            particle: corner.vertex as usize,
            texture: self.textures.get(corner.texture as usize).copied().flatten(),
        };
        let is_face = |(kind, corners): &(ElementKind, &[Corner])| {
            *kind == ElementKind::Face && corners.len() > 2
        };
        let faces = self.elements().filter(is_face);
        faces.map(|(_, corners)| corners.iter().map(corner).collect()).collect()
    }

    /// Reads a mesh.
    ///
    /// # Errors
    /// If a vertex, a face or a line is not as it must be, or there is no vertex; under `strict` at
    /// statements that are not known.
    pub(super) fn read(
        source: &mut Source<'_>,
        warnings: &mut Warnings,
    ) -> Result<Self, SceneError> {
        let mut mesh = Self::default();
        let mut words: Vec<&str> = Vec::new();
        let mut continued = false;
        for line in source.text.split_inclusive('\n') {
            if !continued {
                words.clear();
            }
            let line = line.split('#').next().unwrap_or_default().trim_ascii_end();
            let (line, goes_on) = match line.strip_suffix('\\') {
                Some(line) => (line, true),
                None => (line, false),
            };
            words.extend(line.split_ascii_whitespace());
            continued = goes_on;
            if !continued {
                mesh.statement(&words, source, warnings)?;
            }
        }
        if continued {
            let end = source.text.trim_ascii_end().len() - 1;
            return Err(source.error(end, JsonProblem::NothingContinued));
        }
        if mesh.positions.is_empty() {
            return Err(source.whole(JsonProblem::NoVertices));
        }
        mesh.check_corners(source)?;
        Ok(mesh)
    }

    fn statement(
        &mut self,
        words: &[&str],
        source: &mut Source<'_>,
        warnings: &mut Warnings,
    ) -> Result<(), SceneError> {
        let [statement, arguments @ ..] = words else { return Ok(()) };
        let kind = match *statement {
            "v" => return self.vertex(statement, arguments, source),
            "vt" => {
                self.textures.push(texture(arguments));
                return Ok(());
            }
            "mtllib" | "usemtl" => {
                self.material(statement, arguments, source);
                return Ok(());
            }
            "f" => ElementKind::Face,
            "l" => ElementKind::Line,
            skipped if SKIPPED.contains(&skipped) => return Ok(()),
            unknown => {
                let problem = JsonProblem::UnknownStatement { statement: excerpt(unknown) };
                return warnings.add(source, source.offset_of(unknown), problem);
            }
        };
        if arguments.len() < 2 {
            let problem = JsonProblem::TooFewVertices { statement: excerpt(statement) };
            return Err(source.error(source.offset_of(statement), problem));
        }
        self.elements.push((kind, self.corners.len()));
        self.n_faces += usize::from(kind == ElementKind::Face && arguments.len() > 2);
        for text in arguments {
            let place = source.offset_of(text);
            let vertex = self.corner(text, place, source)?;
            let number = text.split('/').nth(1).and_then(|number| number.parse::<i64>().ok());
            let texture = match number {
                Some(number @ ..=-1) => number.saturating_add(self.textures.len() as i64),
                Some(number) => number - 1,
                None => -1,
            };
            let texture = texture.try_into().unwrap_or(u32::MAX);
            self.corners.push(Corner { vertex, place: place as u32, texture });
        }
        Ok(())
    }

    /// Keeps the name of a library or a material. One without a name is left out: only drawings need it.
    fn material(&mut self, statement: &str, words: &[&str], source: &mut Source<'_>) {
        let name = words.join(" ");
        let is_library = statement == "mtllib";
        let is_repeated =
            !is_library && self.materials.last().is_some_and(|(_, mention)| mention.name == name);
        if name.is_empty() || is_repeated {
            return;
        }
        let mention = Mention { name, location: source.locate(source.offset_of(words[0])) };
        if is_library {
            self.libraries.push(mention);
        } else {
            self.materials.push((self.n_faces, mention));
        }
    }

    fn vertex(
        &mut self,
        statement: &str,
        numbers: &[&str],
        source: &mut Source<'_>,
    ) -> Result<(), SceneError> {
        let place = source.offset_of(statement);
        if !matches!(numbers.len(), 3 | 4 | 6 | 7) {
            let problem = JsonProblem::VertexNumbers { count: numbers.len() };
            return Err(source.error(place, problem));
        }
        let mut position = [0.0; 3];
        for (axis, text) in numbers.iter().enumerate() {
            let problem = match text.parse::<f64>() {
                Ok(value) if value.is_finite() => {
                    if let Some(coordinate) = position.get_mut(axis) {
                        *coordinate = value;
                    }
                    continue;
                }
                Ok(_) => JsonProblem::NotFinite { text: excerpt(text) },
                Err(_) => JsonProblem::NotANumber { text: excerpt(text) },
            };
            return Err(source.error(source.offset_of(text), problem));
        }
        self.positions.push(position);
        self.places.push(place as u32);
        Ok(())
    }

    /// The vertex that `1`, `-1`, `1/2`, `1//3` or `1/2/3` names. One that comes later in the file, or
    /// never, is left for [`Self::check_corners`].
    fn corner(&self, text: &str, place: usize, source: &mut Source<'_>) -> Result<u32, SceneError> {
        let mut parts = text.split('/');
        let vertex = parts.next().and_then(|vertex| vertex.parse::<i64>().ok());
        let is_index = |part: &str| part.is_empty() || part.parse::<i64>().is_ok();
        let count = self.positions.len();
        match vertex {
            Some(vertex) if text.split('/').count() <= 3 && parts.all(is_index) => {
                let index =
                    if vertex < 0 { vertex.saturating_add(count as i64) } else { vertex - 1 };
                if index < 0 {
                    let problem = JsonProblem::NoSuchVertex { text: excerpt(text), count };
                    return Err(source.error(place, problem));
                }
                Ok(index.try_into().unwrap_or(u32::MAX))
            }
            _ => Err(source.error(place, JsonProblem::NotAVertex { text: excerpt(text) })),
        }
    }

    /// Every corner names a vertex that is there, and none is joined with itself.
    fn check_corners(&self, source: &mut Source<'_>) -> Result<(), SceneError> {
        let count = self.positions.len();
        for corner in &self.corners {
            if corner.vertex as usize >= count {
                let text = source.text[corner.place as usize..].split_ascii_whitespace().next();
                let text = excerpt(text.unwrap_or_default());
                let problem = JsonProblem::NoSuchVertex { text, count };
                return Err(source.error(corner.place as usize, problem));
            }
        }
        let mut sorted: Vec<Corner> = Vec::new();
        for (kind, corners) in self.elements() {
            let next = |pair: &&[Corner]| pair[0].vertex == pair[1].vertex;
            let same = match kind {
                ElementKind::Line => corners.windows(2).find(next).map(|pair| pair[1]),
                ElementKind::Face => {
                    sorted.clear();
                    sorted.extend(corners);
                    sorted.sort_by_key(|corner| (corner.vertex, corner.place));
                    sorted.windows(2).filter(next).map(|pair| pair[1]).min_by_key(|c| c.place)
                }
            };
            if let Some(Corner { vertex, place, .. }) = same {
                let problem = JsonProblem::SameVertex { vertex: vertex as usize + 1 };
                return Err(source.error(place as usize, problem));
            }
        }
        Ok(())
    }
}

/// The numbers of `vt`; `None` where they are not finite numbers.
fn texture(words: &[&str]) -> Option<[f64; 2]> {
    let [u, rest @ ..] = words else { return None };
    let v = rest.first().copied().unwrap_or("0");
    let numbers = [u.parse::<f64>().ok()?, v.parse::<f64>().ok()?];
    numbers.iter().all(|number| number.is_finite()).then_some(numbers)
}
