//! Any bytes are an EXR file that can be written again, or an error; and so is what they say about themselves.
#![no_main]

use libfuzzer_sys::fuzz_target;
use steradian_image::{Format, Limits, WriteOptions, encode, read_limited};

fuzz_target!(|data: &[u8]| {
    let limits = Limits { max_bytes: 1 << 24, ..Limits::default() };
    if let Ok(image) = read_limited(data, "fuzz.exr", limits) {
        // What cannot be written, such as a name that is too long, is an error.
        let _ = encode(&image, Format::Exr, "fuzz.exr", &WriteOptions::default());
    }
});
