//! Bad input: each problem with its exact words and place, all of them in one run.

use proptest::prelude::*;
use std::path::Path;
use steradian_load::{Disk, Input, LoadOptions, LoadOutcome, Memory, load_pbrt};
use steradian_syntax::Kind;

fn load_with(text: &str, files: &Memory) -> LoadOutcome {
    let files = files.clone().with("scene.pbrt", text);
    load_pbrt(Input::File(Path::new("scene.pbrt")), &files, &LoadOptions::default())
}

/// `file:line:column severity: message | hint` for each problem.
fn list(out: &LoadOutcome) -> Vec<String> {
    let one = |d: &steradian_syntax::Diagnostic| {
        let at = d.span.map_or("-".into(), |s| out.sources.describe(s));
        let hint = d.hint.as_ref().map_or(String::new(), |h| format!(" | {h}"));
        format!("{at} {}: {}{hint}", d.severity.word(), d.message)
    };
    out.diagnostics.iter().map(one).collect()
}

fn problems(text: &str) -> Vec<String> {
    list(&load_with(text, &Memory::new()))
}

/// The problems of one line of the world block, without the place.
fn world(line: &str) -> Vec<String> {
    let out = load_with(&format!("WorldBegin\n{line}\n"), &Memory::new());
    assert_eq!(out.scene.is_none(), out.errors() > 0);
    list(&out).into_iter().map(|s| s.split_once(' ').unwrap().1.to_string()).collect()
}

#[test]
fn files_that_cannot_be_read() {
    let none = load_pbrt(Input::File(Path::new("no.pbrt")), &Memory::new(), &LoadOptions::default());
    assert_eq!(list(&none), ["- error: no.pbrt: no such file"]);
    assert!(none.scene.is_none());
    let dir = tempfile::tempdir().unwrap();
    let out = load_pbrt(Input::File(dir.path()), &Disk, &LoadOptions::default());
    assert_eq!(list(&out), [format!("- error: {}: is a directory, not a file", dir.path().display())]);
    let bytes = |bytes: &[u8]| {
        let files = Memory::new().with("s.pbrt", bytes);
        list(&load_pbrt(Input::File(Path::new("s.pbrt")), &files, &LoadOptions::default()))
    };
    assert_eq!(bytes(b"\xff\xfeW\0"), ["- error: s.pbrt: UTF-16 text; save it as UTF-8"]);
    assert_eq!(bytes(b"abc\xff"), ["- error: s.pbrt: not UTF-8 text (byte 3 is not part of a character)"]);
    assert_eq!(bytes(b"\x1f\x8b\x08abc"), ["- error: s.pbrt: damaged gzip data after 0 unpacked bytes"]);
}

#[test]
fn files_of_a_scene_that_are_missing_or_damaged() {
    let text = "WorldBegin\nShape \"plymesh\" \"string filename\" \"a.ply\"\nShape \"plymesh\" \"string filename\" \"cut.ply\"\n\
        Shape \"plymesh\" \"string filename\" \"dir\"\nShape \"plymesh\" \"string filename\" \"nan.ply\"\n\
        Shape \"plymesh\" \"string filename\" \"range.ply\"\nTexture \"t\" \"float\" \"imagemap\" \"string filename\" \"t.png\"\n\
        LightSource \"infinite\" \"string filename\" \"e.exr\"\n\
        Include \"more.pbrt\"\n";
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let files = Memory::new()
        .with("cut.ply", format!("{head}0 0 0 1 0 0 0 1 0\n3 0 1"))
        .with("nan.ply", format!("{head}0 0 0 1 nan 0 0 1 0\n3 0 1 2"))
        .with("range.ply", format!("{head}0 0 0 1 0 0 0 1 0\n3 0 1 7"))
        .with("dir/file", "");
    assert_eq!(
        list(&load_with(text, &files)),
        [
            "scene.pbrt:2:35 error: a.ply: no such file",
            "scene.pbrt:3:35 error: cut.ply: truncated PLY file: it ends in element `face` number 0 of 1",
            "scene.pbrt:4:35 error: dir: is a directory, not a file",
            "scene.pbrt:5:35 error: nan.ply: vertex 1 of the PLY file has a coordinate that is not finite",
            "scene.pbrt:6:35 error: range.ply: face 0 of the PLY file uses vertex 7, but there are only 3",
            "scene.pbrt:7:50 error: t.png: no such file",
            "scene.pbrt:8:42 error: e.exr: no such file",
            "scene.pbrt:9:9 error: more.pbrt: no such file",
        ]
    );
}

