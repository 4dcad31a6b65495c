//! `--max-memory`: pictures go to a scratch file before anything is refused, and no bit of the render changes.

mod common;

use common::{Folder, SCENE};
use steradian_image::{Image, WriteOptions, write_file};

#[test]
fn pictures_go_to_a_scratch_file_and_the_render_stays_the_same() {
    let f = Folder::empty().with(
        "s.pbrt",
        SCENE.replace(
            "Material \"diffuse\" \"rgb reflectance\" [ 0.7 0.5 0.3 ]",
            "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"t.exr\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"",
        ),
    );
    let pixels: Vec<_> = (0..700 * 300).map(|i| [(i % 7) as f32 / 7.0, (i % 700) as f32 / 700.0, 0.5]).collect();
    let picture = Image::from_rgb(700, 300, &pixels).unwrap();
    write_file(&picture, &f.path("t.exr"), &WriteOptions::default()).unwrap();
    f.ok("render s.pbrt -q -o free.exr");
    let ran = f.run("render s.pbrt --max-memory 2M --scratch . -o tight.exr");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let said = "with their smaller copies, are kept in a file in ., from which the system reads what is looked at";
    assert!(ran.err.contains(said), "{}", ran.err);
    assert_eq!(f.ok("compare --exact free.exr tight.exr"), "identical\n");
    assert_eq!(f.list(), ["free.exr", "s.pbrt", "t.exr", "tight.exr"], "nothing is left behind");

    let ran = f.run("render s.pbrt --max-memory 64M -o b.exr");
    assert!(ran.code == Some(0) && !ran.err.contains("smaller copies"), "{}", ran.err);
    let ran = f.run("render s.pbrt --max-memory 2M --scratch nowhere -o b.exr");
    assert_eq!(ran.code, Some(3));
    assert!(ran.err.contains("no scratch file can be made in nowhere"), "{}", ran.err);
    let ran = f.run("render s.pbrt --max-memory 2M --size 4000x3000 -o b.exr");
    assert_eq!(ran.code, Some(2));
    assert!(ran.err.contains("more than --max-memory 2.0 MiB"), "{}", ran.err);
}
