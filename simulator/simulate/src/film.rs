//! Frames and films of a run: `--frames DIR`, `--film FILE`, and FOSSSim's `-g 1` and `-m DIR`.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use clap::{Args, ValueEnum};
use frames::{Bounds, Painter};
use picture::canvas::Canvas;
use picture::drawing::Drawing;
use picture::gif::GifWriter;
use scene::Scene;
use scene::output::OutputFile;
use scene::state::StateView;
use simulator::simulation::{Simulation, SimulationOptions};
use tempfile::TempPath;

use crate::{Failure, materials};

/// Folder that FOSSSim writes PNG files to.
const PNGS: &str = "pngs";

/// Films that `ffmpeg` writes.
const FFMPEG: [&str; 3] = ["mp4", "webm", "avi"];

/// Options of frames and films.
#[derive(Args)]
pub(super) struct FilmArgs {
    /// Write one picture per frame to this folder: frame00000.png, …
    #[arg(long, value_name = "DIR", help_heading = "Pictures")]
    frames: Option<PathBuf>,

    /// Format of the frames
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t = FrameFormat::Png, help_heading = "Pictures")]
    frame_format: FrameFormat,

    /// Write a film: .gif, or by ffmpeg .mp4, .webm or .avi
    #[arg(long, value_name = "FILE", help_heading = "Pictures")]
    pub(super) film: Option<PathBuf>,

    /// Frames a second of simulated time
    #[arg(long, value_name = "N", default_value = "24", value_parser = parse_rate, help_heading = "Pictures")]
    fps: f64,

    /// Size of a frame in pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "800x600", value_parser = parse_size, help_heading = "Pictures")]
    size: [u32; 2],

    /// Fill triangles and tetrahedra of elastic bodies, coloured by strain: violet for 0, yellow for MAX and more
    #[arg(long, value_name = "MAX", value_parser = parse_strain, help_heading = "Pictures")]
    strain: Option<f64>,

    /// 1: write one PNG file per frame to pngs/
    #[arg(short = 'g', value_name = "0|1", value_parser = ["0", "1"], help_heading = "FOSSSim's spelling")]
    pngs: Option<String>,

    /// Write one SVG file per frame to this folder
    #[arg(short = 'm', value_name = "DIR", help_heading = "FOSSSim's spelling")]
    svgs: Option<PathBuf>,
}

impl FilmArgs {
    /// Whether frames or a film were asked for.
    pub(super) fn is_asked(&self) -> bool {
        let has_folder = self.frames.is_some() || self.svgs.is_some();
        has_folder || self.film.is_some() || self.pngs.as_deref() == Some("1")
    }
}

/// Formats of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FrameFormat {
    /// Pixels
    Png,
    /// Vectors
    Svg,
}

impl FrameFormat {
    fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Svg => "svg",
        }
    }
}

fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if rate > 0.0 && rate <= 1e6 => Ok(rate),
        _ => Err("it must be a number above 0, and at most 1e6".to_owned()),
    }
}

fn parse_strain(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(strain) if strain > 0.0 && strain.is_finite() => Ok(strain),
        _ => Err("it must be a number above 0, such as 0.1".to_owned()),
    }
}

fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(width, height)| {
        Some([width.parse::<u32>().ok()?, height.parse::<u32>().ok()?])
    });
    sides
        .filter(|sides| sides.iter().all(|side| (16..=8192).contains(side)))
        .ok_or_else(|| "it must be WIDTHxHEIGHT, such as 800x600, each from 16 to 8192".to_owned())
}

/// The pictures of a run.
pub(super) struct Film<'a> {
    painter: Painter<'a>,
    targets: Vec<Target>,
    fps: f64,
    frame: u64,
}

/// A target of frames.
enum Target {
    Folder(PathBuf, FrameFormat),
    Gif(GifWriter<OutputFile>, PathBuf),
    Ffmpeg { child: Child, written: TempPath, path: PathBuf },
}

impl<'a> Film<'a> {
    /// Opens what was asked for; `None` if nothing was.
    pub(super) fn open(
        args: &FilmArgs,
        scene: &'a Scene,
        config: SimulationOptions,
    ) -> Result<Option<Self>, Failure> {
        let mut targets = Vec::new();
        let pngs = args.pngs.as_deref() == Some("1");
        let folders = [
            args.frames.clone().map(|folder| (folder, args.frame_format)),
            pngs.then(|| (PathBuf::from(PNGS), FrameFormat::Png)),
            args.svgs.clone().map(|folder| (folder, FrameFormat::Svg)),
        ];
        for (folder, format) in folders.into_iter().flatten() {
            fs::create_dir_all(&folder).map_err(|error| Failure::at(&folder, error))?;
            targets.push(Target::Folder(folder, format));
        }
        if let Some(path) = &args.film {
            targets.push(Target::film(path, args)?);
        }
        if targets.is_empty() {
            return Ok(None);
        }
        let mut painter = Painter::new(scene, args.size, bounds(scene, config)?);
        painter.set_materials(&materials(scene));
        if let Some(strain) = args.strain {
            painter.set_strain(strain);
        }
        Ok(Some(Self { painter, targets, fps: args.fps, frame: 0 }))
    }

