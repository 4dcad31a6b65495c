//! Scenes written as pbrt-v4 are read as what they were.

use std::path::Path;
use steradian_load::{Exported, Input, LoadOptions, Memory, load, to_pbrt};
use steradian_scene::{Scene, World};

const SCENE: &str = r#"
LookAt 0 1 5  0 0 0  0 1 0
Camera "perspective" "float fov" 35 "float lensradius" 0.02 "float focaldistance" 4
Film "rgb" "integer xresolution" 40 "integer yresolution" 30 "string filename" "a.exr"
PixelFilter "mitchell" "float xradius" 2 "float yradius" 2
Sampler "halton" "integer pixelsamples" 9
Integrator "volpath" "integer maxdepth" 7
WorldBegin
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ 0.1 0.2 0.3 ] "rgb sigma_s" [ 1 1 1 ] "float g" 0.4
LightSource "infinite" "rgb L" [ 0.1 0.2 0.3 ]
AttributeBegin
  Translate 1 2 3
  LightSource "spot" "point3 from" [ 0 1 0 ] "point3 to" [ 0 0 0 ] "spectrum I" [ 300 1 900 2 ] "float coneangle" 20
AttributeEnd
AttributeBegin
  Translate 0 3 0
  AreaLightSource "diffuse" "blackbody L" 3000 "float scale" 2 "bool twosided" true
  Shape "disk" "float radius" 0.5
AttributeEnd
Texture "squares" "spectrum" "checkerboard" "rgb tex1" [ 0.8 0.2 0.1 ] "rgb tex2" [ 0.1 0.1 0.1 ] "float uscale" 4
Texture "holes" "float" "checkerboard" "float tex1" 1 "float tex2" 0
Material "diffuse" "texture reflectance" "squares"
Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  1 1 0  0 1 0 ] "integer indices" [ 0 1 2  0 2 3 ]
  "point2 uv" [ 0 0  1 0  1 1  0 1 ] "texture alpha" "holes"
Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.2
ReverseOrientation
Shape "sphere" "float radius" 0.5 "float zmin" -0.2
AttributeBegin
  MediumInterface "fog" ""
  Material "interface"
  Shape "sphere"
AttributeEnd
Material "dielectric" "float eta" 1.4
ObjectBegin "thing"
  Material "coateddiffuse" "rgb reflectance" [ 0.2 0.3 0.9 ] "float roughness" 0.1
  Shape "cylinder" "float zmax" 2
  Shape "bilinearmesh" "point3 P" [ 0 0 0  1 0 0  0 1 0  1 1 1 ]
ObjectEnd
AttributeBegin
  Rotate 30 0 1 0
  ObjectInstance "thing"
AttributeEnd
"#;

fn read(text: &str, files: &[(String, Vec<u8>)]) -> Scene {
    let memory = files.iter().fold(Memory::new(), |m, (name, bytes)| m.with(name.as_str(), bytes.clone()));
    let input = Input::Text { name: "scene.pbrt", text, directory: Path::new("") };
    let outcome = load(input, &memory, &LoadOptions::default());
    let said: Vec<String> = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
    assert!(said.is_empty(), "{said:?}\n{text}");
    outcome.scene.unwrap()
}

/// A text without the numbers of its spectra, whose corners may move by rounding.
fn without_spectra(text: &str) -> String {
    let mut parts = text.split("\"spectrum ");
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |out, part| out + "\"spectrum " + part.split_once(']').map_or(part, |p| p.1))
}

/// The same words, and numbers within rounding.
fn same(a: &Exported, b: &Exported) {
    let words = |e: &Exported| without_spectra(&e.text).split_ascii_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let (x, y) = (words(a), words(b));
    assert_eq!(x.len(), y.len(), "{}\n----\n{}", a.text, b.text);
    for (u, v) in x.iter().zip(&y) {
        match (u.parse::<f32>(), v.parse::<f32>()) {
            (Ok(u), Ok(v)) => assert!((u - v).abs() <= 2e-5 * u.abs().max(1.0), "{u} {v}"),
            _ => assert_eq!(u, v),
        }
    }
    assert_eq!(a.files, b.files);
}