#[test]
fn includes_that_never_end() {
    let files = Memory::new().with("a.pbrt", "Identity\nInclude \"b.pbrt\"").with("b.pbrt", "Include \"./a.pbrt\"");
    assert_eq!(
        list(&load_with("Include \"a.pbrt\" WorldBegin", &files)),
        ["b.pbrt:1:9 error: recursive Include: ./a.pbrt includes itself | by way of b.pbrt"]
    );
    assert_eq!(
        problems("Include \"scene.pbrt\" WorldBegin"),
        ["scene.pbrt:1:9 error: recursive Include: scene.pbrt includes itself"]
    );
    let mut tower = Memory::new();
    for i in 0..100 {
        tower = tower.with(format!("{i}"), format!("Include \"{}\"", i + 1));
    }
    assert_eq!(
        list(&load_with("Include \"0\" WorldBegin", &tower)),
        ["62:1:9 error: files include each other more than 64 deep"]
    );
    // Each level twice: two to the thirtieth files, were there no limit.
    let mut bomb = Memory::new();
    for i in 0..30 {
        bomb = bomb.with(format!("{i}"), format!("Include \"{0}\" Include \"{0}\"", i + 1));
    }
    let out = load_with("Include \"0\" WorldBegin", &bomb.with("30", ""));
    assert_eq!(out.errors(), 1);
    assert_eq!(out.diagnostics[0].message, "more than 100000 files are included");
}

#[test]
fn parameters() {
    assert_eq!(
        world("Shape \"sphere\" \"float radios\" 2"),
        ["error: unknown parameter `radios` of Shape \"sphere\" | did you mean `radius`?"]
    );
    assert_eq!(
        world("Shape \"sphere\" \"float colour\" 2"),
        ["error: unknown parameter `colour` of Shape \"sphere\" | it takes alpha, phimax, radius, zmax, zmin"]
    );
    assert_eq!(
        world("Shape \"sphere\" \"integer radius\" 2"),
        ["error: parameter `radius` of Shape \"sphere\" must be of type `float`, not `integer`"]
    );
    assert_eq!(
        world("Material \"diffuse\" \"float reflectance\" 0.5"),
        [
            "error: parameter `reflectance` of Material \"diffuse\" must be of type `rgb`, `spectrum`, `blackbody` or `texture`, not `float`"
        ]
    );
    assert_eq!(
        world("Shape \"sphere\" \"float radius\" 2 \"float radius\" 3"),
        ["warning: parameter `radius` of Shape \"sphere\" is given twice; the last one counts"]
    );
    assert_eq!(
        world("Material \"dielectric\" \"float eta\" 2 \"spectrum eta\" \"glass-BK7\""),
        ["error: parameter `eta` of Material \"dielectric\" is given twice, in different types"]
    );
    assert_eq!(
        world("Shape \"sphere\" \"float radius\" [2 3]"),
        ["error: parameter `radius` of Shape \"sphere\" takes one value, but 2 are given"]
    );
    assert_eq!(
        world("Material \"diffuse\" \"rgb reflectance\" [.5 .5]"),
        ["error: `reflectance` of Material \"diffuse\" takes three numbers, but 2 are given"]
    );
    assert_eq!(
        world("Material \"diffuse\" \"rgb reflectance\" [.5 .5 1.5]"),
        ["error: `reflectance` of Material \"diffuse\" is a reflectance and cannot be above 1"]
    );
    assert_eq!(
        world("LightSource \"point\" \"rgb I\" [.5 .5 -1]"),
        ["error: `I` of LightSource \"point\" has a negative component"]
    );
    assert_eq!(
        world("LightSource \"point\" \"spectrum I\" [500 1 400 1]"),
        ["error: `I` of LightSource \"point\": wavelengths must increase, but 400 nm follows 500 nm (sample 1)"]
    );
    assert_eq!(
        world("LightSource \"point\" \"blackbody I\" -5"),
        ["error: `I` of LightSource \"point\": a temperature of -5 K is not positive and finite"]
    );
    assert_eq!(
        world("LightSource \"point\" \"spectrum I\" \"stdilum-D65\""),
        ["error: unknown spectrum \"stdilum-D65\" | did you mean `stdillum-D65`?"]
    );
    assert_eq!(
        world("LightSource \"point\" \"spectrum I\" [300 1 310 1]"),
        ["error: `I` of LightSource \"point\" emits nothing that can be seen"]
    );
    assert_eq!(
        world("Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"x\" \"string wrap\" \"repaet\"")[0],
        "error: `wrap` of Texture \"imagemap\" cannot be \"repaet\" | did you mean `repeat`?"
    );
}

