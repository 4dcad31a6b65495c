//! Parts of the light as channels, what biased options take away, and both through resumption and merging.

mod common;

use common::Folder;
use steradian_image::{Image, read};

const RENDER: &str = "render small.pbrt -q --size 40x30 --sampler paddedsobol";

fn image(f: &Folder, name: &str) -> Image {
    read(&f.bytes(name), name).unwrap()
}

fn sum(image: &Image, layers: &[&str]) -> Vec<f32> {
    let planes: Vec<[&[f32]; 3]> = layers.iter().map(|l| image.planes(l).unwrap_or_else(|| panic!("no {l}"))).collect();
    let at = |i: usize| planes.iter().flat_map(move |p| p.iter().map(move |c| c[i])).sum::<f32>();
    (0..image.width() * image.height()).map(at).collect()
}

fn assert_close(a: &[f32], b: &[f32]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4 * (1.0 + b.abs())));
    assert!(a.iter().sum::<f32>() > 0.0);
}

#[test]
fn parts_of_the_light_add_up_resume_and_merge() {
    let f = Folder::with_scene();
    let render = format!("{RENDER} --spp 12 --aov emission,direct,indirect,techniques,light-groups");
    f.ok(&format!("{render} -o a.exr"));
    let whole = image(&f, "a.exr");
    let picture = sum(&whole, &[""]);
    assert_close(&sum(&whole, &["emission", "direct", "indirect"]), &picture);
    assert_close(&sum(&whole, &["technique_lobe", "technique_light"]), &picture);
    assert_close(&sum(&whole, &["RGBA_light1", "RGBA_default"]), &picture);
    f.ok(&format!("{RENDER} --spp 12 -o plain.exr"));
    let plain = image(&f, "plain.exr");
    assert_eq!(whole.planes("").unwrap(), plain.planes("").unwrap(), "asking changes no bit");

    f.ok(&format!("{render} --spp 5 --checkpoint c -o b.exr").replacen("--spp 12 ", "", 1));
    f.ok(&format!("{render} --checkpoint c --resume --threads 1 -o b.exr"));
    assert_eq!(f.ok("compare --exact a.exr b.exr"), "identical\n");
    let said = f.run(&format!("{RENDER} --spp 12 --checkpoint c --resume -o x.exr"));
    assert!(said.err.contains("kept beside the picture: stored with "), "{}", said.err);

    for i in 1..=3 {
        f.ok(&format!("{render} --shard {i}/3 -o {i}.part"));
    }
    f.ok("merge 2.part 3.part 1.part -q -o merged.exr");
    assert_eq!(f.ok("compare --exact a.exr merged.exr"), "identical\n");
}

#[test]
fn groups_are_named_in_the_scene() {
    let scene = common::SCENE.replace(
        "AreaLightSource \"diffuse\"",
        "LightSource \"infinite\" \"rgb L\" [ 0.1 0.2 0.3 ] \"string lightgroup\" \"sky\"\n  AreaLightSource \"diffuse\" \"string lightgroup\" \"key\"",
    );
    let f = Folder::empty().with("s.pbrt", &scene).with("bad.pbrt", scene.replace("\"key\"", "\"a.b\""));
    f.ok("render s.pbrt -q --spp 4 --aov light-groups -o a.exr");
    let a = image(&f, "a.exr");
    assert_close(&sum(&a, &["RGBA_sky", "RGBA_key"]), &sum(&a, &[""]));
    let ran = f.run("check bad.pbrt");
    assert!(ran.code == Some(2) && ran.out.contains("`lightgroup` is a word"), "{}{}", ran.out, ran.err);
    let ran = f.run("render s.pbrt --aov direct --integrator ao -o a.exr");
    assert_eq!(ran.code, Some(2));
    assert!(ran.err.contains("--aov direct: ao does not tell where light comes from"), "{}", ran.err);
}

#[test]
fn what_biased_options_take_is_said_and_kept() {
    let f = Folder::with_scene();
    let ran = f.run("render small.pbrt --spp 16 --clamp 0.5 -o a.exr");
    assert!(ran.err.contains("warning: the limit on samples scaled down"), "{}", ran.err);
    assert!(ran.err.contains("% of the light: the picture is biased by that; clamped.R .G .B"), "{}", ran.err);
    f.ok("render small.pbrt -q --spp 16 -o free.exr");
    let (a, free) = (image(&f, "a.exr"), image(&f, "free.exr"));
    assert_close(&sum(&a, &["", "clamped"]), &sum(&free, &[""]));
    assert_eq!(a.metadata.text("steradian.biased"), Some("clamp"));
    let share = a.metadata.number("steradian.clampedShare").unwrap();
    assert!(share > 0.001 && share < 0.9, "{share}");
    assert_eq!(free.metadata.text("steradian.biased"), None);

    f.ok("render small.pbrt -q --spp 32 --filter-outliers --sampler independent -o o.exr");
    f.ok("render small.pbrt -q --spp 32 --sampler independent -o free.exr");
    let (o, free) = (image(&f, "o.exr"), image(&f, "free.exr"));
    assert_close(&sum(&o, &["", "outliers"]), &sum(&free, &[""]));
    assert_eq!(o.metadata.text("steradian.biased"), Some("filter-outliers"));
    f.ok("render --like o.exr -q -o again.exr");
    assert_eq!(f.ok("compare --exact o.exr again.exr"), "identical\n");
    f.ok("render small.pbrt -q --spp 32 --filter-outliers --sampler independent --shard 1/2 -o 1.part");
    f.ok("render small.pbrt -q --spp 32 --filter-outliers --sampler independent --shard 2/2 -o 2.part");
    f.ok("merge 1.part 2.part -q -o m.exr");
    assert_eq!(f.ok("compare --exact o.exr m.exr"), "identical\n");
}

/// A ball that crosses a tenth of the picture while the shutter is open.
#[test]
fn motion_in_pixels() {
    let scene = common::SCENE.replace(
        "Translate 0 0.5 0\n",
        "ActiveTransform StartTime\nTranslate -0.2 0.5 0\nActiveTransform EndTime\nTranslate 0.2 0.7 0\nActiveTransform All\n",
    );
    let f = Folder::empty().with("s.pbrt", scene);
    f.ok("render s.pbrt -q --spp 16 --size 160x120 --aov motion,crypto-object -o a.exr");
    let a = image(&f, "a.exr");
    let at = |name: &str, x: usize, y: usize| a.channel(name).unwrap()[y * 160 + x];
    // At distance 4 (less the ball's radius at its nearest), 120 pixels are 2 tan 20 degrees times that.
    let per_unit = |distance: f32| 120.0 / (2.0 * steradian_math::tan(20f32.to_radians()) * distance);
    let (u, v) = (at("forward.u", 80, 60), at("forward.v", 80, 60));
    assert!(u > 0.4 * per_unit(4.2) && u < 0.4 * per_unit(3.4), "{u}");
    assert!(v > 0.2 * per_unit(4.4) && v < 0.2 * per_unit(3.3), "{v}: up");
    assert_eq!((at("forward.u", 80, 115), at("forward.v", 80, 115)), (0.0, 0.0), "the floor rests");
}
