//! Any text is a scene or a list of problems.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use steradian_load::{Input, LoadOptions, Memory, load_pbrt};

fuzz_target!(|text: &str| {
    let options = LoadOptions { max_film_bytes: 1 << 24, ..LoadOptions::default() };
    let outcome = load_pbrt(Input::Text { name: "fuzz.pbrt", text, directory: Path::new("") }, &Memory::new(), &options);
    for d in &outcome.diagnostics {
        d.render(&outcome.sources);
    }
});
