//! Page of a class's creative scenes: playback of each, its checks, and a sheet for judges' marks.
//!
//! ```text
//! DIR/index.html         the scenes
//! DIR/motions/NUMBER.js  the motion of a scene, loaded when it comes into view
//! DIR/marks.csv          a row for each scene, a column for each criterion
//! ```

use frames::Palette;
use frames::materials::Materials;
use grader::boundary::printed::{InertCsv, Untrusted};
use grader::creative::{Creative, Motion, Outcome};
use grader::rubric::creative::CRITERIA;
use scene::Scene;
use serde::{Deserialize, Serialize};

use super::Sink;
use super::data::{base64, short};
use super::page::{Html, Page};

/// The scenes of a class.
pub struct Gallery {
    scenes: Vec<Creative>,
    /// The name of each scene on the page.
    names: Vec<Untrusted>,
    hides_names: bool,
}

impl Gallery {
    /// A gallery of the scenes. If it hides names, scenes are numbered in the order of their hashes, which
    /// says nothing about their names.
    pub fn new(mut scenes: Vec<Creative>, hides_names: bool) -> Self {
        if hides_names {
            scenes.sort_by(|a, b| (a.hash, &a.path).cmp(&(b.hash, &b.path)));
        }
        let name = |(number, scene): (usize, &Creative)| {
            if hides_names { format!("Scene {}", number + 1).into() } else { scene.below.clone() }
        };
        let names = scenes.iter().enumerate().map(name).collect();
        Self { scenes, names, hides_names }
    }

    /// Which scene is whose, as CSV.
    ///
    /// # Errors
    /// Never in practice: the output is memory.
    pub fn key(&self) -> csv::Result<Vec<u8>> {
        let mut table = InertCsv::new(["scene", "file"])?;
        for (name, scene) in self.names.iter().zip(&self.scenes) {
            table.row([name.text(), scene.path.text()])?;
        }
        table.bytes()
    }

    /// The sheet for marks, as CSV.
    fn marks(&self) -> csv::Result<Vec<u8>> {
        let columns = CRITERIA.map(|criterion| criterion.column);
        let head = ["scene", "assignment", "failed checks"].into_iter().chain(columns);
        let mut table = InertCsv::new(head.chain(["judge", "remarks"]))?;
        for (name, scene) in self.names.iter().zip(&self.scenes) {
            let failed = scene.checks.iter().filter(|check| check.outcome != Outcome::Passed);
            let failed: Vec<&str> = failed.map(|check| check.name).collect();
            let assignment = scene.assignment.as_deref().unwrap_or("");
            table.row([&name.text(), assignment, &failed.join(" "), "", "", "", "", ""])?;
        }
        table.bytes()
    }
}

/// Writes the page of a gallery, its data and its sheet for marks.
///
/// # Errors
/// If `sink` fails.
pub fn write(gallery: &Gallery, sink: Sink<'_>) -> std::io::Result<()> {
    super::assets(sink)?;
    let mut html = Html::default();
    html.markup("<h1>Creative scenes</h1><p>").text(&match gallery.scenes.len() {
        1 => "One scene".to_owned(),
        number => format!("{number} scenes"),
    });
    html.markup(". Judges fill in <a href=\"marks.csv\">marks.csv</a>; the criteria are:</p><ol>");
    for criterion in CRITERIA {
        html.element("li", &[], criterion.meaning);
    }
    html.markup("</ol><div class=\"gallery\">");
    for (number, (scene, name)) in gallery.scenes.iter().zip(&gallery.names).enumerate() {
        let picture = scene.picture.as_ref().map(|picture| picture.read()).transpose()?;
        let motion = picture.and_then(|bytes| MotionData::read(&bytes));
        card(&mut html, gallery, scene, (number, name), motion.is_some());
        if let Some(motion) = motion {
            let data = serde_json::to_string(&motion)?;
            let script = format!("Report.motions[{number}] = {data};\n");
            sink(&format!("motions/{number}.js"), script.as_bytes())?;
        }
    }
    html.markup("</div>");
    sink("marks.csv", &gallery.marks().map_err(std::io::Error::other)?)?;
    let page = Page { title: "Creative scenes", depth: 0, above: &[] };
    sink("index.html", &page.render(&html))
}

