//! Materials that are made of others, seen from outside.

mod common;

use common::Folder;
use steradian_image::read;

/// A wall that fills the view, lit from everywhere by light of one, once: what is seen is what it reflects.
fn seen(head: &str, materials: &str, light: &str) -> [f64; 3] {
    let scene = format!(
        r#"{head}
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
Sampler "paddedsobol" "integer pixelsamples" 64
Integrator "path" "integer maxdepth" 1
Camera "perspective" "float fov" 30
WorldBegin
LightSource {light}
{materials}
Translate 0 0 2
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
"#
    );
    let f = Folder::empty().with("s.pbrt", &scene);
    f.ok("render s.pbrt -q --color rgb -o a.exr");
    let a = read(&f.bytes("a.exr"), "a.exr").unwrap();
    let planes = a.planes("").unwrap();
    planes.map(|p| p.iter().map(|&v| f64::from(v)).sum::<f64>() / p.len() as f64)
}

const SKY: &str = "\"infinite\" \"rgb L\" [ 1 1 1 ]";

/// 65536 samples, each of which sees one of the materials: the standard error is below 0.002, and six of them 0.012.
#[test]
fn mixtures_of_mixtures() {
    let parts = r#"MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [ 0.8 0 0 ]
MakeNamedMaterial "green" "string type" "diffuse" "rgb reflectance" [ 0 0.8 0 ]
MakeNamedMaterial "blue" "string type" "diffuse" "rgb reflectance" [ 0 0 0.8 ]
MakeNamedMaterial "warm" "string type" "mix" "string materials" [ "red" "green" ] "float amount" 0.25
MakeNamedMaterial "all" "string type" "mix" "string materials" [ "warm" "blue" ] "float amount" 0.5
MakeNamedMaterial "deep" "string type" "mix" "string materials" [ "all" "all" ] "float amount" 0.3
"#;
    for name in ["all", "deep"] {
        let found = seen("", &format!("{parts}NamedMaterial \"{name}\""), SKY);
        // The amount is the share of the second material.
        for (v, wanted) in found.into_iter().zip([0.8 * 0.75 * 0.5, 0.8 * 0.25 * 0.5, 0.8 * 0.5]) {
            assert!((v - wanted).abs() < 0.012, "{name}: {found:?}");
        }
    }
}

/// Any surface becomes a diffuse one that reflects as much light: a polished metal under a lamp from the side, which it does not mirror
/// to the eye, is then as bright as a wall of its colour.
#[test]
fn every_surface_can_be_forced_to_be_diffuse() {
    let metal = "Material \"conductor\" \"rgb reflectance\" [ 0.8 0.5 0.2 ]";
    let lamp = "\"distant\" \"rgb L\" [ 1 1 1 ] \"point3 from\" [ 1 0 -1 ] \"point3 to\" [ 0 0 0 ]";
    assert_eq!(seen("", metal, lamp), [0.0; 3], "a mirror shows the lamp elsewhere");
    let found = seen("Option \"forcediffuse\" true", metal, lamp);
    let wanted = seen("", &metal.replace("conductor", "diffuse"), lamp);
    for (v, wanted) in found.into_iter().zip(wanted) {
        assert!(wanted > 0.01 && (v / wanted - 1.0).abs() < 0.05, "{found:?} {wanted}");
    }
}