#[test]
fn types_and_names() {
    assert_eq!(world("Shape \"spere\""), ["error: unknown shape \"spere\" | did you mean `sphere`?"]);
    assert_eq!(world("Material \"matte\""), ["error: unknown material \"matte\" | pbrt-v4 has \"diffuse\" instead"]);
    assert_eq!(world("Material \"conducter\""), ["error: unknown material \"conducter\" | did you mean `conductor`?"]);
    assert_eq!(
        world("LightSource \"sun\""),
        ["error: unknown light \"sun\" | it can be point, spot, distant, infinite, goniometric, projection"]
    );
    assert_eq!(world("NamedMaterial \"a\""), ["error: there is no material \"a\""]);
    assert_eq!(
        world("MakeNamedMaterial \"gold\" \"string type\" \"conductor\" NamedMaterial \"glod\""),
        ["error: there is no material \"glod\" | did you mean `gold`?"]
    );
    let twice = "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" ";
    assert_eq!(world(&twice.repeat(2)), ["error: material \"a\" is defined twice"]);
    assert_eq!(world("MakeNamedMaterial \"a\""), ["error: material \"a\" has no `string type`"]);
    assert_eq!(world("ObjectInstance \"a\""), ["error: there is no object \"a\""]);
    assert_eq!(world("MediumInterface \"a\""), ["error: there is no medium \"a\""]);
    assert_eq!(world("Shape \"sphere\" \"texture alpha\" \"a\""), ["error: there is no float texture \"a\""]);
    assert_eq!(
        world("Texture \"a\" \"float\" \"constant\" Material \"diffuse\" \"texture reflectance\" \"a\""),
        [
            "error: there is no spectrum texture \"a\" | there is a float texture of that name, but a spectrum texture is needed here"
        ]
    );
    assert_eq!(
        world("Texture \"a\" \"color\" \"constant\""),
        ["error: a texture is of kind \"float\" or \"spectrum\", not \"color\" | pbrt-v4 calls it \"spectrum\""]
    );
    assert_eq!(
        world("Texture \"a\" \"float\" \"scale\" \"texture tex\" \"a\""),
        ["error: there is no float texture \"a\""],
        "a texture cannot be made of itself"
    );
    assert_eq!(
        world("MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"m\" \"m\"]"),
        ["error: material \"m\" must be defined before it is mixed"; 2]
    );
    assert_eq!(world("ColorSpace \"rec202\""), ["error: unknown color space \"rec202\" | did you mean `rec2020`?"]);
    assert_eq!(world("Option \"sed\" 1"), ["error: unknown option \"sed\" | did you mean `seed`?"]);
    assert_eq!(
        world("Attribute \"shapes\" \"float radius\" 2"),
        ["error: `Attribute` cannot be for \"shapes\" | did you mean `shape`?"]
    );
}

