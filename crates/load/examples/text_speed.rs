//! How fast scene text is read: `cargo run --release -p steradian-load --example text_speed -- [MEGABYTES]`.
//!
//! The text is made here: meshes of a few thousand triangles, and many small shapes between them. Beside it stands a plain scan that
//! only counts the lines of the same bytes. With `-o FILE` the text is written, for other programs to read.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;
use steradian_load::{Disk, Input, LoadOptions, load_pbrt};
use steradian_syntax::{FileId, Parser};

fn scene(bytes: usize) -> String {
    let mut text = String::with_capacity(bytes + (1 << 20));
    text.push_str("Film \"rgb\" \"integer xresolution\" 64 \"integer yresolution\" 64\nWorldBegin\n");
    let mut state = 1u64;
    let mut number = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 20) as f32 - 8.0
    };
    // Writing to a string cannot fail.
    let mut mesh = 0;
    while text.len() < bytes {
        for i in 0..50 {
            let _ = writeln!(text, "AttributeBegin\n  Translate {} {} {}", number(), number(), number());
            let _ = writeln!(text, "  Material \"diffuse\" \"rgb reflectance\" [ 0.{i} 0.5 0.25 ]");
            let _ = writeln!(text, "  Shape \"sphere\" \"float radius\" 0.{}\nAttributeEnd", i + 1);
        }
        let n = 2000;
        let _ = write!(text, "Shape \"trianglemesh\" # mesh {mesh}\n  \"integer indices\" [");
        for i in 0..n - 2 {
            let _ = write!(text, " {i} {} {}", i + 1, i + 2);
        }
        for (name, ty) in [("P", "point3"), ("N", "normal")] {
            let _ = write!(text, " ]\n  \"{ty} {name}\" [");
            for _ in 0..n {
                let _ = write!(text, "\n    {} {} {}", number(), number(), number());
            }
        }
        text.push_str(" ]\n");
        mesh += 1;
    }
    text
}

#[expect(clippy::print_stdout, reason = "an example's way to speak")]
fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let megabytes = arguments.iter().find_map(|a| a.parse().ok()).unwrap_or(100);
    let text = scene(megabytes << 20);
    if let Some(at) = arguments.iter().position(|a| a == "-o")
        && let Some(path) = arguments.get(at + 1)
        && let Err(e) = std::fs::write(path, &text)
    {
        println!("{path}: {e}");
    }
    let size = text.len() as f64 / f64::from(1 << 20);
    let time = |what: &str, work: &mut dyn FnMut() -> usize| {
        let best = (0..3)
            .map(|_| {
                let start = Instant::now();
                let n = std::hint::black_box(work());
                (start.elapsed().as_secs_f64(), n)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (seconds, n) = best.unwrap_or_default();
        println!("{what:32} {:8.1} MiB/s   ({n})", size / seconds);
        seconds
    };
    let scan = time("lines counted", &mut || text.bytes().filter(|&b| b == b'\n').count());
    let parsed = time("parsed, one thread", &mut || {
        let mut parser = Parser::new(FileId(0), &text);
        std::iter::from_fn(|| parser.next_directive()).count()
    });
    let loaded = time("loaded to a scene, all threads", &mut || {
        let input = Input::Text { name: "text", text: &text, directory: Path::new(".") };
        let outcome = load_pbrt(input, &Disk, &LoadOptions::default());
        outcome.scene.map_or(0, |s| s.primitives.len())
    });
    println!("a scan is {:.1} times as fast as parsing, {:.1} times as fast as loading", parsed / scan, loaded / scan);
}
