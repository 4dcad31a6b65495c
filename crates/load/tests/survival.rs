//! Hostile scenes: whatever bytes come, a load ends soon with a scene or a list of problems, and a scene that loads can be put together or
//! is refused in words.

use std::path::Path;
use std::time::{Duration, Instant};
use steradian_load::{Input, LoadOptions, LoadOutcome, Memory, load_pbrt};
use steradian_sampling::rng::Rng;
use steradian_scene::World;

/// A bit of nearly everything.
const ALL: &str = include_str!("../../../fuzz/seeds/scene/all.pbrt");

/// Far more than any of these takes, so that only a hang is noticed.
const SOON: Duration = Duration::from_secs(60);

fn load(text: &[u8], files: &Memory) -> LoadOutcome {
    let files = files.clone().with("scene.pbrt", text);
    load_pbrt(Input::File(Path::new("scene.pbrt")), &files, &LoadOptions::default())
}

/// Loads, and puts together what loads. Whether there is a world.
fn survives(text: &[u8], files: &Memory) -> bool {
    let start = Instant::now();
    let out = load(text, files);
    assert_eq!(out.scene.is_some(), out.errors() == 0);
    for d in &out.diagnostics {
        assert!(!d.render(&out.sources).is_empty());
    }
    let built = out.scene.is_some_and(|scene| World::build(scene).is_ok());
    assert!(start.elapsed() < SOON, "{:?} for {} bytes", start.elapsed(), text.len());
    built
}

#[test]
fn a_scene_cut_at_any_byte() {
    let none = Memory::new();
    assert!(survives(ALL.as_bytes(), &none), "whole, it is a scene");
    for n in 0..ALL.len() {
        survives(&ALL.as_bytes()[..n], &none);
    }
}

#[test]
fn bytes_changed_at_random() {
    let mut rng = Rng::new(7, 1);
    let mut below = |n: usize| ((rng.f32() * n as f32) as usize).min(n - 1);
    let pieces: [&[u8]; 14] = [
        b"\"",
        b"[",
        b"]",
        b"#",
        b"\n",
        b"\0",
        b"\xff",
        b"-",
        b"1e39",
        b"nan",
        b"-inf",
        b"99999999999999999999",
        b"0",
        b"\xc3\xa9",
    ];
    let digits: Vec<usize> = (0..ALL.len()).filter(|&i| ALL.as_bytes()[i].is_ascii_digit()).collect();
    let mut worlds = 0;
    for round in 0..1500 {
        let mut text = ALL.as_bytes().to_vec();
        if round % 2 == 0 {
            // Another number, which is as good as the one before more often than not.
            text[digits[below(digits.len())]] = b"0123456789"[below(10)];
        } else {
            for _ in 0..=below(4) {
                let at = below(text.len());
                let end = (at + below(6)).min(text.len());
                text.splice(at..end, pieces[below(pieces.len())].iter().copied());
            }
        }
        worlds += usize::from(survives(&text, &Memory::new()));
    }
    assert!((300..1200).contains(&worlds), "some changes do no harm, and some do: {worlds}");
    for _ in 0..300 {
        let noise: Vec<u8> = (0..below(2000) + 1).map(|_| below(256) as u8).collect();
        assert!(!survives(&noise, &Memory::new()));
    }
}

#[test]
fn texts_that_go_on_and_on() {
    let deep = format!("WorldBegin\n{}", "AttributeBegin\n".repeat(100_000));
    let out = load(deep.as_bytes(), &Memory::new());
    assert!(out.errors() > 0 && out.diagnostics.len() <= 501);
    let closed = format!("WorldBegin\n{}{}", "AttributeBegin ".repeat(9_000), "AttributeEnd ".repeat(9_000));
    assert!(survives(closed.as_bytes(), &Memory::new()));
    let many = format!("WorldBegin\n{}", "Translate 1 0 0 Scale 1 1 1\n".repeat(500_000));
    let start = Instant::now();
    let out = load(many.as_bytes(), &Memory::new());
    assert!(out.scene.is_some() && start.elapsed() < SOON);
    let objects = format!("WorldBegin\n{}", "ObjectBegin \"o\" ObjectEnd ObjectInstance \"o\"\n".repeat(2_000));
    survives(objects.as_bytes(), &Memory::new());
    let brackets = format!("WorldBegin Shape \"trianglemesh\" \"point3 P\" {}", "[".repeat(200_000));
    assert!(!survives(brackets.as_bytes(), &Memory::new()));
    let long = format!("WorldBegin Shape \"{}", "a".repeat(2_000_000));
    assert!(!survives(long.as_bytes(), &Memory::new()));
}

