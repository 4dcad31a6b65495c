//! Checkpoints, resumption, parts and merging, at the command line: nothing is lost, nothing changes by a bit, nothing foreign or
//! damaged is taken.

mod common;

use common::{Folder, SCENE};

/// Runs a command that must fail; what it said on standard error.
fn fails(f: &Folder, code: i32, line: &str) -> String {
    let ran = f.run(line);
    assert_eq!(ran.code, Some(code), "steradian {line}\n{}{}", ran.out, ran.err);
    ran.err
}

fn same(f: &Folder, a: &str, b: &str) {
    assert_eq!(f.ok(&format!("compare --exact {a} {b}")), "identical\n");
}

const RENDER: &str = "render small.pbrt -q --size 40x30 --sampler paddedsobol";

#[test]
fn a_finished_checkpoint_goes_on_to_more_samples() {
    for mode in ["", " --adaptive", " --adaptive contrast"] {
        let f = Folder::with_scene();
        f.ok(&format!("{RENDER}{mode} --spp 70 -o whole.exr"));
        f.ok(&format!("{RENDER}{mode} --spp 20 --checkpoint c --resume -o part.exr"));
        f.ok(&format!("{RENDER}{mode} --spp 70 --checkpoint c --resume -o a.exr --threads 1"));
        // Options that are typed twice differ in nothing but themselves; where they do not, so does nothing.
        same(&f, "a.exr", "whole.exr");
        f.ok(&format!("{RENDER}{mode} --spp 70 --checkpoint c --resume -o again.exr"));
        same(&f, "again.exr", "whole.exr");
    }
}

#[test]
fn points_that_depend_on_their_number_stay_as_they_were_laid_out() {
    let f = Folder::with_scene();
    f.ok("render small.pbrt -q --spp 8 --checkpoint c -o eight.exr");
    let ran = f.run("render small.pbrt --spp 32 --checkpoint c --resume -o a.exr");
    assert!(ran.err.contains("the zsobol points were laid out for 8 samples, and stay so"), "{}", ran.err);
    f.ok("render small.pbrt -q --spp 32 --sampler-spp 8 -o b.exr");
    let ran = f.run("compare --exact a.exr b.exr");
    assert_eq!(ran.out.lines().filter(|l| l.contains("channel")).count(), 0, "{}", ran.out);
}

#[test]
fn foreign_and_damaged_checkpoints_are_refused_and_left_alone() {
    let f = Folder::with_scene();
    f.ok(&format!("{RENDER} --spp 4 --checkpoint c -o a.exr"));
    let kept = f.bytes("c");
    let said = fails(&f, 2, &format!("{RENDER} --spp 4 --checkpoint c -o a.exr"));
    assert_eq!(said, "error: c: there is a checkpoint already; --resume goes on from it, another name starts anew\n");
    for (option, differs) in [
        ("--seed 3", "error:   seed: stored with 0, now 3"),
        ("--max-depth 2", "error:   max-depth: stored with 4, now 2"),
        ("--adaptive", "error:   adaptive: stored with false, now true"),
        ("--adaptive contrast", "error:   adaptive: stored with false, now contrast"),
        ("--crop 0,0.5,0,1", "error:   pixels: stored with 0,40,0,30, now 0,20,0,30"),
        ("--light-sampling off", "error:   integrator.techniques.light_sampling: stored with true, now false"),
        ("--filter triangle", "error:   filter.kind: stored with Gaussian, now Triangle"),
    ] {
        let said = fails(&f, 2, &format!("{RENDER} --spp 8 --checkpoint c --resume -o a.exr {option}"));
        assert!(said.starts_with("error: c: a checkpoint of another render\n") && said.contains(differs), "{said}");
    }
    std::fs::write(f.path("small.pbrt"), format!("{SCENE}\n# changed\n")).unwrap();
    let said = fails(&f, 2, &format!("{RENDER} --spp 8 --checkpoint c --resume -o a.exr"));
    assert!(said.contains("  scene: stored with "), "{said}");
    std::fs::write(f.path("small.pbrt"), SCENE).unwrap();
    for (what, bytes) in [
        ("its checksum is wrong", kept[..kept.len() - 1].to_vec()),
        ("it is no stored render", b"something else, long enough to have a checksum".to_vec()),
        ("it is no stored render", b"".to_vec()),
    ] {
        std::fs::write(f.path("c"), &bytes).unwrap();
        let said = fails(&f, 2, &format!("{RENDER} --spp 8 --checkpoint c --resume -o a.exr"));
        assert_eq!(said, format!("error: c: damaged: {what}\n"));
        assert_eq!(f.bytes("c"), bytes, "it is not overwritten");
    }
}