    /// Draws the frames that are due at a state. A frame shows the first state at its time or after it.
    pub(super) fn state(&mut self, state: StateView<'_>) -> Result<(), Failure> {
        let StateView { step, time, positions, .. } = state;
        self.painter.follow(step, time, positions);
        // A sum of time steps falls short of its frame by rounding.
        let is_due = |frame: u64| frame as f64 / self.fps <= time + 1e-9 * time.max(1.0);
        if !is_due(self.frame) {
            return Ok(());
        }
        let drawing = self.painter.draw(time, positions);
        let needs_pixels = |target: &Target| !matches!(target, Target::Folder(_, FrameFormat::Svg));
        let canvas = self.targets.iter().any(needs_pixels).then(|| drawing.canvas());
        while is_due(self.frame) {
            for target in &mut self.targets {
                target.write(self.frame, &drawing, canvas.as_ref())?;
            }
            self.frame += 1;
        }
        Ok(())
    }

    /// Completes the films.
    pub(super) fn finish(self) -> Result<(), Failure> {
        self.targets.into_iter().try_for_each(Target::finish)
    }
}

/// The bounds of the motion: of the whole one where the scene has no viewport, which takes a separate run.
fn bounds(scene: &Scene, config: SimulationOptions) -> Result<Bounds, Failure> {
    let mut bounds = Bounds::default();
    bounds.include(scene, &scene.positions());
    if scene.rendering.viewport.is_none() {
        let mut simulation = Simulation::with_options(scene, config);
        while simulation.advance()? {
            bounds.include(scene, simulation.state().positions);
        }
    }
    Ok(bounds)
}

impl Target {
    fn film(path: &Path, args: &FilmArgs) -> Result<Self, Failure> {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or("");
        let extension = extension.to_ascii_lowercase();
        if extension == "gif" {
            let file =
                OutputFile::create(path).map_err(|error| Failure::cannot_create(path, &error))?;
            let writer = GifWriter::new(file, args.size, args.fps);
            let writer = writer.map_err(|error| Failure::at(path, error))?;
            return Ok(Self::Gif(writer, path.to_path_buf()));
        }
        if !FFMPEG.contains(&extension.as_str()) {
            return Err(Failure::at(
                path,
                "the extension is not that of a film\n  help: name it .gif, .mp4, .webm or .avi",
            ));
        }
        // ffmpeg replaces the file piece by piece: it writes to another one in the same folder.
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let suffix = format!(".{extension}");
        let mut builder = tempfile::Builder::new();
        builder.prefix(".film-").suffix(&suffix);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any new file: what the umask leaves of it.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let written = builder
            .tempfile_in(folder)
            .map_err(|error| Failure::cannot_create(path, &error))?
            .into_temp_path();
        let [width, height] = args.size;
        let child = Command::new("ffmpeg")
            .args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args(["-s", &format!("{width}x{height}"), "-r", &args.fps.to_string(), "-i", "-"])
            // Players need an even number of pixels, and colours at half the resolution.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
            .args(["-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"])
            .arg(&written)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn();
        match child {
            Ok(child) => Ok(Self::Ffmpeg { child, written, path: path.to_path_buf() }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Err(Failure::at(
                path,
                "ffmpeg is not installed\n  help: install it (apt-get install ffmpeg), or name the film .gif",
            )),
            Err(error) => Err(Failure::at(path, format!("ffmpeg: {error}"))),
        }
    }

    fn write(
        &mut self,
        frame: u64,
        drawing: &Drawing,
        canvas: Option<&Canvas>,
    ) -> Result<(), Failure> {
        let pixels = canvas.map(Canvas::pixels).unwrap_or_default();
        match self {
            Self::Folder(folder, format) => {
                let path = folder.join(format!("frame{frame:05}.{}", format.extension()));
                let bytes = match (*format, canvas) {
                    (FrameFormat::Png, Some(canvas)) => canvas.png(),
                    _ => Ok(drawing.svg().into_bytes()),
                };
                let written = bytes.and_then(|bytes| {
                    let mut file = OutputFile::create(&path)?;
                    file.write_all(&bytes)?;
                    file.commit()
                });
                written.map_err(|error| Failure::at(&path, error))
            }
            Self::Gif(writer, path) => {
                writer.write(pixels).map_err(|error| Failure::at(path, error))
            }
            Self::Ffmpeg { child, path, .. } => {
                let written = child.stdin.as_mut().map_or(Ok(()), |input| input.write_all(pixels));
                written.map_err(|error| Failure::at(path, format!("ffmpeg: {error}")))
            }
        }
    }

    fn finish(self) -> Result<(), Failure> {
        match self {
            Self::Folder(..) => Ok(()),
            Self::Gif(writer, path) => {
                let done = writer.into_inner().and_then(OutputFile::commit);
                done.map_err(|error| Failure::at(&path, error))
            }
            Self::Ffmpeg { mut child, written, path } => {
                drop(child.stdin.take());
                let status = child.wait().map_err(|error| Failure::at(&path, error))?;
                if !status.success() {
                    return Err(Failure::at(&path, format!("ffmpeg failed: {status}")));
                }
                written.persist(&path).map_err(|error| Failure::at(&path, error))
            }
        }
    }
}