/// Each directive with numbers that are none, or too large to compute with.
#[test]
fn numbers_that_cannot_be() {
    let lines = [
        "Translate X 0 0",
        "Scale X 1 1",
        "Scale 0 X 0",
        "Rotate X 0 1 0",
        "LookAt X 0 0 X 0 0 0 1 0",
        "Transform [ X 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 ]",
        "LightSource \"point\" \"float scale\" X",
        "LightSource \"point\" \"rgb I\" [ X X X ] \"point3 from\" [ X 0 0 ]",
        "LightSource \"infinite\" \"rgb L\" [ X 1 1 ]",
        "LightSource \"spot\" \"float coneangle\" X \"float conedeltaangle\" X",
        "AreaLightSource \"diffuse\" \"blackbody L\" X",
        "Material \"dielectric\" \"float eta\" X",
        "Material \"conductor\" \"float roughness\" X",
        "Material \"diffuse\" \"rgb reflectance\" [ X X X ]",
        "Texture \"t\" \"float\" \"constant\" \"float value\" X",
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" X",
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"float scale\" X",
        "MakeNamedMedium \"m\" \"string type\" \"cloud\" \"float density\" X \"float frequency\" X",
        "Shape \"sphere\" \"float radius\" X",
        "Shape \"sphere\" \"float phimax\" X \"float zmin\" X",
        "Shape \"cylinder\" \"float radius\" X \"float zmax\" X",
        "Shape \"disk\" \"float innerradius\" X \"float height\" X",
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 X 0 0 0 1 0 ]",
        "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 X 0 0 0 1 0 1 1 0 ]",
        "Shape \"curve\" \"point3 P\" [ 0 0 0 X 0 0 1 1 0 0 1 0 ] \"float width\" X",
        "Shape \"loopsubdiv\" \"integer levels\" X \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 2 ]",
        "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 X ]",
    ];
    let head = [
        "Camera \"perspective\" \"float fov\" X",
        "Sampler \"halton\" \"integer pixelsamples\" X",
        "PixelFilter \"gaussian\" \"float xradius\" X",
    ];
    for number in
        ["nan", "inf", "-inf", "1e39", "-1e38", "1e-45", "-1", "0", "2147483648", "123456789012345678901234567890"]
    {
        for line in lines {
            let body = format!(
                "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\n{}\nShape \"sphere\"\n",
                line.replace('X', number)
            );
            survives(body.as_bytes(), &Memory::new());
        }
        for line in head {
            let text = format!(
                "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\n{}\nWorldBegin\nShape \"sphere\"\n",
                line.replace('X', number)
            );
            survives(text.as_bytes(), &Memory::new());
        }
    }
}

/// Pictures, meshes and volumes that are not what their names say.
#[test]
fn files_that_are_damaged() {
    let mut rng = Rng::new(3, 1);
    let noise: Vec<u8> = (0..5000).map(|_| (rng.f32() * 256.0) as u8).collect();
    let starts: [&[u8]; 7] = [
        b"",
        b"\x89PNG\r\n\x1a\n",
        b"\x76\x2f\x31\x01",
        b"#?RADIANCE\n",
        b"PF\n9 9\n-1\n",
        b"ply\nformat binary_little_endian 1.0\n",
        b"NanoVDB0",
    ];
    for start in starts {
        let bytes = [start, &noise].concat();
        for name in [
            "f.png",
            "f.exr",
            "f.hdr",
            "f.pfm",
            "f.jpg",
            "f.tga",
            "f.ply",
            "f.nvdb",
            "f.spd",
            "f.bsdf",
            "f.ies",
            "f.dat",
            "f.pbrt.gz",
        ] {
            let files = Memory::new().with(name, bytes.clone());
            let line = match &name[2..] {
                "ply" => format!("Shape \"plymesh\" \"string filename\" \"{name}\""),
                "nvdb" => format!("MakeNamedMedium \"m\" \"string type\" \"nanovdb\" \"string filename\" \"{name}\""),
                "spd" => format!("Material \"diffuse\" \"spectrum reflectance\" \"{name}\""),
                "bsdf" => format!("Material \"measured\" \"string filename\" \"{name}\""),
                "ies" => format!("LightSource \"goniometric\" \"string filename\" \"{name}\""),
                "dat" => format!("Camera \"realistic\" \"string lensfile\" \"{name}\""),
                "pbrt.gz" => format!("Include \"{name}\""),
                _ => format!("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{name}\""),
            };
            let text = if name == "f.dat" { format!("{line}\nWorldBegin\n") } else { format!("WorldBegin\n{line}\n") };
            let out = load(text.as_bytes(), &files);
            assert!(!out.diagnostics.is_empty(), "{name} of noise after {start:?} is not taken in silence");
        }
    }
}

/// Thirty files, some twice, some broken, some that include others: parsed ahead on other threads, or all by one thread, they are the same
/// scene with the same problems in the same order.
#[test]
fn included_files_are_read_ahead_to_the_same_scene() {
    let mut files = Memory::new().with("nested.pbrt", "Shape \"disk\" \"float radius\" 0.5\nImport \"3.pbrt\"\n");
    let mut text = String::from("Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\n");
    for i in 0..30 {
        let line = match i % 10 {
            4 => "Shape \"sphere\" \"float radios\" 1 ]\n".to_owned(),
            7 => "Include \"nested.pbrt\"\n".to_owned(),
            _ => format!("Translate {i} 0 0\nShape \"sphere\" \"float radius\" {}\n", i + 1),
        };
        files = files.with(format!("{i}.pbrt"), line);
        let word = if i % 3 == 0 { "Include" } else { "Import" };
        text += &format!("{word} \"{i}.pbrt\"\n{word} \"{}.pbrt\"\n", i % 12);
    }
    let said = |text: &str| {
        let out = load(text.as_bytes(), &files);
        let problems: Vec<String> = out.diagnostics.iter().map(|d| d.render(&out.sources)).collect();
        (problems, out.scene.map(|s| format!("{:?}", s.primitives)))
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (problems, scene) = said(&(text.clone() + "Import \"missing.pbrt\"\n"));
    assert!(
        problems.len() > 3
            && scene.is_none()
            && problems.last().is_some_and(|p| p.contains("missing.pbrt: no such file"))
    );
    assert_eq!((problems, scene), pool.install(|| said(&(text.clone() + "Import \"missing.pbrt\"\n"))));
    let whole: String = text.lines().filter(|l| !l.contains("4.pbrt")).map(|l| format!("{l}\n")).collect();
    let (problems, scene) = said(&whole);
    assert!(scene.as_ref().is_some_and(|s| s.len() > 1000), "{problems:?}");
    assert_eq!((problems, scene), pool.install(|| said(&whole)));
}