/// Adds a scene.
fn card(
    html: &mut Html,
    gallery: &Gallery,
    scene: &Creative,
    (number, name): (usize, &Untrusted),
    moves: bool,
) {
    let name = &name.text();
    let id = format!("scene-{number}");
    html.open("section", &[("class", "card"), ("aria-labelledby", &id)]);
    html.element("h2", &[("id", &id)], name);
    if moves {
        let number = number.to_string();
        html.open("div", &[("data-motion", &number), ("data-name", name)]).close("div");
    } else {
        html.markup("<p class=\"verdict bad\">There is no motion to show.</p>");
    }
    // Descriptions may name their authors.
    if let (Some(description), false) = (&scene.description, gallery.hides_names) {
        html.element("p", &[("class", "said")], &description.text());
    }
    html.markup("<ul class=\"checks\">");
    for check in &scene.checks {
        let (class, sign) = match check.outcome {
            Outcome::Passed => ("good", "✓"),
            Outcome::Failed => ("bad", "✗"),
            Outcome::NotMade => ("odd", "?"),
        };
        html.open("li", &[("class", class)]);
        html.text(&format!("{sign} {}: {}", check.name, check.outcome.word()));
        if !gallery.hides_names {
            html.element("span", &[("class", "hint")], &format!(" {}", check.found));
        }
        html.markup("</li>");
    }
    html.markup("</ul></section>");
}

/// A motion, for `gallery.js`. Positions are base64 of 16-bit numbers, in units from `low`. It is written in the sandbox, and
/// read as strictly as any output of an untrusted program.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionData {
    scene: Palette,
    times: Vec<f64>,
    low: Vec<f64>,
    unit: f64,
    positions: String,
}

impl MotionData {
    /// The data of a motion.
    pub fn of(scene: &Scene, motion: &Motion) -> Self {
        let dimension = scene.dimension.count();
        let mut low = vec![f64::INFINITY; dimension];
        let mut high = vec![f64::NEG_INFINITY; dimension];
        for (number, value) in motion.positions.iter().enumerate() {
            low[number % dimension] = low[number % dimension].min(*value);
            high[number % dimension] = high[number % dimension].max(*value);
        }
        let size = low.iter().zip(&high).map(|(low, high)| high - low).fold(0.0, f64::max);
        let unit = if size > 0.0 { size / f64::from(u16::MAX) } else { 1.0 };
        let quantized = motion.positions.iter().enumerate();
        let quantized: Vec<u16> = quantized
            .map(|(number, value)| ((value - low[number % dimension]) / unit).round() as u16)
            .collect();
        // A scene without particles has no bounds.
        low.iter_mut().filter(|low| low.is_infinite()).for_each(|low| *low = 0.0);
        Self {
            scene: Palette::without_covered_edges(scene, motion.bounds, &Materials::default()),
            times: motion.times.iter().map(|time| short(*time).unwrap_or(0.0)).collect(),
            low,
            unit,
            positions: base64(&quantized),
        }
    }

    /// The motion in these bytes, if they hold one whose parts fit together.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let data: Self = serde_json::from_slice(bytes).ok()?;
        let size = data.scene.n_coordinates()?;
        let n_bytes = size.checked_mul(data.times.len())?.checked_mul(2)?;
        let digits = data.positions.trim_end_matches('=');
        let fits = data.positions.len() == n_bytes.div_ceil(3).checked_mul(4)?
            && data.positions.len() - digits.len() <= 2
            && digits.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"+/".contains(&byte))
            && size.checked_rem(data.low.len()) == Some(0);
        fits.then_some(data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A particle in two states.
    const MOTION: &str = r#"{"scene":{"dimension":2,"count":1,"radii":[0.1],"colors":["a54a00"],"edges":[],"edgeRadii":[],"edgeColors":[],"trails":[{"particle":0,"duration":1.0,"color":"ff0000"}],"background":"ffffff","center":[0.0,0.0,0.0],"extents":[1.0,1.0],"viewport":null},"times":[0.0,1.0],"low":[0.0,0.0],"unit":1.0,"positions":"AAAAAAAAAAA="}"#;

    #[test]
    fn sandboxed_motion_round_trips_or_is_refused() {
        let again = MotionData::read(MOTION.as_bytes()).unwrap();
        assert_eq!(serde_json::to_string(&again).unwrap(), MOTION);
        for (from, to) in [
            ("\"a54a00\"", "\"</scri\""),
            ("\"particle\":0", "\"particle\":1"),
            ("\"edges\":[]", "\"edges\":[[0,1]]"),
            ("\"count\":1", "\"count\":18446744073709551615"),
            ("\"count\":1", "\"count\":2"),
            ("\"dimension\":2", "\"dimension\":0"),
            ("AAAAAAAAAAA=", "AAAAAAAAAA<="),
            ("AAAAAAAAAAA=", "AAAA"),
            ("\"unit\":1.0", "\"unit\":1e999"),
            ("\"unit\":1.0", "\"unit\":1.0,\"more\":1"),
            ("\"low\":[0.0,0.0]", "\"low\":[]"),
        ] {
            assert!(MOTION.contains(from), "{from}");
            assert!(MotionData::read(MOTION.replace(from, to).as_bytes()).is_none(), "{to}");
        }
    }
}
