//! What goes wrong is said in one place, in full, with the right exit code, and leaves no broken file behind.

mod common;

use common::{Folder, SCENE};

/// Runs a command that must fail; what it said on standard error.
fn fails(f: &Folder, code: i32, line: &str) -> String {
    let ran = f.run(line);
    assert_eq!(ran.code, Some(code), "steradian {line}\n{}{}", ran.out, ran.err);
    ran.err
}

#[test]
fn scenes_that_cannot_be_read() {
    let f = Folder::with_scene().with("latin.pbrt", b"# caf\xe9\nWorldBegin\n");
    std::fs::create_dir(f.path("folder.pbrt")).unwrap();
    let end = "error: the scene cannot be used: 1 error\n";
    for (name, said) in [
        ("no.pbrt", "no.pbrt: no such file"),
        ("folder.pbrt", "folder.pbrt: is a directory, not a file"),
        ("latin.pbrt", "latin.pbrt: not UTF-8 text (byte 5 is not part of a character)"),
    ] {
        assert_eq!(fails(&f, 2, &format!("render {name} -o a.exr")), format!("error: {said}\n{end}"));
    }
    assert!(!f.path("a.exr").exists());
}

#[test]
fn problems_have_a_place_a_caret_and_a_hint_and_are_all_reported() {
    let text = "Film \"rgb\" \"integer xresolutoin\" [ 16 ]\nShpae \"sphere\"\nWorldBegin\nAttributeBegin\n";
    let f = Folder::empty().with("bad.pbrt", text);
    let ran = f.run("check bad.pbrt");
    assert_eq!(ran.code, Some(2));
    for part in [
        "error: unknown directive `Shpae`\n --> bad.pbrt:2:1\n  |\n2 | Shpae \"sphere\"\n  | ^^^^^\n  = help: did you mean `Shape`?\n",
        "xresolutoin",
        "did you mean `xresolution`?",
        "error: `AttributeBegin` is not closed\n --> bad.pbrt:4:1\n",
        "  = help: add `AttributeEnd`\n",
        "\nbad.pbrt: 3 errors",
    ] {
        assert!(ran.out.contains(part), "{part}\n--- in ---\n{}", ran.out);
    }
    let said = fails(&f, 2, "render bad.pbrt");
    assert!(said.ends_with("error: the scene cannot be used: 3 errors\n"), "{said}");
    assert_eq!(f.list(), ["bad.pbrt"]);
}

#[test]
fn meshes_that_lie() {
    let header = |faces: u32| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face {faces}\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
        )
    };
    let scene = |mesh: &str| format!("{SCENE}Shape \"plymesh\" \"string filename\" \"{mesh}\"\n");
    let f = Folder::empty()
        .with("good.ply", header(1))
        .with("lying.ply", header(4_000_000_000))
        .with("index.ply", header(1).replace("3 0 1 2", "3 0 1 7"))
        .with("nan.ply", header(1).replace("1 0 0", "nan 0 0"));
    for mesh in ["good", "lying", "index", "nan"] {
        let f = std::fs::write(f.path(&format!("{mesh}.pbrt")), scene(&format!("{mesh}.ply")));
        f.unwrap();
    }
    f.ok("check good.pbrt");
    for mesh in ["lying", "index", "nan"] {
        let ran = f.run(&format!("check {mesh}.pbrt"));
        assert_eq!(ran.code, Some(2), "{mesh}: {}", ran.out);
        assert!(
            ran.out.contains(&format!("{mesh}.ply")) && ran.out.contains(&format!(" --> {mesh}.pbrt:")),
            "{}",
            ran.out
        );
    }
}

#[test]
fn absurd_resolutions_are_refused_with_the_memory_they_would_take() {
    let f = Folder::with_scene().with("zero.pbrt", SCENE.replace("[ 16 ]", "[ 0 ]"));
    let said = fails(&f, 2, "render small.pbrt --size 2000000x1000000 -o a.exr");
    let expected = "error: a picture of 2000000 x 1000000 pixels would take 371.1 TiB of memory, and this machine has ";
    assert!(said.starts_with(expected) && said.ends_with("; choose a smaller --size or a --crop\n"), "{said}");
    f.ok("render small.pbrt --size 2000000x1000000 --crop 0.5,0.500001,0.5,0.500001 --spp 1 -o a.exr -q");
    let said = fails(&f, 2, "render zero.pbrt");
    assert!(said.contains("zero.pbrt:1:"), "{said}");
    let f = f.with("huge.pbrt", SCENE.replace("[ 16 ]", "[ 2000000000 ]").replace("[ 12 ]", "[ 2000000000 ]"));
    let said = fails(&f, 2, "render huge.pbrt");
    assert!(
        said.contains("a film of 2000000000 x 2000000000 pixels would take ") && said.contains("huge.pbrt:1:"),
        "{said}"
    );
}

