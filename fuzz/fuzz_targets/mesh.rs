//! Any bytes are a mesh or a list of problems; the first one says in which format.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use steradian_load::{Input, LoadOptions, Memory, load};

fuzz_target!(|data: &[u8]| {
    let Some((first, data)) = data.split_first() else { return };
    let name = ["fuzz.ply", "fuzz.obj", "fuzz.stl"][usize::from(first % 3)];
    let options = LoadOptions { max_film_bytes: 1 << 24, ..LoadOptions::default() };
    let outcome = load(Input::File(Path::new(name)), &Memory::new().with(name, data), &options);
    for d in &outcome.diagnostics {
        d.render(&outcome.sources);
    }
});
