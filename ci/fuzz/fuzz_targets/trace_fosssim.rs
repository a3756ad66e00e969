#![no_main]

#[path = "../src/checks.rs"]
#[expect(dead_code, reason = "the other targets call the rest")]
mod checks;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| checks::trace_fosssim(bytes));