#[test]
fn geometry() {
    assert_eq!(
        world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]"),
        ["error: `indices` of Shape \"trianglemesh\": face 0 uses vertex 3, but there are only 3"]
    );
    assert_eq!(
        world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]"),
        ["error: `indices` of Shape \"trianglemesh\" needs 3 integers for each face, but has 2"]
    );
    assert_eq!(
        world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 2]")[0],
        "error: `P` of Shape \"trianglemesh\" needs 3 numbers for each item, but has 10"
    );
    assert_eq!(
        world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 1]"),
        ["error: `N` of Shape \"trianglemesh\" has 1 items for 3 vertices"]
    );
    assert_eq!(
        world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 2 0 0]"),
        ["note: Shape \"trianglemesh\": 1 face has no area and is left out"]
    );
    assert_eq!(world("Shape \"trianglemesh\""), ["error: Shape \"trianglemesh\" needs points `P`"]);
    assert_eq!(
        world("Shape \"sphere\" \"float radius\" 0"),
        ["error: Shape \"sphere\" has no surface: a radius, height or angle makes no sense"]
    );
    let twice = "Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2 0 1 2]";
    assert!(world(twice)[0].starts_with("error: Shape \"loopsubdiv\": "), "{:?}", world(twice));
    assert_eq!(world("Scale 1 0 1"), ["error: `Scale` by zero cannot be undone"]);
    assert_eq!(world("Rotate 5 0 0 0"), ["error: `Rotate` needs an axis that is not zero"]);
    assert_eq!(world("Transform [1 0 0 0 0 1 0 0 0 0 0 0 0 0 0 1]"), ["error: this matrix has no inverse"]);
    assert_eq!(
        world("LookAt 0 0 0 0 1 0 0 1 0"),
        ["error: `LookAt` needs two different points and an up vector that is not parallel to their connection"]
    );
    assert_eq!(
        world(
            "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All AreaLightSource \"diffuse\" Shape \"sphere\""
        ),
        ["note: the light moves with its shape; pbrt refuses lights on shapes that move"]
    );
}

#[test]
fn blocks_and_their_order() {
    assert_eq!(
        problems("WorldBegin\nAttributeBegin\n"),
        ["scene.pbrt:2:1 error: `AttributeBegin` is not closed | add `AttributeEnd`"]
    );
    assert_eq!(problems("WorldBegin\nAttributeEnd"), ["scene.pbrt:2:1 error: `AttributeEnd` without `AttributeBegin`"]);
    let out = load_with("WorldBegin\nObjectBegin \"a\"\nAttributeEnd\nObjectEnd", &Memory::new());
    assert_eq!(list(&out), ["scene.pbrt:3:1 error: `AttributeEnd` closes `ObjectBegin`"]);
    assert_eq!(out.diagnostics[0].related[0].message, "`ObjectBegin` is here");
    assert_eq!(
        problems("# nothing\n"),
        [
            "scene.pbrt:1:10 error: the scene has no `WorldBegin` | camera, film and the like come before it, shapes and lights after it"
        ]
    );
    assert_eq!(
        problems("Shape \"sphere\"\nWorldBegin\nFilm \"rgb\"\n"),
        [
            "scene.pbrt:1:1 error: `Shape` must come after `WorldBegin`",
            "scene.pbrt:3:1 error: `Film` must come before `WorldBegin`"
        ]
    );
    assert_eq!(world("AttributeBegin ".repeat(20_000).as_str())[0], "error: blocks nest more than 10000 deep");
}