#[test]
fn parts_merge_to_the_whole_in_any_order() {
    let f = Folder::with_scene();
    f.ok(&format!("{RENDER} --spp 13 -o whole.exr --variance whole-v.exr"));
    for (i, threads) in [(1, 1), (2, 3), (3, 2)] {
        f.ok(&format!("{RENDER} --spp 13 --shard {i}/3 -o {i}.part --threads {threads}"));
    }
    f.ok("merge 3.part 1.part 2.part -o merged.exr --variance merged-v.exr -q");
    same(&f, "merged.exr", "whole.exr");
    same(&f, "merged-v.exr", "whole-v.exr");
    assert_eq!(fails(&f, 2, "merge 3.part 1.part -o x.exr"), "error: missing: part 2/3\n");
    let said = fails(&f, 2, "merge 3.part 1.part 3.part -o x.exr");
    assert_eq!(said, "error: 3.part and 3.part are both part 3/3 by samples\n");
    f.ok(&format!("{RENDER} --spp 13 --seed 1 --shard 2/3 -o other.part"));
    let said = fails(&f, 2, "merge 1.part other.part 3.part -o x.exr");
    assert!(said.contains("other.part and 1.part are of different renders") && said.contains("seed: "), "{said}");
    assert!(!f.path("x.exr").exists());
}

#[test]
fn parts_by_tiles() {
    let f = Folder::with_scene();
    let render = "render small.pbrt -q --size 96x64 --spp 3";
    f.ok(&format!("{render} -o whole.exr"));
    for i in [1, 2] {
        f.ok(&format!("{render} --shard {i}/2 -o {i}.part"));
    }
    f.ok("merge 2.part 1.part -o merged.exr -q");
    same(&f, "merged.exr", "whole.exr");
}

#[test]
fn what_makes_no_sense_with_a_part_is_said() {
    let f = Folder::with_scene();
    for (line, said) in [
        ("--shard 1/2 -o a.exr", "--shard makes no picture: give one -o FILE.part, and make the picture with merge"),
        ("-o a.part", "a .part is made by --shard I/N"),
        (
            "--shard 1/2 -o a.part --time 1s",
            "with --shard the number of samples is fixed: --time, --error and --adaptive do not apply",
        ),
        (
            "--shard 1/2 -o a.part --adaptive contrast",
            "with --shard the number of samples is fixed: --time, --error and --adaptive do not apply",
        ),
        (
            "--shard 1/2 -o a.part --checkpoint b.part",
            "b.part: a checkpoint needs another name than the part that it leads to",
        ),
    ] {
        assert_eq!(fails(&f, 2, &format!("render small.pbrt {line}")), format!("error: {said}\n"));
    }
    assert!(fails(&f, 2, "render small.pbrt --shard 3/2 -o a.part").contains("parts are numbered from 1 to 2"));
    assert!(fails(&f, 2, "render small.pbrt --resume").contains("--checkpoint <FILE>"));
}

