//! Frames of a motion, drawn as the scene says: radii, colours, edges, trails, background, viewport.
//!
//! `<viewport cx cy size>` shows the point (cx, cy) in the middle, and `size` metres from there to the upper edge. Without
//! a viewport, a frame shows the bounds it is given. Scenes in 3D are seen in perspective from the front, the right and
//! above; what is further away is paler and covered by what is nearer.
//!
//! The faces of a mesh are shaded, on both sides: the light L falls from above and behind the viewer, and a vertex with
//! the normal n has the share AMBIENT + (1 − AMBIENT) |n·L| of its colour (Lambert). Between vertices, the light is
//! interpolated (Gouraud). Faces cover the vertices and edges in them.
//!
//! On request, the triangles of elastic bodies and the outer faces of tetrahedra are filled, coloured by strain; elements cover
//! the vertices and edges in them.
//!
//! A trail (`<particlepath>`) fades over its duration. Memory is bounded: a trail keeps at most 2,000 points.

pub mod materials;
mod strain;

use std::collections::{HashSet, VecDeque};
use std::sync::Arc;

use picture::canvas::{Corner, Paint};
use picture::drawing::{Drawing, Shape};
use picture::texture::Texture;
use serde::{Deserialize, Serialize};

use crate::materials::Materials;
pub use crate::strain::StrainPalette;

use crate::strain::Strain;
use scene::{Color, Dimension, ParticlePath, Scene, SurfaceCorner};

/// Maximum number of points of a trail.
const TRAIL: u64 = 2_000;

/// Colour of particles that have none.
const PARTICLE: Color = Color { r: 0.65, g: 0.29, b: 0.0 };

/// Colour of edges that have none.
const EDGE: Color = Color { r: 0.0, g: 0.39, b: 0.39 };

/// Share of a surface's colour that needs no light.
const AMBIENT: f64 = 0.35;

/// Direction of the light from the surface: left, up, towards the viewer. Of length 1.
const LIGHT: [f64; 3] = [-0.36, 0.48, 0.8];

/// Colour of the background if the scene has none.
const BACKGROUND: Color = Color { r: 1.0, g: 1.0, b: 1.0 };

/// Share of a frame that the bounds fill.
const ROOM: f64 = 0.9;

/// The smallest bounds, as a multiple of the largest radius: a particle at rest does not fill the frame.
const LEAST: f64 = 10.0;

/// Angles of the camera in 3D, in radians: about the vertical axis, and above the horizon.
const TURN: [f64; 2] = [0.6, 0.35];

/// Distance of the camera from the middle, as a multiple of the size of the bounds.
const DISTANCE: f64 = 3.0;

/// Share of the background in the colour of the furthest point.
const FADE: f64 = 0.55;

/// The smallest box that holds a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    low: [f64; 3],
    high: [f64; 3],
}

impl Default for Bounds {
    fn default() -> Self {
        Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] }
    }
}

impl Bounds {
    /// Includes these positions of the particles of `scene`, with their radii.
    pub fn include(&mut self, scene: &Scene, positions: &[f64]) {
        let dimension = scene.dimension.count();
        for (at, particle) in positions.chunks_exact(dimension).zip(&scene.particles) {
            for axis in 0..3 {
                let value = at.get(axis).copied().unwrap_or(0.0);
                self.low[axis] = self.low[axis].min(value - particle.radius);
                self.high[axis] = self.high[axis].max(value + particle.radius);
            }
        }
    }

    /// These bounds, with `factor` times their largest side more on every side.
    pub fn enlarged(self, factor: f64) -> Self {
        let sides = self.low.iter().zip(&self.high).map(|(low, high)| high - low);
        let more = factor * sides.fold(0.0, f64::max);
        Self { low: self.low.map(|low| low - more), high: self.high.map(|high| high + more) }
    }

    /// Whether these bounds hold others.
    pub fn contains(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.low[axis] <= other.low[axis] && other.high[axis] <= self.high[axis])
    }
}

/// Data for drawing a scene besides positions, for the pages' own drawing code (`stage.js`). Lists of equal
/// values have one element.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct Palette {
    dimension: usize,
    /// Particles.
    count: usize,
    radii: Vec<f64>,
    /// Colours are six hexadecimal digits.
    colors: Vec<String>,
    edges: Vec<[usize; 2]>,
    edge_radii: Vec<f64>,
    edge_colors: Vec<String>,
    /// Particles of each face; a scene without faces has no such key.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    faces: Vec<Vec<usize>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    face_colors: Vec<String>,
    trails: Vec<PaletteTrail>,
    background: String,
    /// The point in the middle.
    center: [f64; 3],
    /// Size of the bounds along each axis.
    extents: Vec<f64>,
    /// Metres from the middle to the upper edge, where the scene has a viewport.
    viewport: Option<f64>,
}

