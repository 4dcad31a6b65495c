//! Did anything change? Hashes of small pictures. They are allowed to change, knowingly: a change that says why it changes the
//! picture changes them here (run the test: it prints the new ones).

const HEAD: &str = r#"
LookAt 0 1 -4   0 0.6 0   0 1 0
Camera "perspective" "float fov" 36 "float lensradius" 0.02 "float focaldistance" 4
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
Sampler "paddedsobol" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 6
WorldBegin
LightSource "infinite" "rgb L" [0.3 0.35 0.4]
AttributeBegin
  Translate 0 3 0
  AreaLightSource "diffuse" "rgb L" [10 9 8]
  Shape "trianglemesh" "point3 P" [-0.5 0 -0.5  0.5 0 -0.5  0.5 0 0.5  -0.5 0 0.5] "integer indices" [0 1 2 0 2 3]
AttributeEnd
Texture "check" "spectrum" "checkerboard" "rgb tex1" [0.8 0.7 0.6] "rgb tex2" [0.2 0.2 0.3] "float uscale" 8 "float vscale" 8
"#;

/// The hash of the picture's bits in one scene.
fn hash(body: &str, color: steradian_spectrum::ColorMode) -> String {
    let text = format!("{HEAD}{body}");
    let mut scene = steradian::load_text("golden.pbrt", &text).unwrap_or_else(|e| panic!("{e}"));
    scene.settings.color = color;
    let image = steradian::render(scene).unwrap_or_else(|e| panic!("{e}"));
    let bytes: Vec<u8> = image.rgb().expect("colours").iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    blake3::hash(&bytes).to_hex()[..16].to_owned()
}

const FLOOR: &str = r#"
Material "diffuse" "texture reflectance" "check"
Shape "bilinearmesh" "point3 P" [-4 0 -4  4 0 -4  -4 0 4  4 0 4] "point2 uv" [0 0 1 0 0 1 1 1]
"#;

fn ball(material: &str) -> String {
    format!(
        "{FLOOR}\nAttributeBegin\nTranslate 0 0.7 0\n{material}\nShape \"sphere\" \"float radius\" 0.7\nAttributeEnd\n"
    )
}

#[test]
fn pictures_have_the_bits_they_had() {
    use steradian_spectrum::ColorMode::{Rgb, Spectral};
    let scenes = [
        ("diffuse", ball(r#"Material "diffuse" "rgb reflectance" [0.7 0.2 0.1]"#)),
        ("gold", ball(r#"Material "conductor" "float roughness" 0.1"#)),
        ("glass", ball(r#"Material "dielectric""#)),
        ("frosted", ball(r#"Material "dielectric" "float roughness" 0.2"#)),
        ("coated", ball(r#"Material "coateddiffuse" "rgb reflectance" [0.1 0.3 0.6] "float roughness" 0.05"#)),
        ("dispersive", ball(r#"Material "dielectric" "spectrum eta" "glass-SF11""#)),
    ];
    let found: Vec<String> =
        scenes.iter().map(|(name, body)| format!("{name} {} {}", hash(body, Rgb), hash(body, Spectral))).collect();
    let expected = include_str!("golden.txt");
    assert!(
        found.join("\n") == expected.trim_end(),
        "the pictures have changed; golden.txt would now be:\n{}",
        found.join("\n")
    );
}
