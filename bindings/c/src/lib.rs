//! The C interface of the check of Jacobians: `include/spring_oracle.h` documents it, `include/spring_oracle.hpp` wraps it for
//! C++ with Eigen.
//!
//! This is the one crate with unsafe operations: it reads the pointers that a caller in C passes, and calls the caller's functions.
//! No panic leaves it (`catch_unwind`), and no exception may enter it: the C++ header catches those of callbacks. An exception
//! that enters it all the same ends the process, with a message; a callback that left by `longjmp` is reported by the next check.

use std::ffi::{CStr, c_char, c_double, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::slice;
use std::{cell::Cell, rc::Rc};

use jacobian::verdict::Verdict;
use jacobian::{Derivative, Domain, Function, Report, Settings, Triplet, check};

const OK: c_int = 0;
const UNDEFINED: c_int = 1;
const FAILED: c_int = 2;
const INVALID: c_int = 3;
const FAULT: c_int = 4;
const JUMPED: c_int = 5;

thread_local! {
    /// Whether a callback is running, or has left without returning.
    static CALLING: Cell<bool> = const { Cell::new(false) };
}

type CFunction = unsafe extern "C-unwind" fn(*const c_double, *mut c_double, *mut c_void) -> c_int;
type CAdd = unsafe extern "C" fn(usize, usize, c_double, *mut c_void);
type CSparse =
    unsafe extern "C-unwind" fn(*const c_double, CAdd, *mut c_void, *mut c_void) -> c_int;
type CProduct = unsafe extern "C-unwind" fn(
    *const c_double,
    *const c_double,
    *mut c_double,
    *mut c_void,
) -> c_int;

/// `so_factor`.
#[repr(C)]
#[derive(Debug)]
pub struct Factor {
    name: *const c_char,
    value: c_double,
}

/// `so_options`.
#[repr(C)]
#[derive(Debug)]
pub struct Options {
    user: *mut c_void,
    lower: *const c_double,
    upper: *const c_double,
    draws: usize,
    no_search: c_int,
    seed: u64,
    block: usize,
    factors: *const Factor,
    n_factors: usize,
}

/// `so_report`.
#[repr(C)]
#[derive(Debug)]
pub struct CReport {
    verdict: c_int,
    states: usize,
    wrong_states: usize,
    wrong_entries: usize,
    row: usize,
    column: usize,
    stated: c_double,
    measured: c_double,
    bound: c_double,
    slope: c_double,
    calls: usize,
    jacobians: usize,
    likeness: [c_char; 160],
    text: [c_char; 2048],
}

/// The version of the library.
#[expect(unsafe_code, reason = "exported to C under its name")]
#[unsafe(no_mangle)]
pub extern "C" fn so_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    VERSION.as_ptr().cast()
}

/// Lives while a callback runs. It is dropped by an exception alone, which this crate cannot catch.
struct Calling;

impl Drop for Calling {
    #[expect(clippy::print_stderr, reason = "the process ends, and nobody else can say why")]
    fn drop(&mut self) {
        eprintln!(
            "spring_oracle: a callback threw an exception: catch it there, and return SO_FAILED"
        );
    }
}

/// Calls back. A callback that leaves by `longjmp` leaves the mark of a call behind.
fn call_back(callback: &mut dyn FnMut() -> c_int) -> c_int {
    CALLING.set(true);
    let calling = Calling;
    let status = callback();
    std::mem::forget(calling);
    CALLING.set(false);
    status
}

/// A Jacobian as the caller computes it.
enum Given {
    Dense(CFunction),
    Sparse(CSparse),
    Product(CProduct),
}