/// A trail of a palette.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PaletteTrail {
    particle: usize,
    duration: f64,
    color: String,
}

impl Palette {
    /// The palette of a scene whose faces are always shown, without the edges that they cover.
    pub fn without_covered_edges(scene: &Scene, bounds: Bounds, materials: &Materials) -> Self {
        let is_covered = covered_edges(scene);
        let mut palette = Self::of(scene, bounds, materials);
        keep(&mut palette.edges, &is_covered);
        // Lists of one element are for all edges.
        keep(&mut palette.edge_radii, &is_covered);
        keep(&mut palette.edge_colors, &is_covered);
        palette
    }

    /// Number of coordinates of a state, if all numbers of the palette fit together: lists have one element or one for
    /// each, particles are there, and colours are colours. `None` otherwise.
    pub fn n_coordinates(&self) -> Option<usize> {
        let has_length = |length: usize, count: usize| length == count || length == 1;
        let is_color =
            |color: &String| color.len() == 6 && color.bytes().all(|byte| byte.is_ascii_hexdigit());
        let trails = self.trails.iter().map(|trail| &trail.color);
        let lists = [&self.colors, &self.edge_colors, &self.face_colors];
        let mut colors = lists.into_iter().flatten().chain(trails).chain([&self.background]);
        let trails = self.trails.iter().map(|trail| &trail.particle);
        let mut particles =
            self.edges.iter().flatten().chain(self.faces.iter().flatten()).chain(trails);
        let fits = [2, 3].contains(&self.dimension)
            && self.extents.len() == self.dimension
            && has_length(self.radii.len(), self.count)
            && has_length(self.colors.len(), self.count)
            && has_length(self.edge_radii.len(), self.edges.len())
            && has_length(self.edge_colors.len(), self.edges.len())
            && has_length(self.face_colors.len(), self.faces.len())
            && colors.all(is_color)
            && particles.all(|particle| *particle < self.count);
        self.count.checked_mul(self.dimension).filter(|_| fits)
    }

    /// The palette of a scene. `bounds` count where the scene has no viewport. A face has one colour: that of its material,
    /// or of the texture at its middle.
    pub fn of(scene: &Scene, bounds: Bounds, materials: &Materials) -> Self {
        let dimension = scene.dimension.count();
        let view = View::of(scene, bounds);
        let hexadecimal = |color: Color| {
            let [red, green, blue] = rgb(color);
            format!("{red:02x}{green:02x}{blue:02x}")
        };
        let trail = |path: &ParticlePath| PaletteTrail {
            particle: path.particle,
            duration: path.duration,
            color: hexadecimal(path.color),
        };
        let (particles, edges) = colors(scene);
        let faces = &scene.rendering.surface.faces;
        let corners =
            |face: &Vec<SurfaceCorner>| face.iter().map(|corner| corner.particle).collect();
        let face_colors = faces.iter().zip(materials.of_faces(faces.len()));
        let face_colors = face_colors.map(|(face, number)| materials.get(number).middle(face));
        Self {
            dimension,
            count: scene.particles.len(),
            radii: once(scene.particles.iter().map(|particle| particle.radius).collect()),
            colors: once(particles.into_iter().map(hexadecimal).collect()),
            edges: scene.edges.iter().map(|edge| edge.particles).collect(),
            edge_radii: once(scene.edges.iter().map(|edge| edge.radius).collect()),
            edge_colors: once(edges.into_iter().map(hexadecimal).collect()),
            faces: faces.iter().map(corners).collect(),
            face_colors: once(face_colors.map(hexadecimal).collect()),
            trails: scene.rendering.particle_paths.iter().map(trail).collect(),
            background: hexadecimal(scene.rendering.background.unwrap_or(BACKGROUND)),
            center: view.center,
            extents: view.extents[..dimension].to_vec(),
            viewport: scene.rendering.viewport.map(|viewport| viewport.size),
        }
    }
}

/// Whether the two particles of each edge are corners of one face.
fn covered_edges(scene: &Scene) -> Vec<bool> {
    let surface = Surface::of(scene);
    scene.edges.iter().map(|edge| surface.covers_edge(edge.particles)).collect()
}

/// The list; its first element where all are equal.
fn once<T: PartialEq>(mut list: Vec<T>) -> Vec<T> {
    if list.windows(2).all(|pair| pair[0] == pair[1]) {
        list.truncate(1);
    }
    list
}

/// Removes what is covered from a list of one element an edge; a list of another length stays.
fn keep<T>(list: &mut Vec<T>, is_covered: &[bool]) {
    if list.len() > 1 || is_covered.len() == 1 {
        let mut covered = is_covered.iter();
        list.retain(|_| !covered.next().copied().unwrap_or_default());
    }
}