#[test]
fn what_is_written_is_read_as_what_it_was() {
    let first = read(SCENE, &[]);
    let written = to_pbrt(&first, "parts").unwrap();
    assert_eq!(written.notes, Vec::<String>::new());
    let again = read(&written.text, &written.files);
    assert_eq!(first.settings.film.resolution, again.settings.film.resolution);
    assert_eq!(first.settings.sampler.spp, again.settings.sampler.spp);
    assert_eq!(first.settings.integrator.max_depth, again.settings.integrator.max_depth);
    assert_eq!((first.primitives.len(), first.lights.len()), (again.primitives.len(), again.lights.len()));
    let mesh = |s: &Scene| s.triangle_meshes.iter().next().cloned().unwrap();
    assert_eq!(mesh(&first).positions, mesh(&again).positions);
    same(&written, &to_pbrt(&again, "parts").unwrap());
    World::build(again).unwrap();
}

#[test]
fn what_pbrt_cannot_say_is_noted() {
    let text = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"/></sensor>
        <shape type="sphere"><bsdf type="roughconductor"/></shape><emitter type="spot"/></scene>"#;
    let files = Memory::new().with("a.xml", text);
    let scene = load(Input::File(Path::new("a.xml")), &files, &LoadOptions::default()).scene.unwrap();
    let written = to_pbrt(&scene, "parts").unwrap();
    let notes = written.notes.join("; ");
    for word in ["backs that are black", "microfacets of Mitsuba", "spots of Mitsuba"] {
        assert!(notes.contains(word), "{notes}");
    }
    read(&written.text, &written.files);
}

const PARTS: &str = r#"
Camera "perspective"
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LightSource "goniometric" "string filename" "square.pfm" "rgb I" [ 1 2 3 ] "float scale" 3
LightSource "projection" "string filename" "square.pfm" "float fov" 40
Rotate 30 1 2 3
LightSource "infinite" "string filename" "square.pfm" "float scale" 0.5
MakeNamedMedium "grid" "string type" "uniformgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [ 1 0.5 ]
MakeNamedMedium "cloud" "string type" "cloud" "float density" 2
MakeNamedMedium "ember" "string type" "uniformgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [ 1 0.5 ] "rgb Le" [ 3 2 1 ] "float Lescale" [ 0 4 ]
MakeNamedMedium "coal" "string type" "uniformgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [ 1 0.5 ] "rgb Le" [ 3 2 1 ]
MakeNamedMedium "flame" "string type" "uniformgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [ 1 0.5 ] "float temperature" [ 900 3000 ] "float temperatureoffset" 100 "float Lescale" [ 1 2 ]
Texture "dots" "spectrum" "dots" "rgb inside" [ 1 0 0 ] "rgb outside" [ 0 0 1 ] "string mapping" "planar" "vector3 v1" [ 2 0 0 ]
Texture "noise" "float" "fbm" "integer octaves" 3
Texture "picture" "spectrum" "imagemap" "string filename" "square.pfm" "string wrap" "clamp" "float vscale" -2
AttributeBegin
  MediumInterface "grid" "cloud"
  Material "mix" "string materials" [ "a" "b" ] "float amount" 0.25
AttributeEnd
MakeNamedMaterial "a" "string type" "diffuse" "texture reflectance" "dots" "texture displacement" "noise"
MakeNamedMaterial "b" "string type" "coatedconductor" "rgb reflectance" [ 0.9 0.5 0.2 ] "float conductor.roughness" 0.3
MakeNamedMaterial "c" "string type" "mix" "string materials" [ "a" "b" ] "texture amount" "noise"
MakeNamedMaterial "d" "string type" "diffuse" "texture reflectance" "picture" "string normalmap" "square.pfm"
NamedMaterial "c"
Shape "disk" "float innerradius" 0.25
NamedMaterial "d"
Shape "curve" "point3 P" [ 0 0 0  1 0 0  1 1 0  2 1 0 ] "string type" "cylinder"
Material "hair" "float eumelanin" 0.5
Shape "curve" "point3 P" [ 0 0 0  1 0 0  1 1 0  2 1 0 ]
AttributeBegin
  ActiveTransform EndTime
  Translate 0 0 1
  ActiveTransform All
  Material "subsurface" "string name" "Marble"
  Shape "sphere"
