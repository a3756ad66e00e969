//! The simulator of the playground, as a module of WebAssembly.
//!
//! A page asks through one buffer: it makes room for a request ([`room`]), writes it there, and calls [`open_scene`] with the text of a
//! scene or [`frame`] with a request of [`live`]. Both yield the length of the answer, which is in the buffer then; it is negative
//! if the answer is the text of an error.

#![expect(unsafe_code, reason = "functions are exported by name")]

use std::cell::RefCell;

use frames::materials::Materials;
use live::{Live, Refused};
use scene::error::SceneError;
use scene::{ParseOptions, SceneLimits, xml};
use serde::Serialize;

/// Sizes of scenes that are run.
const LIMITS: SceneLimits = SceneLimits { bytes: 4 << 20, particles: 20_000, forces: 200_000 };

/// The name of the scene's file in messages.
const NAME: &str = "scene.xml";

/// The buffer, and the scene that was opened last.
struct Page {
    buffer: Vec<u8>,
    live: Option<Live>,
}

thread_local! {
    static PAGE: RefCell<Page> = const { RefCell::new(Page { buffer: Vec::new(), live: None }) };
}

/// An error or a warning, with its place in the scene's text.
#[derive(Serialize)]
struct Remark {
    line: Option<u32>,
    column: Option<u32>,
    message: String,
    help: String,
}

/// The answer to a scene. The data of the page follow as another JSON text, unless there is an error.
#[derive(Serialize)]
struct Opened {
    error: Option<Remark>,
    warnings: Vec<Remark>,
}

impl From<&SceneError> for Remark {
    fn from(error: &SceneError) -> Self {
        Self {
            line: error.location.map(|location| location.line),
            column: error.location.map(|location| location.column),
            message: error.problem.to_string(),
            help: error.problem.remedy().to_string(),
        }
    }
}

impl Page {
    /// Reads the scene in the buffer, and opens it. A scene that is refused leaves the one before it.
    fn open(&mut self) -> Result<Vec<u8>, String> {
        let text = String::from_utf8_lossy(&self.buffer);
        let options = ParseOptions { limits: LIMITS, ..ParseOptions::default() };
        let parsed = xml::parse(&text, NAME, &simulator::vocabulary(), &options);
        let (error, warnings, live) = match parsed {
            Ok(parsed) => {
                let warnings = parsed.warnings.iter().map(Remark::from).collect();
                (None, warnings, Some(Live::new(parsed.scene, Materials::default())))
            }
            Err(error) => (Some(Remark::from(&error)), Vec::new(), None),
        };
        let remarks = serde_json::to_vec(&Opened { error, warnings });
        let mut answer = remarks.map_err(|error| error.to_string())?;
        if let Some(live) = live {
            answer.push(b'\n');
            answer.extend(self.live.insert(live).open().map_err(words)?);
        }
        Ok(answer)
    }

    fn frame(&mut self) -> Result<Vec<u8>, String> {
        let live = self.live.as_mut().ok_or("no scene is open")?;
        live.frame(&self.buffer).map_err(words)
    }

    /// Leaves an answer in the buffer; its length, negative for an error.
    fn leave(&mut self, answer: Result<Vec<u8>, String>) -> i32 {
        let sign = if answer.is_ok() { 1 } else { -1 };
        self.buffer = answer.unwrap_or_else(String::into_bytes);
        sign * i32::try_from(self.buffer.len()).unwrap_or(i32::MAX)
    }
}

fn words(refused: Refused) -> String {
    match refused {
        Refused::Malformed(why) | Refused::Fault(why) => why,
        Refused::Conflict => "another scene was opened".to_owned(),
    }
}

/// Resizes the buffer to `length` bytes, keeping the bytes that fit, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    PAGE.with_borrow_mut(|page| {
        page.buffer.resize(length, 0);
        page.buffer.as_mut_ptr()
    })
}

/// Opens the scene whose XML is in the buffer.
#[unsafe(no_mangle)]
pub extern "C" fn open_scene() -> i32 {
    PAGE.with_borrow_mut(|page| {
        let answer = page.open();
        page.leave(answer)
    })
}

/// Advances the runs as the request in the buffer says.
#[unsafe(no_mangle)]
pub extern "C" fn frame() -> i32 {
    PAGE.with_borrow_mut(|page| {
        let answer = page.frame();
        page.leave(answer)
    })
}