/// A part that was killed half-way goes on from its own checkpoint.
#[test]
fn a_part_has_a_checkpoint_of_its_own() {
    let f = Folder::with_scene();
    f.ok(&format!("{RENDER} --spp 12 --shard 1/2 -o a.part --checkpoint c"));
    let said = fails(&f, 2, &format!("{RENDER} --spp 12 --shard 2/2 -o b.part --checkpoint c --resume"));
    assert!(said.contains("share: stored with 1/2 by samples, now 2/2 by samples"), "{said}");
    f.ok(&format!("{RENDER} --spp 12 --shard 1/2 -o b.part --checkpoint c --resume"));
    let (a, b) = (f.bytes("a.part"), f.bytes("b.part"));
    assert_eq!(a.len(), b.len());
}

#[test]
fn an_error_goal_stops_and_says_what_is_known() {
    let f = Folder::with_scene();
    let ran = f.run("render small.pbrt --size 32x24 --sampler paddedsobol --error 10% -o a.exr");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains(", good enough,") && ran.err.contains("95% of the pixels are within "), "{}", ran.err);
    let image = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
    assert_eq!(image.metadata.text("steradian.outcome"), Some("error reached"));
    assert!(image.metadata.number("steradian.errorBound").unwrap() <= 0.1);
    let typed = "--sampler paddedsobol --size 32x24";
    assert!(image.metadata.text("steradian.options").unwrap().contains("--error 10%"), "{typed}");
    // Without adaptivity it is the picture of so many samples.
    f.ok("render small.pbrt -q --size 32x24 --sampler paddedsobol --error 10% --no-adaptive --time 1h -o b.exr");
    let b = steradian_image::read(&f.bytes("b.exr"), "b.exr").unwrap();
    let spp = b.metadata.number("samplesPerPixel").unwrap();
    f.ok(&format!("render small.pbrt -q --size 32x24 --sampler paddedsobol --spp {spp} -o c.exr"));
    let c = steradian_image::read(&f.bytes("c.exr"), "c.exr").unwrap();
    assert_eq!(b.planes(""), c.planes(""));
    for measure in ["linear", "display"] {
        f.ok(&format!("render small.pbrt -q --size 32x24 --error 20% --error-in {measure} -o d.exr"));
    }
}

#[test]
fn time_ends_a_render_at_a_whole_pass() {
    let f = Folder::with_scene();
    let ran = f.run("render small.pbrt --time 300ms -o a.exr --sampler paddedsobol");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.err.contains(", out of time,"), "{}", ran.err);
    let a = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
    let spp = a.metadata.number("samplesPerPixel").unwrap();
    assert!(spp > 4.0, "the scene's own number does not end it: {spp}");
    f.ok(&format!("render small.pbrt -q --spp {spp} -o b.exr --sampler paddedsobol"));
    let b = steradian_image::read(&f.bytes("b.exr"), "b.exr").unwrap();
    assert_eq!(a.planes(""), b.planes(""));
}

#[test]
fn memory_is_predicted() {
    let f = Folder::with_scene();
    let said = fails(&f, 2, "render small.pbrt --size 512x512 --max-memory 1M -o a.exr");
    assert!(said.contains("the scene takes ") && said.contains("more than --max-memory 1.0 MiB"), "{said}");
    f.ok("render small.pbrt -q --max-memory 100M -o a.exr");
}