/// The colour of each particle, and of each edge.
fn colors(scene: &Scene) -> (Vec<Color>, Vec<Color>) {
    let mut particles = vec![PARTICLE; scene.particles.len()];
    for (particle, color) in &scene.rendering.particle_colors {
        particles[*particle] = *color;
    }
    let mut edges = vec![EDGE; scene.edges.len()];
    for (edge, color) in &scene.rendering.edge_colors {
        edges[*edge] = *color;
    }
    (particles, edges)
}

/// Draws the frames of a scene.
pub struct Painter<'a> {
    scene: &'a Scene,
    size: [u32; 2],
    camera: Camera,
    particles: Vec<Color>,
    edges: Vec<Color>,
    background: Color,
    trails: Vec<Trail>,
    surface: Surface,
    strain: Option<Strain>,
}

/// The faces of a scene.
struct Surface {
    triangles: Vec<[SurfaceCorner; 3]>,
    /// The number of the face of each triangle.
    faces: Vec<usize>,
    n_faces: usize,
    /// Particles that are a corner of a face.
    particles: HashSet<usize>,
    /// Pairs of particles that are corners of one face, the smaller number first.
    pairs: HashSet<[usize; 2]>,
    /// Paint of each triangle.
    textures: Vec<Arc<Texture>>,
}

impl Surface {
    fn of(scene: &Scene) -> Self {
        let (mut triangles, mut pairs) = (Vec::new(), HashSet::new());
        let mut numbers = Vec::new();
        let faces = &scene.rendering.surface.faces;
        for (face_number, face) in faces.iter().enumerate() {
            for (number, first) in face.iter().enumerate() {
                pairs.extend(face[..number].iter().map(|second| {
                    let [a, b] = [first.particle, second.particle];
                    [a.min(b), a.max(b)]
                }));
            }
            let [first, rest @ ..] = face.as_slice() else { continue };
            triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
            numbers.resize(triangles.len(), face_number);
        }
        let particles = faces.iter().flatten().map(|corner| corner.particle).collect();
        let mut surface = Self {
            triangles,
            faces: numbers,
            n_faces: faces.len(),
            particles,
            pairs,
            textures: Vec::new(),
        };
        surface.cover(&Materials::default());
        surface
    }

    /// Covers each triangle with the texture of its face's material, or with its colour if it has no texture coordinates.
    fn cover(&mut self, materials: &Materials) {
        let of_faces = materials.of_faces(self.n_faces);
        let plain = |number| Arc::new(Texture::plain(rgb(materials.get(number).color)));
        let plain: Vec<Arc<Texture>> = (0..materials.count()).map(plain).collect();
        let texture = |(corners, face): (&[SurfaceCorner; 3], &usize)| {
            let number = of_faces[*face];
            let has_places = corners.iter().all(|corner| corner.texture.is_some());
            let texture = materials.get(number).texture.as_ref().filter(|_| has_places);
            Arc::clone(texture.unwrap_or(&plain[number]))
        };
        self.textures = self.triangles.iter().zip(&self.faces).map(texture).collect();
    }

    fn covers_edge(&self, [a, b]: [usize; 2]) -> bool {
        self.pairs.contains(&[a.min(b), a.max(b)])
    }
}

/// A trail: times and points, the oldest first.
struct Trail {
    points: VecDeque<(f64, [f64; 3])>,
    /// Steps between two points.
    stride: u64,
}

/// A point on the screen, its factor of perspective, and its depth from 0, far, to 1, near.
#[derive(Clone, Copy)]
struct Projected {
    at: [f32; 2],
    scale: f64,
    depth: f64,
}

impl<'a> Painter<'a> {
    /// A painter of frames of this size in pixels. `bounds` count where the scene has no viewport.
    pub fn new(scene: &'a Scene, size: [u32; 2], bounds: Bounds) -> Self {
        let rendering = &scene.rendering;
        let (particles, edges) = colors(scene);
        let trail = |duration: f64| Trail {
            points: VecDeque::new(),
            stride: ((duration / scene.time_step) as u64).div_ceil(TRAIL).max(1),
        };
        Self {
            scene,
            size,
            camera: Camera::of(scene, size, bounds),
            particles,
            edges,
            background: rendering.background.unwrap_or(BACKGROUND),
            trails: rendering.particle_paths.iter().map(|path| trail(path.duration)).collect(),
            surface: Surface::of(scene),
            strain: None,
        }
    }

    /// Covers the surface with its materials.
    pub fn set_materials(&mut self, materials: &Materials) {
        self.surface.cover(materials);
    }