/// Checks a dense Jacobian.
///
/// # Safety
/// As `spring_oracle.h` says: pointers are null or valid for their lengths, and callbacks neither throw nor jump.
#[expect(unsafe_code, reason = "exported to C under its name")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn so_check_jacobian(
    f: Option<CFunction>,
    jacobian: Option<CFunction>,
    n: usize,
    m: usize,
    x: *const c_double,
    options: *const Options,
    report: *mut CReport,
) -> c_int {
    // SAFETY: the caller's promise is passed on.
    unsafe { run(f, jacobian.map(Given::Dense), [n, m], x, options, report) }
}

/// Checks a sparse Jacobian.
///
/// # Safety
/// As [`so_check_jacobian`].
#[expect(unsafe_code, reason = "exported to C under its name")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn so_check_sparse(
    f: Option<CFunction>,
    jacobian: Option<CSparse>,
    n: usize,
    m: usize,
    x: *const c_double,
    options: *const Options,
    report: *mut CReport,
) -> c_int {
    // SAFETY: the caller's promise is passed on.
    unsafe { run(f, jacobian.map(Given::Sparse), [n, m], x, options, report) }
}

/// Checks products with a Jacobian.
///
/// # Safety
/// As [`so_check_jacobian`].
#[expect(unsafe_code, reason = "exported to C under its name")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn so_check_product(
    f: Option<CFunction>,
    jacobian: Option<CProduct>,
    n: usize,
    m: usize,
    x: *const c_double,
    options: *const Options,
    report: *mut CReport,
) -> c_int {
    // SAFETY: the caller's promise is passed on.
    unsafe { run(f, jacobian.map(Given::Product), [n, m], x, options, report) }
}

/// Collects an entry that a callback adds; `sink` is the `Vec<Triplet>` that [`run`] passed to it.
#[expect(unsafe_code, reason = "called from C")]
unsafe extern "C" fn add(row: usize, column: usize, value: c_double, sink: *mut c_void) {
    // SAFETY: `run` passes a vector that lives during the callback, and the callback passes it on unchanged.
    let triplets = unsafe { &mut *sink.cast::<Vec<Triplet>>() };
    triplets.push(Triplet { row, column, value });
}

/// # Safety
/// As [`so_check_jacobian`].
#[expect(unsafe_code, reason = "reads the caller's pointers, and calls the caller's functions")]
unsafe fn run(
    f: Option<CFunction>,
    given: Option<Given>,
    [n, m]: [usize; 2],
    x: *const c_double,
    options: *const Options,
    report: *mut CReport,
) -> c_int {
    let (Some(f), Some(given), false) = (f, given, report.is_null()) else { return INVALID };
    if CALLING.replace(false) {
        return JUMPED;
    }
    // SAFETY: a pointer that is not null is valid, by the caller's promise.
    let options = unsafe { options.as_ref() };
    // SAFETY: the same.
    let Some(settings) = (unsafe { settings(x, n, options) }) else { return INVALID };
    let user = options.map_or(std::ptr::null_mut(), |options| options.user);
    let failed = Rc::new(Cell::new(false));
    let call = {
        let failed = Rc::clone(&failed);
        move |callback: &mut dyn FnMut() -> c_int| {
            let status = if failed.get() { UNDEFINED } else { call_back(callback) };
            failed.set(failed.get() || !matches!(status, OK | UNDEFINED));
            status == OK
        }
    };
    let value = {
        let call = call.clone();
        move |x: &[f64], out: &mut [f64]| {
            // SAFETY: `out` has the m numbers that the callback fills.
            call(&mut || unsafe { f(x.as_ptr(), out.as_mut_ptr(), user) })
        }
    };
    let derivative = match given {
        Given::Dense(jacobian) => Derivative::Dense(Box::new(move |x, out| {
            // SAFETY: `out` has the m × n numbers that the callback fills.
            call(&mut || unsafe { jacobian(x.as_ptr(), out.as_mut_ptr(), user) })
        })),
        Given::Sparse(jacobian) => Derivative::Sparse(Box::new(move |x, triplets| {
            let sink: *mut Vec<Triplet> = triplets;
            // SAFETY: `sink` lives during the call.
            call(&mut || unsafe { jacobian(x.as_ptr(), add, sink.cast(), user) })
        })),
        Given::Product(product) => Derivative::Product(Box::new(move |x, v, out| {
            // SAFETY: `v` has n numbers, and `out` the m that the callback fills.
            call(&mut || unsafe { product(x.as_ptr(), v.as_ptr(), out.as_mut_ptr(), user) })
        })),
    };
    let found = catch_unwind(AssertUnwindSafe(|| {
        let mut function = Function::new(m, n, Box::new(value), derivative);
        check(&mut function, &settings)
    }));
    let Ok(found) = found else { return FAULT };
    if failed.get() {
        return FAILED;
    }
    // SAFETY: `report` is valid for a write.
    unsafe { report.write(written(&found)) };
    OK
}