#[test]
fn a_slip_on_the_command_line_is_answered_with_what_was_meant() {
    let f = Folder::with_scene();
    for (line, parts) in [
        ("rendr small.pbrt", ["unrecognized subcommand 'rendr'", "similar subcommand exists: 'render'"]),
        ("render small.pbrt --treads 4", ["unexpected argument '--treads'", "similar argument exists: '--threads'"]),
        ("render small.pbrt --integrator pth", ["invalid value 'pth'", "similar value exists: 'path'"]),
        ("render small.pbrt --spp 0", ["invalid value '0' for '--spp <N>'", "0 is not in 1..=16777216"]),
        ("render small.pbrt --spp lots", ["invalid value 'lots' for '--spp <N>'", "invalid digit"]),
        ("render small.pbrt --threads 0", ["invalid value '0' for '--threads <N>'", "0 is not in 1..=1024"]),
        ("render small.pbrt --size 0x4", ["invalid value '0x4' for '--size <WxH>'", "at least one pixel each way"]),
        ("render small.pbrt --size big", ["invalid value 'big'", "write it as WIDTHxHEIGHT, as in 640x360"]),
        ("render small.pbrt --crop 0.5,0.5,0,1", ["invalid value '0.5,0.5,0,1'", "nothing is left of the picture"]),
        (
            "render small.pbrt --exposure bright",
            ["invalid value 'bright'", "a number of stops from -64 to 64, or auto"],
        ),
        ("trace small.pbrt --pixel 3 --sample 0", ["invalid value '3' for '--pixel <x,y>'", "write it as x,y"]),
    ] {
        let said = fails(&f, 2, line);
        for part in parts {
            assert!(said.contains(part), "{line}: {part}\n{said}");
        }
    }
    assert_eq!(
        fails(&f, 2, "trace small.pbrt --pixel 16,0 --sample 0"),
        "error: --pixel 16,0 lies outside the picture of 16 x 12 pixels\n"
    );
}

#[test]
fn files_that_cannot_be_written_are_refused_before_rendering() {
    // A scene that would render for hours: the refusal must come first.
    let slow = SCENE.replace("[ 4 ]", "[ 100000000 ]");
    let f = Folder::empty().with("slow.pbrt", slow).with("file", "");
    std::fs::create_dir(f.path("folder.exr")).unwrap();
    for (line, code, said) in [
        ("-o no/a.exr", 3, "cannot write no/a.exr: there is no folder no"),
        ("-o file/a.exr", 3, "cannot write file/a.exr: file is not a folder"),
        ("-o folder.exr", 3, "cannot write folder.exr: it is a folder"),
        ("-o a.exr --variance no/v.exr", 3, "cannot write no/v.exr: there is no folder no"),
        ("-o a", 2, "a: the extension must say what kind of file to write: .exr, .png, .jpg, .hdr or .pfm"),
        ("-o a.bmp", 2, "a.bmp: this kind of file is read but not written; write .exr, .png, .jpg, .hdr or .pfm"),
        ("-o a.exr --variance v.png", 2, "v.png: variance needs full precision; write .exr or .pfm"),
        ("-o a.exr -o a.exr", 2, "a.exr: the same file is to be written twice"),
    ] {
        assert_eq!(fails(&f, code, &format!("render slow.pbrt {line}")), format!("error: {said}\n"), "{line}");
    }
    assert_eq!(f.list(), ["file", "folder.exr", "slow.pbrt"]);
}