AttributeEnd
"#;

#[test]
fn lights_media_and_textures_are_written_as_they_are_read() {
    let text = PARTS.replace(
        "  Material \"mix\" \"string materials\" [ \"a\" \"b\" ] \"float amount\" 0.25\n",
        "  Shape \"sphere\"\n",
    );
    let mut pfm = b"PF\n2 2\n-1.0\n".to_vec();
    (0..12).for_each(|i| pfm.extend((0.25 + i as f32 / 16.0).to_le_bytes()));
    let first = read(&text, &[("square.pfm".into(), pfm)]);
    let written = to_pbrt(&first, "parts").unwrap();
    assert_eq!(written.notes, Vec::<String>::new());
    let again = read(&written.text, &written.files);
    assert_eq!((first.lights.len(), first.media.len()), (again.lights.len(), again.media.len()));
    let (a, b) = (&first.images.as_slice()[0].texels, &again.images.as_slice()[0].texels);
    assert_eq!(
        (0..12).map(|i| a.texel(i % 2, i / 2 % 2, i / 4) == b.texel(i % 2, i / 2 % 2, i / 4)).filter(|s| !s).count(),
        0
    );
    same(&written, &to_pbrt(&again, "parts").unwrap());
    World::build(again).unwrap();
}

#[test]
fn layered_surfaces_keep_their_textures_and_the_opacity_of_vertices() {
    let obj = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
    let mtl = "newmtl m\nKd 0.9 0.9 0.9\nPr 0.9\nmap_Kd a.pfm\n";
    let mut pfm = b"PF\n1 1\n-1.0\n".to_vec();
    [0.5f32, 0.25, 0.125].iter().for_each(|v| pfm.extend(v.to_le_bytes()));
    let files = Memory::new().with("a.obj", obj).with("a.mtl", mtl).with("a.pfm", pfm);
    let scene = load(Input::File(Path::new("a.obj")), &files, &LoadOptions::default()).scene.unwrap();
    let written = to_pbrt(&scene, "a-files").unwrap();
    // The ground thins out by the opacity of its vertices, which stands in its texture coordinates.
    assert!(written.text.contains("\"texture alpha\""), "{}", written.text);
    assert!(!written.notes.iter().any(|n| n.contains("vertices")), "{:?}", written.notes);
    let again = read(&written.text, &written.files);
    let colours: Vec<_> = again.images.iter().filter(|i| i.texels.width() == 1).collect();
    // Half floats hold these numbers exactly.
    assert!(colours.iter().any(|i| [0, 1, 2].map(|c| i.texels.texel(0, 0, c)) == [0.5, 0.25, 0.125]));
    World::build(again).unwrap();
}

#[test]
fn instances_in_instances_that_have_no_end_are_refused() {
    let mut text = "WorldBegin\nObjectBegin \"0\"\nShape \"sphere\"\nObjectEnd\n".to_string();
    for i in 1..=40 {
        let inner = format!("ObjectInstance \"{}\"\n", i - 1);
        text += &format!("ObjectBegin \"{i}\"\n{inner}{inner}ObjectEnd\n");
    }
    text += "ObjectInstance \"40\"\n";
    let memory = Memory::new();
    let input = Input::Text { name: "scene.pbrt", text: &text, directory: Path::new("") };
    let scene = load(input, &memory, &LoadOptions::default()).scene.unwrap();
    assert!(to_pbrt(&scene, "parts").is_err_and(|e| e.contains("instances inside of instances")));
}