/// The settings; `None` without a point and a box.
///
/// # Safety
/// `x` and the bounds are null or have `n` numbers; names of factors end in a zero byte.
#[expect(unsafe_code, reason = "reads the caller's pointers")]
unsafe fn settings(x: *const c_double, n: usize, options: Option<&Options>) -> Option<Settings> {
    let vector = |numbers: *const c_double| {
        if numbers.is_null() {
            return None;
        }
        // SAFETY: the caller's promise.
        Some(unsafe { slice::from_raw_parts(numbers, n) }.to_vec())
    };
    let mut settings = Settings { points: vector(x).into_iter().collect(), ..Settings::default() };
    if let Some(options) = options {
        settings.domain = vector(options.lower)
            .zip(vector(options.upper))
            .map(|(lower, upper)| Domain { lower, upper });
        if options.draws > 0 {
            settings.draws = options.draws;
        }
        settings.search = options.no_search == 0;
        settings.seed = options.seed;
        settings.block = options.block.max(1);
        if !options.factors.is_null() {
            // SAFETY: the caller's promise.
            let factors = unsafe { slice::from_raw_parts(options.factors, options.n_factors) };
            settings.factors = factors
                .iter()
                .filter(|factor| !factor.name.is_null())
                .map(|factor| {
                    // SAFETY: the caller's promise.
                    let name = unsafe { CStr::from_ptr(factor.name) };
                    (name.to_string_lossy().into_owned(), factor.value)
                })
                .collect();
        }
    }
    (n > 0 && (!settings.points.is_empty() || settings.domain.is_some())).then_some(settings)
}

fn written(found: &Report) -> CReport {
    let worst = found.worst.as_ref();
    let entry = worst.map(|worst| worst.finding.entry);
    let measured = entry.and_then(|entry| entry.sharpest());
    CReport {
        verdict: match found.verdict {
            Verdict::Wrong => 1,
            Verdict::Inconclusive(_) => 2,
            Verdict::Correct | Verdict::CorrectZero | Verdict::NotApplicable => 0,
        },
        states: found.states.len(),
        wrong_states: found.counts().0,
        wrong_entries: found.wrong.len(),
        row: worst.map_or(0, |worst| worst.finding.row),
        column: worst.map_or(0, |worst| worst.finding.column),
        stated: entry.map_or(0.0, |entry| entry.analytic),
        measured: measured.map_or(0.0, |estimate| estimate.value),
        bound: measured.map_or(found.bound, |estimate| estimate.uncertainty),
        slope: found.window.map_or(0.0, |window| window.slope),
        calls: found.calls.values,
        jacobians: found.calls.jacobians,
        likeness: text(&found.likeness.as_ref().map(ToString::to_string).unwrap_or_default()),
        text: text(&found.to_string()),
    }
}

/// As much of `text` as fits before a zero byte, cut between characters.
fn text<const N: usize>(text: &str) -> [c_char; N] {
    let end = (0..N.min(text.len() + 1)).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    let mut bytes = text.as_bytes()[..end].iter();
    std::array::from_fn(|_| bytes.next().map_or(0, |byte| *byte as c_char))
}