/// Each line holds what the schema says, and nothing else.
#[test]
fn progress_for_programs_keeps_to_its_schema() {
    use serde_json::Value;
    let schema: Value = serde_json::from_str(include_str!("../docs/progress.schema.json")).unwrap();
    let f = Folder::with_scene();
    let out =
        f.ok("render small.pbrt --size 64x48 --spp 300 --error 0.001% --progress json -q -o a.exr --preview p.png");
    let mut phases = Vec::new();
    for line in out.lines() {
        let object: Value = serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
        let name = object["phase"].as_str().unwrap().to_owned();
        let kind = if ["render", "done"].contains(&name.as_str()) { name.as_str() } else { "phase" };
        let fields = schema["$defs"][kind]["properties"].as_object().unwrap();
        let object = object.as_object().unwrap();
        assert!(object.keys().eq(fields.keys()), "{name}: {line}");
        for (key, value) in object {
            let types = &fields[key]["type"];
            let fits = |t: &Value| match t.as_str() {
                Some("string") => value.is_string(),
                Some("number") => value.is_number(),
                Some("integer") => value.is_u64(),
                Some("null") => value.is_null(),
                Some("array") => value.is_array(),
                _ => false,
            };
            assert!(types.as_array().map_or_else(|| fits(types), |t| t.iter().any(fits)), "{key} in {line}");
        }
        phases.push(name);
    }
    phases.dedup();
    assert_eq!(phases, ["load", "build", "render", "write", "done"]);
    assert!(out.lines().last().unwrap().contains(r#""files":["a.exr"]"#));
    steradian_image::read(&f.bytes("p.png"), "p.png").unwrap();
}

#[test]
fn channels_beside_the_picture() {
    let f = Folder::with_scene();
    let all = "alpha,albedo,normal,geometric-normal,depth,position,uv,ids,crypto-object,crypto-material,variance,samples,error";
    f.ok(&format!("render small.pbrt -q --size 40x30 --spp 16 -o a.exr -o a.png --half --aov {all}"));
    f.ok("render small.pbrt -q --size 40x30 --spp 16 -o plain.exr --half");
    let read = |name: &str| steradian_image::read(&f.bytes(name), name).unwrap();
    let (a, plain) = (read("a.exr"), read("plain.exr"));
    assert_eq!(a.planes(""), plain.planes(""), "the picture itself does not change");
    let at = |name: &str, x: usize, y: usize| a.channel(name).unwrap_or_else(|| panic!("{name}"))[y * 40 + x];
    // The ball in the middle stands at the origin; the camera is 4 away, along z.
    assert!((at("A", 20, 15) - 1.0).abs() < 1e-6 && (at("Z", 20, 15) - 3.5).abs() < 0.05, "{}", at("Z", 20, 15));
    assert!(at("N.Z", 20, 15) < -0.8 && at("Ng.Z", 20, 15) < -0.8 && at("P.Z", 20, 15) < -0.4);
    assert!((at("albedo.R", 20, 15) - 0.7).abs() < 0.05 && (at("albedo.B", 20, 15) - 0.3).abs() < 0.05);
    assert_eq!(at("A", 1, 0), 0.0, "above the horizon there is nothing");
    assert!(at("samples.Y", 3, 3) == 16.0 && at("error.Y", 20, 15) > 0.0 && at("Variance.G", 20, 15) > 0.0);
    assert!(at("id.object", 20, 15) >= 1.0 && at("id.object", 20, 15) != at("id.object", 20, 29));
    assert!(at("CryptoObject00.G", 20, 15) > 0.99 && at("CryptoMaterial00.G", 20, 15) > 0.99);
    assert!(read("a.png").channel("A").is_some());
    // Neither threads nor interruptions, nor more samples of light where the features have enough, change a feature.
    f.ok(&format!("render small.pbrt -q --size 40x30 --spp 16 --threads 1 -o b.exr -o b.png --half --aov {all}"));
    same(&f, "a.exr", "b.exr");
    let said = fails(&f, 2, "render small.pbrt -o a.png --aov depth");
    assert_eq!(said, "error: --aov depth needs an .exr to be written to\n");
}

/// What is seen is looked at in rows, of which each part has some, whether its light is cut by samples or by tiles.
#[test]
fn channels_beside_the_picture_are_in_parts() {
    let f = Folder::with_scene();
    let all = "alpha,albedo,normal,depth,uv,motion,ids,crypto-object,crypto-material,direct,light-groups,variance,samples,error";
    for (size, parts) in [("40x30", 3), ("200x90", 2)] {
        let render = format!("render small.pbrt -q --size {size} --spp 6 --aov {all}");
        f.ok(&format!("{render} -o whole.exr"));
        for i in 1..=parts {
            f.ok(&format!("{render} --shard {i}/{parts} -o {i}.part --threads {i}"));
        }
        let names: String = (1..=parts).rev().map(|i| format!(" {i}.part")).collect();
        f.ok(&format!("merge{names} -q -o merged.exr"));
        same(&f, "whole.exr", "merged.exr");
    }
    let said = fails(&f, 2, "merge 1.part 2.part -o x.exr --aov position");
    assert_eq!(said, "error: --aov position: the parts do not have it; render them with --aov position\n");
    f.ok("render small.pbrt -q --size 200x90 --spp 6 --aov depth --shard 1/2 -o 1.part");
    f.ok("render small.pbrt -q --size 200x90 --spp 6 --aov alpha --shard 2/2 -o 2.part");
    let said = fails(&f, 2, "merge 1.part 2.part -o x.exr");
    assert_eq!(said, "error: the parts were rendered with different --aov\n");
    f.ok("render small.pbrt -q --size 200x90 --spp 6 --shard 2/2 -o 2.part");
    assert!(fails(&f, 2, "merge 1.part 2.part -o x.exr").contains("nobody has looked at row 1"));
}

#[test]
fn an_image_tells_how_to_make_it_again() {
    let f = Folder::with_scene();
    for line in [
        "--spp 5 --seed 9 --size 30x20 --crop 0,1,0.25,0.75",
        "--adaptive --spp 90 --sampler paddedsobol",
        "--adaptive contrast --spp 20 --sampler paddedsobol",
        "--error 30% --max-depth 2",
    ] {
        f.ok(&format!("render small.pbrt -q -o a.exr {line}"));
        f.ok("render -q --like a.exr -o b.exr");
        let ran = f.run("compare --exact a.exr b.exr");
        assert!(!ran.out.contains("channel") && !ran.out.contains("size"), "{line}: {}", ran.out);
    }
    std::fs::write(f.path("small.pbrt"), format!("{SCENE}\n# changed\n")).unwrap();
    let ran = f.run("render --like a.exr -o b.exr");
    assert!(ran.err.contains("the scene's files are not those that the image of --like was made from"), "{}", ran.err);
    let f = f.with("x.pfm", "Pf\n1 1\n-1.0\n\0\0\0\0");
    assert!(fails(&f, 2, "render --like x.pfm -o b.exr").contains("it does not say how it was made"));
}

#[test]
fn the_selftest_passes() {
    let f = Folder::empty();
    let out = f.ok("selftest");
    assert_eq!(out.lines().filter(|l| l.starts_with("  ok ")).count(), 5, "{out}");
}

/// Where the library is not, that is said before rendering, with what to do; where it is, the noisy picture stays.
#[test]
fn denoising_is_there_or_says_what_is_missing() {
    let f = Folder::with_scene();
    let said = fails(&f, 2, "render small.pbrt --denoise -o a.png");
    assert!(said.contains("--denoise needs an .exr") || said.contains("pip install oidn"), "{said}");
    let mut without = f.command("render small.pbrt -q --denoise -o a.exr");
    let ran = common::Ran::from(without.output().unwrap());
    if ran.code == Some(0) {
        let image = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
        f.ok("render small.pbrt -q -o b.exr");
        let plain = steradian_image::read(&f.bytes("b.exr"), "b.exr").unwrap();
        assert_eq!(image.planes("noisy"), plain.planes(""));
        assert!(image.planes("") != plain.planes("") && image.metadata.text("steradian.denoised").is_some());
    } else {
        assert_eq!(ran.code, Some(3), "{}", ran.err);
        assert!(ran.err.contains("pip install oidn") && !f.path("a.exr").exists(), "{}", ran.err);
    }
}
