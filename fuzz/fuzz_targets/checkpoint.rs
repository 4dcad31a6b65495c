//! Any bytes under a right checksum are a snapshot that can be written again, or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use steradian_render::Snapshot;

fuzz_target!(|data: &[u8]| {
    let mut bytes = data.to_vec();
    bytes.extend_from_slice(blake3::hash(data).as_bytes());
    if let Ok(snapshot) = Snapshot::decode(&bytes) {
        let again = snapshot.encode();
        assert_eq!(Snapshot::decode(&again).expect("what was written").encode(), again);
    }
});
