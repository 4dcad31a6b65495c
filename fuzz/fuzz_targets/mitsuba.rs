//! Any bytes are a scene of Mitsuba or a list of problems.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use steradian_load::{Input, LoadOptions, Memory, load};

fuzz_target!(|data: &[u8]| {
    let name = "fuzz.xml";
    let options = LoadOptions { max_film_bytes: 1 << 24, ..LoadOptions::default() };
    let outcome = load(Input::File(Path::new(name)), &Memory::new().with(name, data), &options);
    for d in &outcome.diagnostics {
        d.render(&outcome.sources);
    }
});
