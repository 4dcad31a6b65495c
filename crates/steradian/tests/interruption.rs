//! Ctrl-C and a full disk: what there is is kept whole, and nothing broken is left under the final name.

#![cfg(unix)]

mod common;

use common::{Folder, Ran, SCENE};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A scene that would take hours.
fn endless() -> Folder {
    Folder::empty().with("slow.pbrt", SCENE.replace("[ 4 ]", "[ 10000000 ]").replace("[ 16 ]", "[ 64 ]"))
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").arg(format!("-{name}")).arg(child.id().to_string()).status().unwrap();
    assert!(status.success());
}

/// Waits, but not for ever.
fn finish(mut child: Child) -> Ran {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(30) {
            child.kill().unwrap();
            panic!("the program did not stop");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ran::from(child.wait_with_output().unwrap())
}

/// Starts a render and waits until its first line says that the scene has been read.
fn start(f: &Folder, line: &str) -> Child {
    use std::io::Read;
    let mut child = f.command(line).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut byte = [0];
    let stderr = child.stderr.as_mut().unwrap();
    while stderr.read(&mut byte).unwrap() == 1 && byte != *b"\n" {}
    // Some samples, so that there is something to keep.
    std::thread::sleep(Duration::from_millis(300));
    child
}

#[test]
fn the_first_signal_stops_and_writes_what_there_is() {
    for name in ["INT", "TERM"] {
        let f = endless();
        let child = start(&f, "render slow.pbrt -o a.exr -o a.png");
        signal(&child, name);
        let ran = finish(child);
        assert_eq!(ran.code, Some(130), "{}", ran.err);
        assert!(ran.err.contains("interrupted") && ran.err.contains("wrote a.exr"), "{}", ran.err);
        assert_eq!(f.list(), ["a.exr", "a.png", "slow.pbrt"]);
        let image = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
        assert_eq!(image.metadata.text("steradian.outcome"), Some("interrupted"));
        let samples = image.metadata.number("samplesPerPixel").unwrap();
        assert!((1.0..1e7).contains(&samples), "{samples}");
        assert!(image.planes("").unwrap()[0].iter().any(|&v| v > 0.0));
    }
}

#[test]
fn an_interrupted_picture_is_the_one_that_so_many_samples_give() {
    // Padded Sobol' points do not depend on how many were planned.
    let f = endless();
    let child = start(&f, "render slow.pbrt --sampler paddedsobol -o a.exr");
    signal(&child, "INT");
    assert_eq!(finish(child).code, Some(130));
    let a = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
    let samples = a.metadata.number("samplesPerPixel").unwrap();
    f.ok(&format!("render slow.pbrt --sampler paddedsobol -o b.exr -q --spp {samples}"));
    let b = steradian_image::read(&f.bytes("b.exr"), "b.exr").unwrap();
    assert!(a.planes("") == b.planes(""), "{samples} samples");
}

#[test]
fn a_full_disk_leaves_neither_a_broken_file_nor_an_old_one_destroyed() {
    let f = Folder::with_scene().with("a.exr", "what was there before");
    // A limit on the size of files stands in for a full disk: writing fails half-way.
    let line = format!(
        "trap '' XFSZ; ulimit -f 1; exec '{}' render small.pbrt --size 64x64 --spp 1 -o a.exr -o b.pfm -q",
        env!("CARGO_BIN_EXE_steradian")
    );
    let ran = Ran::from(Command::new("bash").args(["-c", &line]).current_dir(f.path(".")).output().unwrap());
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    let why = "the file would be larger than is allowed here";
    assert_eq!(ran.err, format!("error: cannot write a.exr: {why}\nerror: cannot write b.pfm: {why}\n"));
    assert_eq!(f.list(), ["a.exr", "small.pbrt"]);
    assert_eq!(f.bytes("a.exr"), b"what was there before");
}
