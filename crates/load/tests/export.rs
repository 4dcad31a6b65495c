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

/// The same words, and numbers within rounding.
fn same(a: &Exported, b: &Exported) {
    let words = |e: &Exported| e.text.split_ascii_whitespace().map(str::to_owned).collect::<Vec<_>>();
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
    let written = to_pbrt(&first, "parts");
    assert_eq!(written.notes, Vec::<String>::new());
    let again = read(&written.text, &written.files);
    assert_eq!(first.settings.film.resolution, again.settings.film.resolution);
    assert_eq!(first.settings.sampler.spp, again.settings.sampler.spp);
    assert_eq!(first.settings.integrator.max_depth, again.settings.integrator.max_depth);
    assert_eq!((first.primitives.len(), first.lights.len()), (again.primitives.len(), again.lights.len()));
    let mesh = |s: &Scene| s.triangle_meshes.iter().next().cloned().unwrap();
    assert_eq!(mesh(&first).positions, mesh(&again).positions);
    same(&written, &to_pbrt(&again, "parts"));
    World::build(again).unwrap();
}

#[test]
fn what_pbrt_cannot_say_is_noted() {
    let text = r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"/></sensor>
        <shape type="sphere"><bsdf type="roughconductor"/></shape><emitter type="spot"/></scene>"#;
    let files = Memory::new().with("a.xml", text);
    let scene = load(Input::File(Path::new("a.xml")), &files, &LoadOptions::default()).scene.unwrap();
    let written = to_pbrt(&scene, "parts");
    let notes = written.notes.join("; ");
    for word in ["backs that are black", "microfacets of Mitsuba", "spots of Mitsuba"] {
        assert!(notes.contains(word), "{notes}");
    }
    read(&written.text, &written.files);
}