#[test]
fn films_without_pixels_and_with_too_many() {
    let film = |params: &str| problems(&format!("Film \"rgb\" {params}\nWorldBegin"));
    assert_eq!(
        film("\"integer xresolution\" 0"),
        ["scene.pbrt:1:34 error: the film has no pixels: its resolution is 0 x 720"]
    );
    assert_eq!(
        film("\"integer yresolution\" -5"),
        ["scene.pbrt:1:34 error: the film has no pixels: its resolution is 1280 x -5"]
    );
    assert_eq!(
        film("\"integer xresolution\" 1000000 \"integer yresolution\" 1000000"),
        [
            "scene.pbrt:1:34 error: a film of 1000000 x 1000000 pixels would take 29.1 TiB of memory, and the limit is 64.0 GiB"
        ]
    );
    assert_eq!(
        film(
            "\"integer xresolution\" 1000000 \"integer yresolution\" 1000000 \"integer pixelbounds\" [500 600 500 600]"
        ),
        Vec::<String>::new(),
        "only the pixels to be rendered count"
    );
    assert_eq!(
        film("\"float cropwindow\" [.5 .5 0 1]"),
        ["scene.pbrt:1:31 error: no pixels are left inside the bounds"]
    );
    assert_eq!(
        film("\"string sensor\" \"cie1932\""),
        ["scene.pbrt:1:28 error: unknown sensor \"cie1932\" | did you mean `cie1931`?"]
    );
    assert_eq!(
        problems("Camera \"perspective\" \"float fov\" 180\nWorldBegin"),
        ["scene.pbrt:1:34 error: `fov` must be between 0 and 180 degrees, not 180"]
    );
    assert_eq!(
        problems("Camera \"perspective\" \"float shutterclose\" 0\nWorldBegin"),
        ["scene.pbrt:1:43 error: the shutter opens at 0 and closes at 0, so that no light comes in"]
    );
}

#[test]
fn displacement_curves_and_lenses_must_make_sense() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let files = || Memory::new().with("a.ply", ply).with("bad.dat", "1 2 3").with("flat.dat", "0 1 1 1");
    let list = |text: &str| list(&load_with(text, &files()));
    let displaced = "WorldBegin\nShape \"plymesh\" \"string filename\" \"a.ply\" \"float displacement\" .1";
    assert_eq!(list(displaced), ["scene.pbrt:2:64 error: a mesh needs texture coordinates to be displaced"]);
    assert_eq!(
        list(&format!("{displaced} \"float edgelength\" 0")),
        ["scene.pbrt:2:86 error: `edgelength` must be positive, not 0"]
    );
    assert_eq!(
        world("Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0]"),
        ["error: a Bezier curve of degree 3 needs 4, 7, 10, ... points, not 3"]
    );
    assert_eq!(
        world("AreaLightSource \"diffuse\" Shape \"curve\" \"point3 P\" [0 0 0 1 0 0 2 0 0 3 0 0]"),
        ["warning: light from curves is found by chance only, and so is noisy"]
    );
    let camera = |rest: &str| list(&format!("Camera \"realistic\" {rest}\nWorldBegin"));
    assert_eq!(camera(""), ["scene.pbrt:1:8 error: Camera \"realistic\" needs a `lensfile`"]);
    assert!(camera("\"string lensfile\" \"bad.dat\"")[0].contains("four numbers for each surface"));
    assert!(camera("\"string lensfile\" \"flat.dat\"")[0].contains("no ray comes through the lens"));
    assert_eq!(
        camera("\"string lensfile\" \"flat.dat\" \"float fov\" 3")[1..],
        [
            "scene.pbrt:1:49 error: unknown parameter `fov` of Camera \"realistic\" | it takes aperture, aperturediameter, focusdistance, lensfile, shutterclose, shutteropen"
        ]
    );
}

