//! Pictures: an SVG document from a drawing, and the same as PNG.
//!
//! The PNG is the SVG, drawn by `resvg` with a font that comes with the program: no font of the system is needed, and
//! the pixels are the same on every system.

use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, IntoDrawingArea, SVGBackend};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree};

/// What is drawn on.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// What drawing comes to.
pub(super) type Drawn = Result<(), Box<dyn std::error::Error>>;

/// A picture could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the picture cannot be drawn: {0}")]
pub struct PictureError(String);

impl PictureError {
    fn new(error: impl ToString) -> Self {
        Self(error.to_string())
    }
}

/// What `draw` draws, as an SVG document of this size, with a newline at its end.
pub(super) fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<String, PictureError> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&area).map_err(PictureError::new)?;
        area.present().map_err(PictureError::new)?;
    }
    if !text.ends_with('\n') {
        text.push('\n');
    }
    Ok(text)
}

/// An SVG document as a PNG file, with `scale` pixels for one of the document.
///
/// # Errors
/// Where it cannot be read or drawn.
pub(super) fn png(svg: &str, scale: f32) -> Result<Vec<u8>, PictureError> {
    let mut options = Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    // Whatever family or weight the document names, there is but one.
    let family = fonts.faces().next().and_then(|face| face.families.first()).cloned();
    if let Some((family, _)) = family {
        fonts.set_sans_serif_family(family.clone());
        options.font_family = family;
    }
    let tree = Tree::from_str(svg, &options).map_err(PictureError::new)?;
    let size = |pixels: f32| (pixels * scale).round() as u32;
    let mut picture = Pixmap::new(size(tree.size().width()), size(tree.size().height()))
        .ok_or_else(|| PictureError::new("it has no size"))?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut picture.as_mut());
    picture.encode_png().map_err(PictureError::new)
}
