//! What each command does when all is well: files, words, exit codes.

mod common;

use common::{Folder, Ran, SCENE};
use std::io::Write;
use std::process::Stdio;

fn image(folder: &Folder, name: &str) -> steradian_image::Image {
    steradian_image::read(&folder.bytes(name), name).unwrap()
}

#[test]
fn render_writes_the_file_of_the_film_and_a_png() {
    let f = Folder::with_scene();
    let ran = f.run("render small.pbrt");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert_eq!(ran.out, "", "results are files; words about them go to standard error");
    assert_eq!(f.list(), ["small.exr", "small.pbrt", "small.png"]);
    assert!(ran.err.contains("4 samples per pixel in ") && ran.err.contains("Mrays/s"), "{}", ran.err);
    assert!(ran.err.contains("wrote small.exr\nwrote small.png\nnext: "), "{}", ran.err);
}

#[test]
fn convert_writes_a_scene_that_renders_the_same_and_overwrites_nothing_of_others() {
    let f = Folder::with_scene().with("precious.pbrt", "# mine\n");
    f.ok("convert small.pbrt other.pbrt");
    assert_eq!(f.ok("check other.pbrt"), "other.pbrt: no problems\n");
    f.ok("render small.pbrt -o a.exr -q");
    f.ok("render other.pbrt -o b.exr -q");
    assert_eq!(image(&f, "a.exr").planes(""), image(&f, "b.exr").planes(""));
    // What convert wrote it may write again; what it has not, only if told so; what it reads, never.
    f.ok("convert small.pbrt other.pbrt");
    for (line, words) in [
        ("convert small.pbrt precious.pbrt", "was not written by convert"),
        ("convert small.pbrt small.pbrt --force", "written over what it is read from"),
        ("convert small.pbrt small.ply", "only scenes of pbrt are written"),
    ] {
        let ran = f.run(line);
        assert!(ran.code == Some(2) && ran.err.contains(words), "{line}: {}", ran.err);
    }
    f.ok("convert small.pbrt precious.pbrt --force");
}

#[test]
fn render_may_be_left_out_and_quiet_is_silent() {
    let f = Folder::with_scene();
    let ran = f.run("small.pbrt --quiet --outfile a.pfm");
    assert_eq!((ran.code, ran.out.as_str(), ran.err.as_str()), (Some(0), "", ""));
    assert_eq!(f.list(), ["a.pfm", "small.pbrt"]);
}

#[test]
fn every_kind_of_file_can_be_written_at_once() {
    let f = Folder::with_scene();
    f.ok("render small.pbrt -o a.exr -o a.png -o a.jpg -o a.hdr -o a.pfm --variance v.exr -q");
    for name in ["a.exr", "a.png", "a.jpg", "a.hdr", "a.pfm", "v.exr"] {
        let i = image(&f, name);
        assert_eq!((i.width(), i.height()), (16, 12), "{name}");
    }
    assert_eq!(image(&f, "a.exr").planes(""), image(&f, "a.pfm").planes(""), "both hold the light as it is");
    assert!(image(&f, "v.exr").planes("").unwrap()[0].iter().any(|&v| v > 0.0));
}

#[test]
fn an_exr_says_how_it_was_made() {
    let f = Folder::with_scene();
    f.ok("render small.pbrt -o a.exr --seed 7 --spp 3 --max-depth 2 --color rgb --sampler independent -q");
    let meta = image(&f, "a.exr").metadata;
    assert_eq!(meta.number("samplesPerPixel"), Some(3.0));
    assert!(meta.number("renderTimeSeconds").is_some_and(|t| t > 0.0));
    let text = |name: &str| meta.text(name).unwrap_or_else(|| panic!("{name}")).to_owned();
    assert_eq!(text("steradian.version"), env!("CARGO_PKG_VERSION"));
    assert!(text("steradian.build").starts_with(std::env::consts::ARCH));
    assert_eq!(text("steradian.scene"), "small.pbrt");
    assert_eq!(text("steradian.seed"), "7");
    assert_eq!(text("steradian.options"), "--spp 3 --seed 7 --sampler independent --max-depth 2 --color rgb");
    assert_eq!((text("steradian.integrator"), text("steradian.sampler")), ("path".into(), "independent".into()));
    assert_eq!(text("steradian.outcome"), "finished");
    let told = f.ok("info a.exr");
    for line in ["  size        16 x 12 pixels", "  steradian.seed = \"7\"", "  samplesPerPixel = 3"] {
        assert!(told.contains(line), "{told}");
    }
    assert!(told.contains("channel     R              32-bit float"), "{told}");
    f.ok("render small.pbrt -o half.exr --half -q");
    assert!(f.ok("info half.exr").contains("16-bit float"));
}

