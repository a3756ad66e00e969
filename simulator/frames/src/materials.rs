//! Materials of a mesh: what its texture and its material libraries (`.mtl`) say of the colours of its faces.
//!
//! ```text
//! mtllib FILE …           in the OBJ file: libraries, by their paths from its folder
//! usemtl NAME             in the OBJ file: the material of the faces that follow
//! newmtl NAME             starts a material
//! Kd r g b                its diffuse colour, each from 0 to 1; r alone is a grey
//! map_Kd [OPTION …] FILE  its texture, a PNG file by its path from the library's folder; Kd multiplies its colours
//! ```
//!
//! Other statements of a library, and options of `map_Kd`, do not change the picture. The key `png` of a JSON scene covers
//! the whole mesh; libraries count where it is not there, or is no picture. Only drawings read these files. An unreadable
//! file is a note, and the faces keep the colour of surfaces. Source: Wavefront, *MTL material format*, version 4.2.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use picture::texture::{PIXELS, Texture};

use scene::{Color, Location, Mention, Surface, SurfaceCorner, is_below, read_bounded};

/// Colour of surfaces without a material.
const SURFACE: Color = Color { r: 0.88, g: 0.56, b: 0.26 };

/// Colour of a material with a texture and without a colour.
const WHITE: Color = Color { r: 1.0, g: 1.0, b: 1.0 };

/// Notes that are kept.
const MAX_NOTES: usize = 20;

/// How a face looks.
#[derive(Debug, Clone)]
pub struct Material {
    /// Its colour where it has no texture, or the face no texture coordinates.
    pub color: Color,
    /// Its paint.
    pub texture: Option<Arc<Texture>>,
}

impl Default for Material {
    fn default() -> Self {
        Self { color: SURFACE, texture: None }
    }
}

impl Material {
    /// The colour in the middle of a face.
    pub(crate) fn middle(&self, corners: &[SurfaceCorner]) -> Color {
        let places = corners.iter().map(|corner| corner.texture).collect::<Option<Vec<_>>>();
        let (Some(texture), Some(places)) = (&self.texture, places) else { return self.color };
        let mean =
            |axis: usize| places.iter().map(|place| place[axis]).sum::<f64>() / places.len() as f64;
        let [r, g, b] = texture.color([mean(0), mean(1)]).map(|value| value / 255.0);
        Color { r, g, b }
    }
}

/// The materials of a surface.
#[derive(Debug, Clone)]
pub struct Materials {
    /// At least one.
    materials: Vec<Material>,
    /// Faces from which on a material counts, in ascending order, and its number.
    faces: Vec<(usize, usize)>,
}

impl Default for Materials {
    fn default() -> Self {
        Self { materials: vec![Material::default()], faces: Vec::new() }
    }
}

impl Materials {
    /// Reads the files that the surface names, and notes what cannot be used, with file and line.
    pub fn read(surface: &Surface) -> (Self, Vec<String>) {
        let confined_to = surface.confined_to.clone();
        let mut reader = Reader { confined_to, ..Reader::default() };
        let materials = reader.read(surface);
        let Reader { mut notes, n_notes, .. } = reader;
        if n_notes > notes.len() {
            let more = n_notes - notes.len();
            notes.push(format!("{}: {more} more notes on its materials", surface.mesh.display()));
        }
        (materials, notes)
    }

    /// One texture that covers all faces.
    pub(crate) fn of(texture: Texture) -> Self {
        let texture = Some(Arc::new(texture));
        Self { materials: vec![Material { texture, ..Material::default() }], faces: Vec::new() }
    }

    /// The number of materials.
    pub fn count(&self) -> usize {
        self.materials.len()
    }

    /// A material by its number.
    pub fn get(&self, number: usize) -> &Material {
        &self.materials[number]
    }

    /// The number of the material of each face, of `count` faces.
    pub fn of_faces(&self, count: usize) -> Vec<usize> {
        let mut numbers = vec![0; count];
        for (first, number) in &self.faces {
            numbers.get_mut(*first..).unwrap_or_default().fill(*number);
        }
        numbers
    }
}

/// A material as its library states it.
#[derive(Default)]
struct Stated {
    color: Option<Color>,
    /// The file of its texture, and the place of the statement.
    texture: Option<(PathBuf, String)>,
}

/// Reads libraries and pictures.
#[derive(Default)]
struct Reader {
    notes: Vec<String>,
    n_notes: usize,
    stated: HashMap<String, Stated>,
    /// Pictures by their file; `None` for one that cannot be used.
    pictures: HashMap<PathBuf, Option<Texture>>,
    /// Pixels of all textures.
    pixels: usize,
    /// The folder that files must be below, if any.
    confined_to: Option<PathBuf>,
}

impl Reader {
    fn note(&mut self, place: &str, what: &str) {
        self.n_notes += 1;
        if self.notes.len() < MAX_NOTES {
            self.notes.push(format!("{place}: {what}"));
        }
    }