    /// Fills the triangles of elastic bodies, and the outer faces of tetrahedra, coloured by strain: the last colour is that of
    /// the strain `full`.
    pub fn set_strain(&mut self, full: f64) {
        let strain = Strain::of(self.scene, full);
        for corners in strain.elements.iter().map(|element| &element.corners) {
            self.surface.particles.extend(corners);
            let pairs = corners.iter().flat_map(|a| corners.iter().map(move |b| [*a, *b]));
            self.surface.pairs.extend(pairs.filter(|[a, b]| a < b));
        }
        self.strain = Some(strain);
    }

    /// Adds a state to the trails. To be called for every state, in order.
    pub fn follow(&mut self, step: u64, time: f64, positions: &[f64]) {
        let dimension = self.scene.dimension.count();
        for (trail, path) in self.trails.iter_mut().zip(&self.scene.rendering.particle_paths) {
            if step.is_multiple_of(trail.stride) {
                trail.points.push_back((time, point(positions, path.particle, dimension)));
            }
            while trail.points.front().is_some_and(|(then, _)| time - then > path.duration) {
                trail.points.pop_front();
            }
        }
    }

    /// The frame of a state.
    pub fn draw(&self, time: f64, positions: &[f64]) -> Drawing {
        let dimension = self.scene.dimension.count();
        let n_particles = self.scene.particles.len();
        let projected: Vec<Projected> = (0..n_particles)
            .map(|particle| self.camera.project(point(positions, particle, dimension)))
            .collect();
        // Depth and shape: in two dimensions trails lie below edges, and edges below particles.
        let mut shapes: Vec<(f64, Shape)> = Vec::new();
        self.draw_trails(time, positions, &mut shapes);
        self.draw_surface(positions, &projected, &mut shapes);
        self.draw_strain(positions, &projected, &mut shapes);
        for (edge, color) in self.scene.edges.iter().zip(&self.edges) {
            if self.surface.covers_edge(edge.particles) {
                continue;
            }
            let ends = edge.particles.map(|particle| projected[particle]);
            shapes.push(self.line(ends, edge.radius, *color));
        }
        let particles = self.scene.particles.iter().zip(&self.particles).zip(&projected);
        for (number, ((particle, color), at)) in particles.enumerate() {
            if self.surface.particles.contains(&number) {
                continue;
            }
            let radius = (particle.radius * at.scale).max(0.75) as f32;
            let paint = Paint { rgb: self.faded(*color, at.depth), opacity: 1.0 };
            shapes.push((at.depth, Shape::Disc { at: at.at, radius, paint }));
        }
        if self.scene.dimension == Dimension::Three {
            // Stable: equal depths keep their order.
            shapes.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        }
        Drawing {
            size: self.size,
            background: rgb(self.background),
            shapes: shapes.into_iter().map(|(_, shape)| shape).collect(),
        }
    }

    fn draw_surface(
        &self,
        positions: &[f64],
        projected: &[Projected],
        shapes: &mut Vec<(f64, Shape)>,
    ) {
        let surface = &self.surface;
        if surface.triangles.is_empty() {
            return;
        }
        let lights = self.lights(positions);
        for (corners, texture) in surface.triangles.iter().zip(&surface.textures) {
            let corners = corners.map(|SurfaceCorner { particle, texture }| {
                (projected[particle], texture.unwrap_or_default(), lights[particle])
            });
            shapes.push(self.triangle(corners, Arc::clone(texture)));
        }
    }

    fn draw_strain(
        &self,
        positions: &[f64],
        projected: &[Projected],
        shapes: &mut Vec<(f64, Shape)>,
    ) {
        let dimension = self.scene.dimension.count();
        if let Some(strain) = &self.strain {
            for element in &strain.elements {
                if element.faces.is_empty() {
                    continue;
                }
                let texture = Arc::new(Texture::plain(strain.color(element, positions, dimension)));
                for face in &element.faces {
                    let corners = face.map(|corner| (projected[corner], [0.0; 2], 1.0));
                    shapes.push(self.triangle(corners, Arc::clone(&texture)));
                }
            }
        }
    }

    /// A triangle, with the place, the texture coordinates and the light of each corner.
    fn triangle(
        &self,
        corners: [(Projected, [f64; 2], f64); 3],
        texture: Arc<Texture>,
    ) -> (f64, Shape) {
        let depth = corners.iter().map(|(at, ..)| at.depth).sum::<f64>() / 3.0;
        let corners = corners.map(|(Projected { at, scale, depth }, texture, light)| {
            let fade = FADE * (1.0 - depth);
            let add = rgb(self.background).map(|value| fade * f64::from(value));
            Corner { at, scale, texture, gain: light * (1.0 - fade), add }
        });
        (depth, Shape::Triangle { corners, texture })
    }

