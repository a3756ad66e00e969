//! Frames of the course's own scenes, where they are at hand: pixels against the course's traces and what the scenes ask
//! for.

use needs::needs;
use std::fs;
use std::path::{Path, PathBuf};

use picture::texture::Texture;
use scene::{Color, ParseOptions, Scene, find_scene_files, load};
use simulator::vocabulary;
use tempfile::TempDir;

use crate::shared::root;
use crate::support::{simulate, stderr};

const SIZE: [f64; 2] = [400.0, 300.0];

/// A frame, and where it shows a point.
struct Frame {
    picture: Texture,
    center: [f64; 2],
    scale: f64,
}

impl Frame {
    fn place(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|axis| (point[axis] - self.center[axis]) * self.scale);
        [0.5 * SIZE[0] + x, 0.5 * SIZE[1] - y]
    }

    /// The colour of the pixel that holds a place.
    fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [x, y] = [x.floor() + 0.5, y.floor() + 0.5];
        self.picture.color([x / SIZE[0], 1.0 - y / SIZE[1]]).map(f64::round)
    }
}

fn rgb(Color { r, g, b }: Color) -> [f64; 3] {
    [r, g, b].map(|value| (value * 255.0).round())
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// The positions of each state of a trace of the course.
fn positions(path: &Path, n_particles: usize) -> Vec<Vec<[f64; 2]>> {
    let bytes = fs::read(path).unwrap();
    let numbers: Vec<f64> =
        bytes.chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect();
    let state = |record: &[f64]| {
        record[..2 * n_particles].chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
    };
    numbers.chunks_exact(4 * n_particles).map(state).collect()
}

/// Draws a scene at its start, middle and end, and compares pixels.
fn check(path: &Path, trace: &Path) {
    let name = path.display();
    let scene = load(path, &vocabulary(), &ParseOptions::default()).unwrap().scene;
    let states = positions(trace, scene.particles.len());
    let folder = TempDir::new().unwrap();
    let fps = (2.0 / scene.duration).to_string();
    let file = path.to_str().unwrap();
    let run =
        simulate(folder.path(), &[file, "--frames", "frames", "--fps", &fps, "--size", "400x300"]);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""), "{name}");
    let radius = |particle: usize| scene.particles[particle].radius;
    let largest = (0..scene.particles.len()).map(radius).fold(0.0, f64::max);
    let [(left, right), (bottom, top)] = [0, 1].map(|axis| {
        let all = || states.iter().flat_map(|state| state.iter().enumerate());
        let low = all().map(|(particle, at)| at[axis] - radius(particle)).fold(f64::MAX, f64::min);
        let high = all().map(|(particle, at)| at[axis] + radius(particle)).fold(f64::MIN, f64::max);
        (low, high)
    });
    let room = |low: f64, high: f64| (high - low).max(10.0 * largest);
    let scale = 0.9 * (SIZE[0] / room(left, right)).min(SIZE[1] / room(bottom, top));
    for (number, step) in [0, (states.len() - 1) / 2, states.len() - 1].into_iter().enumerate() {
        let bytes = fs::read(folder.path().join(format!("frames/frame{number:05}.png"))).unwrap();
        let picture = Texture::from_png(&bytes).unwrap();
        let center = [0.5 * (left + right), 0.5 * (bottom + top)];
        compare(
            &scene,
            &Frame { picture, center, scale },
            &states[..=step],
            &format!("{name} {step}"),
        );
    }
}

/// Compares a frame with the scene and the states up to it.
fn compare(scene: &Scene, frame: &Frame, states: &[Vec<[f64; 2]>], name: &str) {
    let rendering = &scene.rendering;
    let now = states.last().unwrap();
    let background = rendering.background.map_or([255.0; 3], rgb);
    assert_eq!(frame.pixel([2.0, 2.0]), background, "{name}: background");
    for (particle, color) in &rendering.particle_colors {
        let [x, y] = frame.place(now[*particle]);
        assert_eq!(frame.pixel([x, y]), rgb(*color), "{name}: particle {particle}");
        let radius = scene.particles[*particle].radius * frame.scale;
        let around = |radius: f64| {
            let turns = (0..8).map(|eighth| f64::from(eighth) * 0.25 * std::f64::consts::PI);
            let on_circle = turns.map(|turn| [x + radius * turn.cos(), y + radius * turn.sin()]);
            on_circle.filter(|place| frame.pixel(*place) == rgb(*color)).count()
        };
        if radius > 4.0 {
            // Outside, there may be a trail or an edge.
            assert_eq!(around(radius - 2.0), 8, "{name}: radius {radius} of {particle}");
            assert!(around(radius + 2.0) <= 2, "{name}: radius {radius} of {particle}");
        }
    }
    for (edge, color) in &rendering.edge_colors {
        let [a, b] = scene.edges[*edge].particles.map(|particle| frame.place(now[particle]));
        let middle = [0, 1].map(|axis| 0.5 * (a[axis] + b[axis]));
        assert_eq!(frame.pixel(middle), rgb(*color), "{name}: edge {edge}");
    }
    for path in &rendering.particle_paths {
        for back in [1, 2, 3].map(|quarter| quarter * states.len() / 4) {
            let [x, y] = frame.place(states[states.len() - 1 - back][path.particle]);
            let [at_x, at_y] = frame.place(now[path.particle]);
            let age = back as f64 * scene.time_step / path.duration;
            if age >= 1.0
                || (x - at_x).hypot(y - at_y)
                    < scene.particles[path.particle].radius * frame.scale + 3.0
            {
                continue;
            }
            let color = rgb(path.color);
            let faded = [0, 1, 2].map(|at| color[at] * (1.0 - age) + background[at] * age);
            // A thin line may divide its colour between two pixels.
            let near = (0..9).map(|at| [x + f64::from(at % 3 - 1), y + f64::from(at / 3 - 1)]);
            let apart =
                near.map(|place| distance(frame.pixel(place), faded)).fold(f64::MAX, f64::min);
            assert!(apart <= 0.6 * distance(faded, background), "{name}: path, {back} steps ago");
        }
    }
}

#[needs("test -d ${SPRING_ORACLE_FOSSSIM:-../shared/fosssim}")]
#[test]
fn course_frames_follow_viewport_and_colours() {
    let beside = root().join("../shared/fosssim");
    let folder = std::env::var_os("SPRING_ORACLE_FOSSSIM").map_or(beside, PathBuf::from);
    let scenes = find_scene_files(&folder.join("scenes")).unwrap();
    let colored =
        scenes.iter().filter(|path| fs::read_to_string(path).unwrap().contains("<particlecolor"));
    let mut count = 0;
    for path in colored {
        let below = path.strip_prefix(folder.join("scenes")).unwrap();
        check(path, &folder.join("traces").join(below).with_extension("bin"));
        count += 1;
    }
    assert!(count >= 12, "{count}");
}