#[test]
fn images_that_cannot_be_compared() {
    let f = Folder::with_scene().with("cut.exr", b"\x76\x2f\x31\x01\x02\0\0\0").with("words.txt", "hello");
    f.ok("render small.pbrt -o a.exr -q");
    assert_eq!(fails(&f, 2, "compare no.exr a.exr"), "error: no.exr: no such file or folder\n");
    assert!(fails(&f, 2, "compare cut.exr a.exr").starts_with("error: cut.exr: damaged EXR file: "));
    assert!(
        fails(&f, 2, "compare words.txt a.exr").starts_with("error: words.txt: not an image format that is known here")
    );
    assert_eq!(
        fails(&f, 2, "compare a.exr a.exr --against-spp 4"),
        "error: a.exr: --against-spp needs channels Variance.R .G .B in B\n"
    );
}

#[test]
fn bad_samples_are_counted_and_can_be_replayed() {
    // A lamp brighter than numbers go: infinity times zero is no number.
    let f = Folder::empty().with(
        "a b.pbrt",
        SCENE.replace("\"rgb L\" [ 5 5 4 ]", "\"rgb L\" [ 1e30 1e30 1e30 ] \"float scale\" [ 1e15 ]"),
    );
    let ran = f.command("render -o a.exr --spp 2 --seed 3 --threads 2").arg("a b.pbrt").output().unwrap();
    let said = String::from_utf8(ran.stderr).unwrap();
    assert_eq!(ran.status.code(), Some(0), "the rest of the picture is kept: {said}");
    assert!(said.contains("warning: ") && said.contains(" samples went wrong and counted as black"), "{said}");
    let line = said.lines().find(|l| l.contains("steradian trace")).unwrap().trim();
    let options = line.strip_prefix("steradian trace 'a b.pbrt' ").unwrap();
    assert!(options.ends_with(" --spp 2 --seed 3"), "threads change nothing: {options}");
    let ran = f.command(&format!("trace {options} --json")).arg("a b.pbrt").output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    assert_eq!(json["finite"], false);
    let image = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
    assert!(image.planes("").unwrap().iter().all(|p| p.iter().all(|v| v.is_finite())));
    assert!(image.metadata.text("steradian.badSamples").is_some());
}

/// A texture with pixels that are no numbers: said when it is read, counted where it is seen, and still a picture.
#[test]
fn pixels_that_are_no_numbers_are_not_hidden() {
    let pixels = [0.5, f32::NAN, f32::INFINITY, -1.0].map(f32::to_le_bytes).concat();
    let f = Folder::empty().with("t.pfm", [b"Pf\n2 2\n-1.0\n".as_slice(), &pixels].concat()).with(
        "a.pbrt",
        r#"LookAt 0 0 -4  0 0 0  0 1 0 Camera "perspective" "float fov" 30
        Film "rgb" "integer xresolution" 32 "integer yresolution" 32 Sampler "paddedsobol" "integer pixelsamples" 4
        WorldBegin LightSource "infinite"
        Texture "t" "spectrum" "imagemap" "string filename" "t.pfm" "string filter" "point"
        Material "diffuse" "texture reflectance" "t"
        Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]"#,
    );
    let metal = std::fs::read_to_string(f.path("a.pbrt")).unwrap().replace("diffuse", "conductor");
    std::fs::write(f.path("metal.pbrt"), metal).unwrap();
    assert!(f.run("render metal.pbrt -o metal.exr").err.contains(" samples went wrong"));
    for integrator in ["path", "volpath", "simplevolpath", "distribution"] {
        let ran = f.run(&format!("render a.pbrt -o a.exr --max-depth 2 --integrator {integrator}"));
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(ran.err.contains("t.pfm: 2 of 4 pixels infinite or undefined, the first at 0,0"), "{}", ran.err);
        let image = steradian_image::read(&f.bytes("a.exr"), "a.exr").unwrap();
        let green = image.planes("").unwrap()[1];
        // The square is 29.9 pixels wide; half of it is bad, and a quarter black.
        let bad = image.metadata.text("steradian.badSamples").unwrap().parse::<f64>().unwrap() / 4.0;
        assert!((bad / (0.5 * 29.9 * 29.9) - 1.0).abs() < 0.1, "{integrator}: {bad}");
        assert!(green.iter().all(|v| v.is_finite()) && green[8 * 32 + 8] == 0.0, "{integrator}");
        assert!(green.iter().any(|v| (v - 0.5).abs() < 0.05), "{integrator}");
        assert!(ran.err.contains("steradian trace a.pbrt --pixel "), "{}", ran.err);
    }
}