    /// The light on each particle of the surface, from 0 to 1.
    fn lights(&self, positions: &[f64]) -> Vec<f64> {
        let dimension = self.scene.dimension.count();
        let mut normals = vec![[0.0; 3]; self.scene.particles.len()];
        for corners in &self.surface.triangles {
            let [a, b, c] = corners.map(|corner| point(positions, corner.particle, dimension));
            let [u, v] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
            // As long as twice the area: larger triangles count more.
            let normal = [0, 1, 2].map(|axis| {
                let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
                u[next] * v[last] - u[last] * v[next]
            });
            for corner in corners {
                for (sum, value) in normals[corner.particle].iter_mut().zip(normal) {
                    *sum += value;
                }
            }
        }
        let light = |normal: [f64; 3]| {
            let [x, y, z] = self.camera.turned(normal);
            let length = (x * x + y * y + z * z).sqrt();
            let cosine = (x * LIGHT[0] + y * LIGHT[1] + z * LIGHT[2]) / length;
            // Without a normal there is no light.
            AMBIENT + (1.0 - AMBIENT) * cosine.abs().max(0.0)
        };
        normals.into_iter().map(light).collect()
    }

    fn draw_trails(&self, time: f64, positions: &[f64], shapes: &mut Vec<(f64, Shape)>) {
        let dimension = self.scene.dimension.count();
        for (trail, path) in self.trails.iter().zip(&self.scene.rendering.particle_paths) {
            let radius = 0.3 * self.scene.particles[path.particle].radius;
            let now = (time, point(positions, path.particle, dimension));
            let ends = trail.points.iter().skip(1).chain([&now]);
            for ((then, from), (_, to)) in trail.points.iter().zip(ends) {
                // Mixed, not transparent: the pieces of a trail overlap.
                let age = ((time - then) / path.duration).clamp(0.0, 1.0);
                let ends = [*from, *to].map(|at| self.camera.project(at));
                shapes.push(self.line(ends, radius, mixed(path.color, self.background, age)));
            }
        }
    }

    fn line(&self, ends: [Projected; 2], radius: f64, color: Color) -> (f64, Shape) {
        let middle = |of: fn(&Projected) -> f64| 0.5 * (of(&ends[0]) + of(&ends[1]));
        let depth = middle(|end| end.depth);
        let width = (2.0 * radius * middle(|end| end.scale)).max(1.0) as f32;
        let paint = Paint { rgb: self.faded(color, depth), opacity: 1.0 };
        (depth, Shape::Line { ends: ends.map(|end| end.at), width, paint })
    }

    /// A colour, mixed with the background by its depth.
    fn faded(&self, color: Color, depth: f64) -> [u8; 3] {
        rgb(mixed(color, self.background, FADE * (1.0 - depth)))
    }
}

/// A colour with this share of another one.
fn mixed(color: Color, other: Color, share: f64) -> Color {
    let mix = |a: f64, b: f64| a * (1.0 - share) + b * share;
    Color { r: mix(color.r, other.r), g: mix(color.g, other.g), b: mix(color.b, other.b) }
}

/// The position of a particle; z is 0 in two dimensions.
fn point(positions: &[f64], particle: usize, dimension: usize) -> [f64; 3] {
    let mut point = [0.0; 3];
    point[..dimension].copy_from_slice(&positions[particle * dimension..][..dimension]);
    point
}

fn rgb(Color { r, g, b }: Color) -> [u8; 3] {
    [r, g, b].map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
}

/// The part of the world that a frame shows.
struct View {
    /// The point in the middle.
    center: [f64; 3],
    /// Size of the bounds along each axis.
    extents: [f64; 3],
}

impl View {
    fn of(scene: &Scene, Bounds { low, high }: Bounds) -> Self {
        let radius = scene.particles.iter().map(|particle| particle.radius).fold(0.0, f64::max);
        let least = (LEAST * radius).max(f64::MIN_POSITIVE);
        let mut center = [0.0; 3];
        let mut extents = [1.0; 3];
        for axis in 0..3 {
            // A scene without particles has no bounds.
            if low[axis] <= high[axis] {
                center[axis] = 0.5 * (low[axis] + high[axis]);
                extents[axis] = (high[axis] - low[axis]).max(least);
            }
        }
        if let Some(viewport) = scene.rendering.viewport {
            center[..2].copy_from_slice(&viewport.center);
        }
        Self { center, extents }
    }
}

/// Where the scene is seen from.
struct Camera {
    center: [f64; 3],
    /// Pixels a metre at the centre.
    scale: f64,
    /// The middle of the frame.
    middle: [f64; 2],
    /// Size of the bounds in 3D; `None` in two dimensions.
    extent: Option<f64>,
}