#[test]
fn size_and_crop_choose_pixels() {
    let f = Folder::with_scene();
    f.ok("render small.pbrt --size 32x24 -o whole.exr --spp 1 -q");
    f.ok("render small.pbrt --size 32x24 --crop 0.25,0.5,0.5,1 -o part.exr --spp 1 -q");
    let (whole, part) = (image(&f, "whole.exr"), image(&f, "part.exr"));
    assert_eq!((whole.width(), whole.height(), part.width(), part.height()), (32, 24, 8, 12));
    assert_eq!((part.metadata.origin, part.frame().width, part.frame().height), ([8, 12], 32, 24));
    assert_eq!(part.planes(""), whole.crop(8, 12, 8, 12).planes(""), "a crop holds the pixels of the whole");
    // A crop thinner than a pixel is the pixel that it lies in.
    f.ok("render small.pbrt --crop 0.5,0.501,0.5,0.501 -o dot.exr -q");
    assert_eq!((image(&f, "dot.exr").width(), image(&f, "dot.exr").height()), (1, 1));
}

#[test]
fn the_picture_does_not_depend_on_threads() {
    let f = Folder::with_scene();
    for n in [1, 2, 7] {
        f.ok(&format!("render small.pbrt --size 50x40 --spp 5 -q --threads {n} -o {n}.pfm -o {n}.exr -o {n}.png"));
    }
    for n in [2, 7] {
        assert!(f.bytes("1.pfm") == f.bytes(&format!("{n}.pfm")), "{n} threads");
        assert!(f.bytes("1.png") == f.bytes(&format!("{n}.png")), "{n} threads");
        assert_eq!(f.ok(&format!("compare --exact 1.exr {n}.exr")), "identical\n");
    }
    f.ok("render small.pbrt --size 50x40 --spp 5 -q --seed 1 -o other.exr");
    let ran = f.run("compare --exact 1.exr other.exr");
    assert_eq!(ran.code, Some(1));
    assert!(ran.out.contains("channel R: ") && ran.out.contains("attribute steradian.seed"), "{}", ran.out);
}