#[test]
fn lights_with_pictures_and_portals_must_make_sense() {
    assert_eq!(
        world("LightSource \"goniometric\" LightSource \"projection\""),
        [
            "error: LightSource \"goniometric\" needs a `filename`",
            "error: LightSource \"projection\" needs a `filename`"
        ]
    );
    let portal =
        |corners: &str| world(&format!("LightSource \"infinite\" \"rgb L\" [1 1 1] \"point3 portal\" [{corners}]"));
    assert_eq!(portal("0 0 0  0 1 0  1 1 0  1 0 0"), Vec::<String>::new());
    assert_eq!(portal("0 0 0  0 1 0  1 1 0"), ["error: a `portal` has four corners, not 3"]);
    assert_eq!(
        portal("0 0 0  0 1 0  1 1 0  2 0 0"),
        ["error: the `portal` is not a rectangle with its corners in order"]
    );
    assert_eq!(portal("0 0 0  0 0 0  1 1 0  1 0 0"), ["error: two corners of the `portal` are the same"]);
}

#[test]
fn what_is_not_supported_says_what_happens_instead() {
    assert_eq!(
        world("Material \"interface\" AreaLightSource \"diffuse\" Shape \"sphere\""),
        ["warning: a shape with an `interface` material cannot emit; its area light is ignored"]
    );
    assert_eq!(
        world("AreaLightSource \"diffuse\" ObjectBegin \"o\" Shape \"sphere\" ObjectEnd"),
        ["note: each instance of the object shines here; in pbrt none does"]
    );
}

#[test]
fn a_flood_of_problems_is_cut_off() {
    let out = load_with(&format!("WorldBegin\n{}", "Shape \"sphere\" \"float r\" 1\n".repeat(5000)), &Memory::new());
    assert_eq!(out.diagnostics.len(), 501);
    assert_eq!(list(&out)[500], "- note: 4500 more problems are not shown");
}

#[test]
fn an_error_is_rendered_with_its_line() {
    let out = load_with("WorldBegin\nShape \"sphere\" \"float radios\" 2\n", &Memory::new());
    assert_eq!(
        out.diagnostics[0].render(&out.sources),
        "error: unknown parameter `radios` of Shape \"sphere\"\n --> scene.pbrt:2:16\n  |\n2 | Shape \"sphere\" \"float radios\" 2\n  \
         |                ^^^^^^^^^^^^^^\n  = help: did you mean `radius`?\n"
    );
}