impl Camera {
    fn of(scene: &Scene, size: [u32; 2], bounds: Bounds) -> Self {
        let [width, height] = size.map(f64::from);
        let View { center, extents } = View::of(scene, bounds);
        let across = extents.iter().map(|extent| extent * extent).sum::<f64>().sqrt();
        let extent = (scene.dimension == Dimension::Three).then_some(across);
        let mut scale = match extent {
            Some(across) => ROOM * width.min(height) / across,
            None => ROOM * (width / extents[0]).min(height / extents[1]),
        };
        if let Some(viewport) = scene.rendering.viewport {
            scale = 0.5 * height / viewport.size;
        }
        Self { center, scale, middle: [0.5 * width, 0.5 * height], extent }
    }

    /// A vector in the coordinates of the camera: right, up, towards the viewer.
    fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [(sy, cy), (sp, cp)] = TURN.map(f64::sin_cos);
        let (x, z) = (cy * x + sy * z, cy * z - sy * x);
        let (y, z) = (cp * y - sp * z, cp * z + sp * y);
        [x, y, z]
    }

    fn project(&self, point: [f64; 3]) -> Projected {
        let mut at = [0, 1, 2].map(|axis| point[axis] - self.center[axis]);
        let (mut perspective, mut depth) = (1.0, 1.0);
        if let Some(extent) = self.extent {
            at = self.turned(at);
            let [_, _, z] = at;
            perspective = DISTANCE / (DISTANCE - z / extent).max(0.1 * DISTANCE);
            depth = (z / extent + 0.5).clamp(0.0, 1.0);
        }
        let scale = self.scale * perspective;
        let [x, y] = [self.middle[0] + at[0] * scale, self.middle[1] - at[1] * scale];
        Projected { at: [x as f32, y as f32], scale, depth }
    }
}

#[cfg(test)]
mod tests {
    use picture::canvas::Canvas;

    use super::*;
    use scene::{ParseOptions, xml};
    use simulator::vocabulary;

    fn scene(text: &str) -> Scene {
        let text = format!(
            "<scene><duration time=\"1\"/><integrator type=\"explicit-euler\" dt=\"0.1\"/>{text}</scene>"
        );
        xml::parse(&text, "scene.xml", &vocabulary(), &ParseOptions::default()).unwrap().scene
    }

    #[test]
    fn a_frame_shows_what_the_scene_asks_for() {
        let scene = scene(
            r#"<viewport cx="1" cy="2" size="4"/> <backgroundcolor r="0" g="0" b="1"/>
            <particle m="1" px="1" py="2" vx="0" vy="0" fixed="0" radius="0.5"/>
            <particle m="1" px="3" py="4" vx="0" vy="0" fixed="0" radius="0.25"/>
            <edge i="0" j="1" radius="0.1"/> <edgecolor i="0" r="0" g="1" b="0"/>
            <particlecolor i="1" r="1" g="0" b="0"/>"#,
        );
        let painter = Painter::new(&scene, [160, 80], Bounds::default());
        let drawing = painter.draw(0.0, &scene.positions());
        assert_eq!(drawing.background, [0, 0, 255]);
        // 10 pixels a metre: the viewport is 8 metres high.
        let paint = |rgb| Paint { rgb, opacity: 1.0 };
        let [edge, first, second] = drawing.shapes.as_slice() else { panic!("{drawing:?}") };
        let ends = [[80.0, 40.0], [100.0, 20.0]];
        assert_eq!(*edge, Shape::Line { ends, width: 2.0, paint: paint([0, 255, 0]) });
        assert_eq!(*first, Shape::Disc { at: ends[0], radius: 5.0, paint: paint([166, 74, 0]) });
        assert_eq!(*second, Shape::Disc { at: ends[1], radius: 2.5, paint: paint([255, 0, 0]) });
    }