#[test]
fn a_scene_may_come_from_standard_input() {
    let f = Folder::empty();
    let mut child = f.command("render - -o a.pfm -q").stdin(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(SCENE.as_bytes()).unwrap();
    assert!(child.wait().unwrap().success());
    let g = Folder::with_scene();
    g.ok("render small.pbrt -o a.pfm -q");
    assert!(f.bytes("a.pfm") == g.bytes("a.pfm"));
}

#[test]
fn every_integrator_and_sampler_renders() {
    let f = Folder::with_scene();
    for integrator in ["path", "normals", "albedo", "depth", "uv", "ao"] {
        f.ok(&format!("render small.pbrt -q --integrator {integrator} -o {integrator}.exr --spp 2"));
        let i = image(&f, &format!("{integrator}.exr"));
        assert!(i.planes("").unwrap().iter().all(|p| p.iter().all(|v| v.is_finite())), "{integrator}");
    }
    for sampler in ["independent", "stratified", "halton", "sobol", "paddedsobol", "zsobol", "pmj02bn"] {
        f.ok(&format!("render small.pbrt -q --sampler {sampler} -o {sampler}.exr --spp 64"));
        // 64 samples of one scene by two samplers are two estimates of one picture.
        f.ok(&format!("compare {sampler}.exr independent.exr"));
    }
    assert_eq!(f.run("compare path.exr normals.exr").code, Some(1));
}

#[test]
fn check_and_info_describe_a_scene() {
    let f = Folder::with_scene();
    assert_eq!(f.ok("check small.pbrt"), "small.pbrt: no problems\n");
    let told = f.ok("info small.pbrt");
    for line in [
        "  shapes      2 triangle mesh, 1 sphere\n",
        "  triangles   4\n",
        "  lights      2 area\n",
        "  camera      perspective, 40 degrees along the shorter side\n",
        "  film        16 x 12 pixels, srgb, \"renders/small.exr\"\n",
        "  sampler     zsobol, 4 samples per pixel, seed 0\n",
        "  integrator  path, at most 4 bounces, spectral\n",
        "  bounds      (-5, 0, -5) to (5, 3, 5)\n",
    ] {
        assert!(told.contains(line), "{line}{told}");
    }
}

#[test]
fn compare_measures_and_judges() {
    let f = Folder::with_scene();
    f.ok("render small.pbrt --spp 64 --seed 1 -o a.exr --variance av.exr -q");
    f.ok("render small.pbrt --spp 64 --seed 2 -o b.exr -q");
    f.ok("render small.pbrt --spp 64 --seed 3 -o c.exr -q");
    for line in
        ["compare a.exr b.exr", "compare a.exr b.exr --variance av.exr", "compare a.exr b.exr --seed-image c.exr"]
    {
        let out = f.ok(line);
        for word in ["MSE  ", "relMSE  ", "PSNR  ", "FLIP  ", "bias  ", "global  ", "pixel  ", "\nagree"] {
            assert!(out.contains(word), "{line}: {word}\n{out}");
        }
    }
    // The same picture 10 % brighter: 1.1 times each sample of a PFM file.
    let mut brighter = image(&f, "a.exr");
    for c in ["R", "G", "B"] {
        brighter.channel_mut(c).unwrap().iter_mut().for_each(|v| *v *= 1.1);
    }
    steradian_image::write_file(&brighter, &f.path("d.exr"), &Default::default()).unwrap();
    let ran = f.run("compare d.exr a.exr --json --diff diff.png");
    assert_eq!(ran.code, Some(1), "{}", ran.out);
    let json: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!(json["agree"], false);
    for c in 0..3 {
        assert!((json["metrics"]["bias"][c].as_f64().unwrap() - 0.1).abs() < 1e-4, "{}", ran.out);
    }
    assert_eq!((image(&f, "diff.png").width(), image(&f, "diff.png").height()), (16, 12));
    let ran = f.run("compare a.exr a.exr --json");
    let json: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
    assert_eq!((ran.code, &json["agree"], json["metrics"]["mse"].as_f64()), (Some(0), &true.into(), Some(0.0)));
    f.ok("render small.pbrt --size 8x8 --spp 1 -o small.exr -q");
    let ran = f.run("compare small.exr a.exr");
    assert_eq!(ran.code, Some(1));
    assert_eq!(ran.out, "the images differ in size: 8 x 8 and 16 x 12 pixels\ndiffer\n");
}

#[test]
fn trace_replays_the_very_sample_of_the_picture() {
    let f = Folder::with_scene();
    // With one sample and a box filter the picture is that sample.
    let options = "--spp 1 --seed 5 --max-depth 3";
    let boxed = format!("PixelFilter \"box\"\n{SCENE}");
    let f = f.with("box.pbrt", boxed);
    f.ok(&format!("render box.pbrt -q -o a.exr {options}"));
    let i = image(&f, "a.exr");
    let planes = i.planes("").unwrap();
    for (x, y) in [(0, 0), (8, 6), (9, 8), (15, 11)] {
        let out = f.ok(&format!("trace box.pbrt --pixel {x},{y} --sample 0 --json {options}"));
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        for c in 0..3 {
            let value = json["rgb"][c].as_f64().unwrap() as f32;
            assert_eq!(value, planes[c][y * 16 + x], "pixel {x},{y} channel {c}");
        }
    }
    let told = f.ok("trace small.pbrt --pixel 8,6 --sample 0");
    assert!(told.starts_with("pixel 8,6, sample 0\nfilm position "), "{told}");
    assert!(told.contains("vertex 0 at (") && told.contains("camera ray") && told.contains("\ncolour "), "{told}");
}

#[test]
fn completions_version_and_help() {
    let f = Folder::empty();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(f.ok(&format!("completions {shell}")).contains("max-depth"), "{shell}");
    }
    assert_eq!(f.ok("--version"), concat!("steradian ", env!("CARGO_PKG_VERSION"), "\n"));
    let help = f.ok("--help");
    for word in ["render", "check", "info", "compare", "trace", "completions", "Examples:", "Exit codes:"] {
        assert!(help.contains(word), "{word}");
    }
    let help = f.ok("render --help");
    for heading in ["Output:", "Picture (each replaces what the scene says):", "Run:", "Examples:"] {
        assert!(help.contains(heading), "{heading}");
    }
    let Ran { code, err, .. } = f.run("");
    assert!(code == Some(2) && err.contains("Usage: steradian <COMMAND>"), "{err}");
}

#[test]
fn the_built_in_scene_renders() {
    let f = Folder::empty();
    let ran = f.run("render --size 48x32 --spp 1");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert_eq!(f.list(), ["steradian.exr", "steradian.png"]);
    assert!(ran.err.contains("steradian render SCENE.pbrt"), "{}", ran.err);
    f.ok("trace --pixel 20,20 --sample 0");
}