fn word() -> impl Strategy<Value = String> {
    let pieces = [
        "\"sphere\"",
        "\"trianglemesh\"",
        "\"plymesh\"",
        "\"curve\"",
        "\"diffuse\"",
        "\"mix\"",
        "\"imagemap\"",
        "\"float\"",
        "\"spectrum\"",
        "\"scale\"",
        "\"perspective\"",
        "\"rgb\"",
        "\"infinite\"",
        "\"spot\"",
        "\"a\"",
        "\"b\"",
        "\"string type\" \"mix\"",
        "\"string materials\" [\"a\" \"b\"]",
        "\"float radius\" 2",
        "\"point3 P\" [0 0 0 1 0 0 0 1 0]",
        "\"integer indices\" [0 1 2]",
        "\"texture tex\" \"a\"",
        "\"texture alpha\" \"b\"",
        "\"rgb L\" [1 2 3]",
        "\"integer xresolution\" -1",
        "\"float fov\" 400",
        "1 2 3",
        "[1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]",
        "\"string filename\" \"scene.pbrt\"",
        "\"scene.pbrt\"",
        "\"bool twosided\" true",
        "All",
        "1e38",
    ];
    prop_oneof![
        (0..Kind::ALL.len()).prop_map(|i| Kind::ALL[i].name().to_string()),
        (0..pieces.len()).prop_map(move |i| pieces[i].to_string()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn any_sequence_of_words_is_a_scene_or_a_list_of_problems(head in 0usize..8, words in proptest::collection::vec(word(), 0..60)) {
        let mut words = words;
        words.insert(head.min(words.len()), "WorldBegin".into());
        let out = load_with(&words.join(" "), &Memory::new());
        prop_assert_eq!(out.scene.is_some(), out.errors() == 0);
        for d in &out.diagnostics {
            prop_assert!(!d.render(&out.sources).is_empty());
        }
    }
}

#[test]
fn materials_with_an_inside_say_what_does_not_fit() {
    assert_eq!(
        world("Material \"hair\" \"rgb color\" [.5 .4 .3] \"float eumelanin\" 2"),
        ["warning: `eumelanin` of Material \"hair\" is ignored, since `color` is given"]
    );
    assert_eq!(
        world("Material \"subsurface\" \"float g\" 1 \"float eta\" 0"),
        [
            "error: `g` of Material \"subsurface\" must be between -1 and 1, not 1",
            "error: `eta` of Material \"subsurface\" must be positive",
        ]
    );
    assert_eq!(
        world("Material \"subsurface\" \"rgb sigma_a\" [1 1 1]"),
        ["error: Material \"subsurface\" has `sigma_a` without `sigma_s`"]
    );
    assert_eq!(
        world("Material \"subsurface\" \"string name\" \"Skim1\""),
        ["error: unknown medium preset \"Skim1\" | did you mean `Skin1`?"]
    );
    assert_eq!(world("Material \"measured\""), ["error: Material \"measured\" needs a `string filename`"]);
    assert_eq!(world("Material \"measured\" \"string filename\" \"no.bsdf\""), ["error: no.bsdf: no such file"]);
}

#[test]
fn media_that_cannot_be_are_told_what_is_wrong() {
    let medium = |text: &str| world(&format!("MakeNamedMedium \"m\" \"string type\" {text}"));
    assert_eq!(
        medium("\"homogeneous\" \"float g\" 1"),
        ["error: medium \"m\" (homogeneous): `g` must be between -1 and 1, not 1"]
    );
    assert_eq!(
        medium("\"homogeneous\" \"spectrum sigma_s\" [400 -2 500 -2]"),
        ["error: medium \"m\" (homogeneous): `sigma_s` is -2; it must be a finite number that is not negative"]
    );
    assert_eq!(
        medium("\"homogeneous\" \"string preset\" \"Wholmilk\""),
        ["warning: unknown medium preset \"Wholmilk\" | did you mean `Wholemilk`?"]
    );
    assert_eq!(medium("\"uniformgrid\" \"integer nx\" 2"), ["error: medium \"m\" (uniformgrid) has no `density`"]);
    assert_eq!(
        medium("\"uniformgrid\" \"integer nx\" 2 \"float density\" [1 2 3]"),
        ["error: medium \"m\" (uniformgrid): `density` has 3 values, but the grid of 2 x 1 x 1 cells needs 2"]
    );
    assert_eq!(
        medium("\"uniformgrid\" \"integer nx\" 2 \"float density\" [1 -2]"),
        [
            "error: medium \"m\" (uniformgrid): value 1 of `density` is -2; it must be a finite number that is not negative"
        ]
    );
    assert_eq!(
        medium(
            "\"uniformgrid\" \"integer nx\" 2147483647 \"integer ny\" 2147483647 \"integer nz\" 9 \"float density\" 1"
        ),
        [
            "error: medium \"m\" (uniformgrid): `density` has 1 values, but the grid of 2147483647 x 2147483647 x 9 cells needs 18446744073709551615"
        ]
    );
    assert_eq!(
        medium("\"uniformgrid\" \"float density\" 1 \"point3 p1\" [0 1 1]"),
        ["error: medium \"m\" (uniformgrid): the box of the medium is empty"]
    );
    assert_eq!(
        medium("\"uniformgrid\" \"float density\" 1 \"float temperature\" 1 \"rgb Le\" [1 1 1]"),
        ["error: a medium glows by `Le` or by `temperature`, not by both"]
    );
    assert_eq!(medium("\"rgbgrid\""), ["error: medium \"m\" (rgbgrid) has neither `sigma_a` nor `sigma_s`"]);
    assert_eq!(
        medium("\"rgbgrid\" \"rgb sigma_s\" [1 1 1] \"rgb Le\" [1 1 1]"),
        ["error: `Le` needs `sigma_a`: what does not absorb does not emit"]
    );
    assert_eq!(medium("\"nanovdb\""), ["error: medium \"m\" (nanovdb) has no `filename`"]);
    assert_eq!(medium("\"nanovdb\" \"string filename\" \"no.nvdb\""), ["error: no.nvdb: no such file"]);
    assert_eq!(
        problems("Integrator \"path\" \"integer maxdepth\" 0\nWorldBegin"),
        [
            "scene.pbrt:1:12 warning: `maxdepth` 0 shows what shines and nothing that it lights | light that is scattered once has depth 1"
        ]
    );
    assert_eq!(
        problems("Integrator \"simplevolpath\"\nWorldBegin\nLightSource \"point\""),
        [
            "scene.pbrt:1:12 error: the `simplevolpath` integrator finds lights by chance, and so never a point, spot or distant light"
        ]
    );
}

/// Notes for who asks, once for each kind.
#[test]
fn traps_are_told_by_check_alone() {
    let text = r#"
Sampler "zsobol" "integer pixelsamples" 100
Integrator "volpath" "integer maxdepth" 1
WorldBegin
LightSource "point" "blackbody I" 3000
LightSource "point" "blackbody I" 4000
LightSource "infinite" "rgb L" [ 1 1 1 ]
MakeNamedMaterial "a" "string type" "diffuse" "float displacement" 0.1
MakeNamedMaterial "b" "string type" "dielectric" "spectrum eta" "glass-BK7"
MakeNamedMaterial "c" "string type" "mix" "string materials" [ "a" "b" ] "float amount" 0.2
AreaLightSource "diffuse" "float power" 60
Shape "bilinearmesh" "point3 P" [ 0 0 0  1 0 0  0 1 0  1 1 0 ]
Shape "bilinearmesh" "point3 P" [ 0 0 0  1 0 0  1 1 0  0 1 0 ]
Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  1 1 0  0 1 0 ] "integer indices" [ 0 1 2 0 2 3 ]
"#;
    assert!(problems(text).is_empty(), "{:?}", problems(text));
    let options = LoadOptions { traps: true, ..LoadOptions::default() };
    let files = Memory::new().with("scene.pbrt", text);
    let notes = list(&load_pbrt(Input::File(Path::new("scene.pbrt")), &files, &options));
    let at = |line: u32, what: &str| {
        assert!(notes.iter().any(|n| n.starts_with(&format!("scene.pbrt:{line}:")) && n.contains(what)), "{notes:#?}");
    };
    at(2, "64 or 128 may be less noisy");
    at(3, "`maxdepth` 1 is light that is scattered once");
    at(5, "gives the colour alone");
    at(8, "moves nothing");
    at(9, "one of its four wavelengths");
    at(10, "the share of the second");
    at(13, "crosses itself");
    at(14, "all 2 together emit 2 times");
    assert_eq!(notes.len(), 8, "{notes:#?}");
    let files = Memory::new().with("scene.pbrt", "WorldBegin\n");
    let notes = list(&load_pbrt(Input::File(Path::new("scene.pbrt")), &files, &options));
    assert!(notes.is_empty(), "without `Integrator` nothing is stated: {notes:?}");
}

#[test]
fn lights_that_chance_never_finds_are_left_out_with_a_word() {
    let text = "Integrator \"randomwalk\"\nWorldBegin\nLightSource \"point\"\nLightSource \"infinite\" \"string lightgroup\" \"sky\"\n";
    let out = load_with(text, &Memory::new());
    let said = list(&out);
    assert!(
        said.len() == 1 && said[0].starts_with("scene.pbrt:1:12 warning:") && said[0].contains("1 left out"),
        "{said:?}"
    );
    let scene = out.scene.expect("a scene");
    assert_eq!((scene.lights.len(), scene.groups_of_lights.len()), (1, 1));
    let group = scene.groups_of_lights[0].expect("a group");
    assert_eq!(scene.light_groups[group].name, "sky");
}