    #[test]
    fn a_trail_fades_over_its_duration() {
        let scene = scene(
            r#"<particle m="1" px="0" py="0" vx="1" vy="0" fixed="0"/>
            <particlepath i="0" duration="0.4" r="1" g="0" b="0"/>"#,
        );
        let mut painter = Painter::new(&scene, [100, 100], Bounds::default());
        for step in 0..=8 {
            let time = 0.1 * step as f64;
            painter.follow(step, time, &[time, 0.0]);
        }
        let drawing = painter.draw(0.8, &[0.8, 0.0]);
        // Red over white: what is left of white fades the trail.
        let shares: Vec<f64> = drawing
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Line { paint, .. } => Some(1.0 - f64::from(paint.rgb[1]) / 255.0),
                _ => None,
            })
            .collect();
        assert_eq!(shares.last(), Some(&1.0));
        assert!(shares.is_sorted() && shares.len() <= 6, "{shares:?}");
        assert!(shares[0] <= 0.3, "{shares:?}");
    }

    #[test]
    fn without_a_viewport_a_frame_shows_the_bounds() {
        let scene =
            scene(r#"<particle m="1" px="0" py="0" vx="1" vy="0" fixed="0" radius="0.5"/>"#);
        let mut bounds = Bounds::default();
        bounds.include(&scene, &[0.0, 0.0]);
        bounds.include(&scene, &[9.0, 0.0]);
        let painter = Painter::new(&scene, [100, 100], bounds);
        let at = |x: f64| match painter.draw(0.0, &[x, 0.0]).shapes[0] {
            Shape::Disc { at, radius, .. } => (at, radius),
            _ => panic!("a disc"),
        };
        assert_eq!(at(0.0), ([9.5, 50.0], 4.5));
        assert_eq!(at(9.0).0, [90.5, 50.0]);
    }

    #[test]
    fn nearer_particles_are_larger_and_cover_farther_ones() {
        let scene = scene(
            r#"<particle m="1" px="0" py="0" pz="1" vx="0" vy="0" vz="0" fixed="0"/>
            <particle m="1" px="0" py="0" pz="-1" vx="0" vy="0" vz="0" fixed="0"/>"#,
        );
        let mut bounds = Bounds::default();
        bounds.include(&scene, &scene.positions());
        let drawing = Painter::new(&scene, [100, 100], bounds).draw(0.0, &scene.positions());
        let radii: Vec<f32> = drawing
            .shapes
            .iter()
            .map(|shape| match shape {
                Shape::Disc { radius, .. } => *radius,
                _ => panic!("no edge"),
            })
            .collect();
        assert!(radii[0] < radii[1], "{radii:?}");
    }

    /// A square of two triangles, one of them stretched, with a line from its corner.
    #[test]
    fn triangles_of_elastic_bodies_are_filled_only_on_request() {
        let scene = scene(
            r#"<particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/>
            <particle m="1" px="1" py="0" vx="0" vy="0" fixed="0"/>
            <particle m="1" px="1" py="1" vx="0" vy="0" fixed="0"/>
            <particle m="1" px="0" py="1" vx="0" vy="0" fixed="0"/>
            <particle m="1" px="2" py="1" vx="0" vy="0" fixed="0"/>
            <edge i="0" j="1"/> <edge i="2" j="0"/> <edge i="4" j="2"/>
            <elasticbodycstforce i1="0" i2="1" i3="2" youngsmodulus="1" poissonratio="0.3"/>
            <neohookeantriangle i1="0" i2="2" i3="3" youngsmodulus="1" poissonratio="0.3"
              xb1x="0" xb1y="0" xb2x="0.8" xb2y="1" xb3x="0" xb3y="1"/>"#,
        );
        let mut bounds = Bounds::default();
        bounds.include(&scene, &scene.positions());
        let mut painter = Painter::new(&scene, [100, 100], bounds);
        let plain = painter.draw(0.0, &scene.positions());
        assert!(plain.shapes.iter().all(|shape| !matches!(shape, Shape::Triangle { .. })));
        assert_eq!(plain.shapes.len(), 8);
        painter.set_strain(0.25);
        let drawing = painter.draw(0.0, &scene.positions());
        let [first, second, Shape::Line { .. }, Shape::Disc { .. }] = drawing.shapes.as_slice()
        else {
            panic!("{drawing:?}")
        };
        let color = |shape: &Shape| match shape {
            Shape::Triangle { texture, .. } => texture.color([0.0; 2]),
            _ => panic!("{shape:?}"),
        };
        // At rest, and at a stretch of 1/0.8.
        assert_eq!([color(first), color(second)], [[68.0, 1.0, 84.0], [253.0, 231.0, 37.0]]);
    }

    /// Two tetrahedra on a common face.
    #[test]
    fn outer_faces_of_tetrahedra_are_filled() {
        let scene = scene(
            r#"<particle m="1" px="0" py="0" pz="0" vx="0" vy="0" vz="0" fixed="0"/>
            <particle m="1" px="1" py="0" pz="0" vx="0" vy="0" vz="0" fixed="0"/>
            <particle m="1" px="0" py="1" pz="0" vx="0" vy="0" vz="0" fixed="0"/>
            <particle m="1" px="0" py="0" pz="1" vx="0" vy="0" vz="0" fixed="0"/>
            <particle m="1" px="1" py="1" pz="1" vx="0" vy="0" vz="0" fixed="0"/>
            <edge i="0" j="1"/> <edge i="1" j="2"/>
            <stvktetrahedron i1="0" i2="1" i3="2" i4="3" youngsmodulus="1" poissonratio="0.3"/>
            <neohookeantetrahedron i1="4" i2="2" i3="1" i4="3" youngsmodulus="1" poissonratio="0.3"
              xb1x="0.8" xb1y="0.9"/>"#,
        );
        let mut bounds = Bounds::default();
        bounds.include(&scene, &scene.positions());
        let mut painter = Painter::new(&scene, [100, 100], bounds);
        painter.set_strain(0.25);
        let drawing = painter.draw(0.0, &scene.positions());
        assert_eq!(drawing.shapes.len(), 6);
        let is_face = |shape: &Shape| matches!(shape, Shape::Triangle { .. });
        assert!(drawing.shapes.iter().all(is_face), "{drawing:?}");
    }

    /// A square in front of the camera, of two triangles, with a line from its corner; the left half of its texture is red,
    /// the right half blue.
    #[test]
    fn faces_are_shaded_with_their_texture_and_cover_their_edges() {
        let scene = scene(
            r#"<particle m="1" px="0" py="0" pz="0" vx="0" vy="0" vz="0" fixed="0" radius="0.01"/>
            <particle m="1" px="1" py="0" pz="0" vx="0" vy="0" vz="0" fixed="0" radius="0.01"/>
            <particle m="1" px="1" py="1" pz="0" vx="0" vy="0" vz="0" fixed="0" radius="0.01"/>
            <particle m="1" px="0" py="1" pz="0" vx="0" vy="0" vz="0" fixed="0" radius="0.01"/>
            <particle m="1" px="2" py="1" pz="0" vx="0" vy="0" vz="0" fixed="0" radius="0.01"/>
            <edge i="0" j="1"/> <edge i="2" j="0"/> <edge i="4" j="2"/>"#,
        );
        let corner = |(particle, texture): (usize, [f64; 2])| SurfaceCorner {
            particle,
            texture: Some(texture),
        };
        let places = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let face = places.into_iter().enumerate().map(corner).collect();
        let mut meshed = scene.clone();
        meshed.rendering.surface.faces = vec![face];
        let mut bounds = Bounds::default();
        bounds.include(&scene, &scene.positions());
        let mut painter = Painter::new(&meshed, [200, 200], bounds);
        let mut picture = Canvas::new(2, 1, [255, 0, 0]);
        picture.paste(&Canvas::new(1, 1, [0, 0, 255]), [1, 0]);
        let colors = |painter: &Painter<'_>| {
            let canvas = painter.draw(0.0, &scene.positions()).canvas();
            [[0.25, 0.6], [0.75, 0.4]].map(|[x, y]| {
                let [x, y] = painter.camera.project([x, y, 0.0]).at.map(|value| value as usize);
                let at = 3 * (200 * y + x);
                [0, 1, 2].map(|channel| canvas.pixels()[at + channel])
            })
        };
        // The palette of pages has the faces, with their colour.
        let palette = |scene: &Scene| {
            serde_json::to_value(Palette::of(scene, bounds, &Materials::default())).unwrap()
        };
        assert_eq!(palette(&meshed)["faces"], serde_json::json!([[0, 1, 2, 3]]));
        assert_eq!(palette(&meshed)["faceColors"], serde_json::json!(["e08f42"]));
        assert_eq!(palette(&scene).get("faces"), None);
        let visible = Palette::without_covered_edges(&meshed, bounds, &Materials::default());
        let visible = serde_json::to_value(visible).unwrap();
        assert_eq!(visible["edges"], serde_json::json!([[4, 2]]));
        assert_eq!(visible["edgeColors"], serde_json::json!(["006363"]));
        // Without a texture: the colour of surfaces, darker where the light falls at an angle, paler by its distance.
        let [left, right] = colors(&painter);
        for [red, green, blue] in [left, right] {
            assert!(red < 240 && red > green && green > blue, "{left:?} {right:?}");
        }
        painter.set_materials(&Materials::of(Texture::from_png(&picture.png().unwrap()).unwrap()));
        let [left, right] = colors(&painter);
        assert!(left[0] > 150 && left[2] < 100, "{left:?}");
        assert!(right[2] > 150 && right[0] < 100, "{right:?}");
        // The face does not cover an edge and the particle at its end.
        let drawing = painter.draw(0.0, &scene.positions());
        let of = |is: fn(&Shape) -> bool| drawing.shapes.iter().filter(|shape| is(shape)).count();
        let discs = of(|shape| matches!(shape, Shape::Disc { .. }));
        let lines = of(|shape| matches!(shape, Shape::Line { .. }));
        assert_eq!((discs, lines, drawing.shapes.len()), (1, 1, 4));
    }
}