    fn read(&mut self, surface: &Surface) -> Materials {
        if let Some(path) = &surface.texture {
            let covered = self.picture(path, &path.display().to_string()).cloned();
            if let Some(texture) = covered {
                return Materials::of(texture);
            }
        }
        if surface.materials.is_empty() {
            return Materials::default();
        }
        let folder = surface.mesh.parent().unwrap_or(Path::new(""));
        let place = |location: Location| {
            format!("{}:{}:{}", surface.mesh.display(), location.line, location.column)
        };
        let mut read = HashSet::new();
        for Mention { name, location } in &surface.libraries {
            // A name may have spaces, or be one of several.
            let whole = folder.join(portable(name));
            let paths = if whole.exists() {
                vec![whole]
            } else {
                name.split(' ').map(|name| folder.join(portable(name))).collect()
            };
            for path in paths {
                if read.insert(path.clone()) {
                    self.library(&path, &place(*location));
                }
            }
        }
        let mut materials = Materials::default();
        let mut numbers = HashMap::new();
        for (first, Mention { name, location }) in &surface.materials {
            let number = *numbers.entry(name).or_insert_with(|| match self.stated.remove(name) {
                Some(stated) => {
                    materials.materials.push(self.material(stated));
                    materials.materials.len() - 1
                }
                None => {
                    self.note(&place(*location), &format!("there is no material {name:?}"));
                    0
                }
            });
            materials.faces.push((*first, number));
        }
        materials
    }

    /// The content of a file; an error says why it is not used.
    fn content(&self, path: &Path) -> Result<Vec<u8>, String> {
        if self.confined_to.as_ref().is_some_and(|folder| !is_below(folder, path)) {
            return Err("it is not below the scene's folder".to_owned());
        }
        read_bounded(path).map_err(|error| error.problem.to_string())
    }

    /// Reads a library. The first material of a name counts.
    fn library(&mut self, path: &Path, mention: &str) {
        let file = path.display();
        let bytes = match self.content(path) {
            Ok(bytes) => bytes,
            Err(error) => {
                return self.note(mention, &format!("the material library {file}: {error}"));
            }
        };
        // Names and comments may be in any encoding.
        let text = String::from_utf8_lossy(&bytes);
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut current: Option<(String, Stated)> = None;
        let mut count = 0;
        for (line, statement) in text.lines().enumerate() {
            let statement = statement.split('#').next().unwrap_or_default();
            let words: Vec<&str> = statement.split_ascii_whitespace().collect();
            let [keyword @ ("newmtl" | "Kd" | "map_Kd"), arguments @ ..] = words.as_slice() else {
                continue;
            };
            let place = format!("{file}:{}", line + 1);
            if *keyword == "newmtl" {
                if let Some((name, stated)) =
                    current.replace((arguments.join(" "), Stated::default()))
                {
                    self.stated.entry(name).or_insert(stated);
                }
                count += 1;
                continue;
            }
            let Some((_, stated)) = &mut current else {
                self.note(&place, &format!("{keyword} stands before the first newmtl"));
                continue;
            };
            if *keyword == "Kd" {
                match color(arguments) {
                    Some(color) => stated.color = Some(color),
                    None => self.note(&place, "Kd needs three numbers from 0 to 1"),
                }
            } else {
                match picture_name(arguments) {
                    Some(name) => stated.texture = Some((folder.join(portable(&name)), place)),
                    None => self.note(&place, "map_Kd names no file"),
                }
            }
        }
        if let Some((name, stated)) = current {
            self.stated.entry(name).or_insert(stated);
        }
        if count == 0 {
            self.note(mention, &format!("the material library {file} has no material (newmtl)"));
        }
    }

    fn material(&mut self, Stated { color, texture }: Stated) -> Material {
        let plain = Material { color: color.unwrap_or(SURFACE), texture: None };
        let Some((path, place)) = texture else { return plain };
        let what = format!("{place}: {}", path.display());
        let Some(picture) = self.picture(&path, &what) else { return plain };
        let tint = color.unwrap_or(WHITE);
        let texture = picture.tinted([tint.r, tint.g, tint.b]);
        self.pixels += texture.count();
        if self.pixels > PIXELS {
            self.note(&what, "the pictures of the mesh have too many pixels together");
            return plain;
        }
        Material { texture: Some(Arc::new(texture)), ..plain }
    }

    /// The picture in a file.
    fn picture(&mut self, path: &Path, what: &str) -> Option<&Texture> {
        if !self.pictures.contains_key(path) {
            let read = self.content(path).and_then(|bytes| {
                Texture::from_png(&bytes).map_err(|error| format!("cannot be read as PNG: {error}"))
            });
            let picture = match read {
                Ok(picture) => Some(picture),
                Err(reason) => {
                    self.note(what, &reason);
                    None
                }
            };
            self.pictures.insert(path.to_path_buf(), picture);
        }
        self.pictures[path].as_ref()
    }
}

/// A path as this system writes it: libraries often have backslashes.
fn portable(name: &str) -> String {
    name.replace('\\', "/")
}

/// The colour of `Kd`.
fn color(words: &[&str]) -> Option<Color> {
    let number = |text: &&str| {
        text.parse::<f64>()
            .ok()
            .filter(|value| value.is_finite())
            .map(|value| value.clamp(0.0, 1.0))
    };
    match words {
        [grey] => number(grey).map(|value| Color { r: value, g: value, b: value }),
        [r, g, b] => Some(Color { r: number(r)?, g: number(g)?, b: number(b)? }),
        _ => None,
    }
}

/// The file of `map_Kd`, after its options.
fn picture_name(mut words: &[&str]) -> Option<String> {
    while let [option, rest @ ..] = words {
        let is_number = |word: &&&str| word.parse::<f64>().is_ok();
        let values = match *option {
            "-blendu" | "-blendv" | "-cc" | "-clamp" | "-texres" | "-imfchan" | "-bm"
            | "-boost" | "-type" => 1,
            "-mm" => 2,
            "-o" | "-s" | "-t" => rest.iter().take(3).take_while(is_number).count(),
            _ => break,
        };
        words = rest.get(values..)?;
    }
    (!words.is_empty()).then(|| words.join(" "))
}
