//! Scripts and styles that all pages share.
//!
//! The scripts use no library and no modules: pages of reports are opened from the file system, where browsers refuse
//! modules. Each file adds to one object, `Report`.

/// Elements, numbers and data.
pub const BASE: (&str, &str) = ("base.js", include_str!("base.js"));

/// Line charts.
pub const CHART: (&str, &str) = ("chart.js", include_str!("chart.js"));

/// Pointer, wheel and keys on a picture.
pub const GESTURES: (&str, &str) = ("gestures.js", include_str!("gestures.js"));

/// A scene on a canvas: the same picture as that of a frame.
pub const STAGE: (&str, &str) = ("stage.js", include_str!("stage.js"));

/// Elements of elastic bodies by strain.
pub const STRAIN: (&str, &str) = ("strain.js", include_str!("strain.js"));

/// Styles, light and dark.
pub const STYLE: (&str, &str) = ("report.css", include_str!("report.css"));
