//! Films that keep more than red, green and blue, and integrators that say more than a picture.

mod common;

use common::{Folder, SCENE};
use steradian_image::{Image, read};

fn image(f: &Folder, name: &str) -> Image {
    read(&f.bytes(name), name).unwrap()
}

/// A sky whose radiance rises with wavelength, and nothing else: bands show it, and whatever falls outside is none of theirs.
#[test]
fn bands_show_the_spectrum_of_the_light() {
    let scene = r#"Film "spectral" "integer nbuckets" 5 "float lambdamin" 400 "float lambdamax" 700
      "integer xresolution" 6 "integer yresolution" 4
Sampler "independent" "integer pixelsamples" 64
Integrator "path"
WorldBegin
LightSource "infinite" "spectrum L" [ 360 1 830 3 ]
"#;
    let f = Folder::empty().with("s.pbrt", scene);
    f.ok("render s.pbrt -q -o a.exr");
    let a = image(&f, "a.exr");
    assert_eq!(a.metadata.text("spectralLayoutVersion"), Some("1.0"));
    let mean = |name: &str| {
        let plane = a.channel(name).unwrap_or_else(|| panic!("no {name}"));
        plane.iter().sum::<f32>() / plane.len() as f32
    };
    let bands = ["430", "490", "550", "610", "670"].map(|nm| mean(&format!("S0.{nm},000nm")));
    for (i, v) in bands.iter().enumerate() {
        // One at 360 nm, three at 830 nm, and the mean over a band is its middle.
        let expected = |i: usize| 1.0 + 2.0 * (70.0 + 60.0 * i as f32) / 470.0;
        let (ratio, wanted) = (v / bands[0], expected(i) / expected(0));
        // 1536 samples, of which each band has four fifths of one: a relative error of 0.2 %.
        assert!((ratio / wanted - 1.0).abs() < 0.015, "band {i}: {ratio}, not {wanted}");
    }
    // The parts of a picture keep them, too.
    for i in 1..=2 {
        f.ok(&format!("render s.pbrt -q --shard {i}/2 -o {i}.part"));
    }
    f.ok("merge 1.part 2.part -q -o m.exr");
    assert_eq!(f.ok("compare --exact a.exr m.exr"), "identical\n");
    let ran = f.run("render s.pbrt --integrator bdpt -o b.exr");
    assert!(ran.code == Some(2) && ran.err.contains("the `spectral` film keeps"), "{}", ran.err);
    let ran = f.run("render s.pbrt --color rgb -o b.exr");
    assert!(ran.code == Some(2) && ran.err.contains("needs wavelengths"), "{}", ran.err);
    let wrong = scene.replace("700", "900");
    let ran = f.with("w.pbrt", wrong).run("check w.pbrt");
    assert!(ran.code == Some(2) && ran.out.contains("must lie in 360 to 830 nm"), "{}{}", ran.out, ran.err);
}

/// A wall that is turned by 45 degrees about the vertical, at distance two.
#[test]
fn a_gbuffer_shows_places_normals_and_slopes() {
    let scene = |system: &str| {
        format!(
            r#"Film "gbuffer" "integer xresolution" 20 "integer yresolution" 20 "string coordinatesystem" "{system}"
PixelFilter "box"
Sampler "stratified" "integer xsamples" 4 "integer ysamples" 4
LookAt 0 0 -1  0 0 0  0 1 0
Camera "perspective" "float fov" 10
WorldBegin
LightSource "distant" "point3 from" [ 0 0 -5 ]
Translate 0 0 1
Rotate 45 0 1 0
Material "diffuse" "rgb reflectance" [ 0.2 0.4 0.6 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
"#
        )
    };
    let f = Folder::empty().with("c.pbrt", scene("camera")).with("w.pbrt", scene("world"));
    for (name, z) in [("c", 2.0), ("w", 1.0)] {
        f.ok(&format!("render {name}.pbrt -q -o {name}.exr"));
        let a = image(&f, &format!("{name}.exr"));
        // The four pixels in the middle.
        let middle = |channel: &str| {
            let plane = a.channel(channel).unwrap_or_else(|| panic!("no {channel}"));
            [189, 190, 209, 210].iter().map(|&i| plane[i]).sum::<f32>() / 4.0
        };
        let near = |channel: &str, wanted: f32| {
            assert!((middle(channel) - wanted).abs() < 0.01, "{name} {channel}: {} not {wanted}", middle(channel));
        };
        for (channel, wanted) in [("Albedo.R", 0.2), ("Albedo.G", 0.4), ("Albedo.B", 0.6), ("P.X", 0.0), ("P.Z", z)] {
            near(channel, wanted);
        }
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert!((middle("N.X").abs() - half).abs() < 1e-3 && (middle("N.Z") + half).abs() < 1e-3);
        near("Ns.Z", -half);
        near("u", 0.5);
        near("v", 0.5);
        // A pixel is 2 tan 5 degrees / 20 wide at distance one, and the wall goes back as far as it goes aside.
        let pixel = 2.0 * 2.0 * steradian_math::tan(5f32.to_radians()) / 20.0;
        assert!((middle("dzdx") / pixel - 1.0).abs() < 0.05, "{} {pixel}", middle("dzdx"));
        near("dzdy", 0.0);
        assert!(middle("Variance.G") >= 0.0 && a.channel("RelativeVariance.B").is_some());
        for i in 1..=2 {
            f.ok(&format!("render {name}.pbrt -q --shard {i}/2 -o {i}.part"));
        }
        f.ok("merge 1.part 2.part -q -o m.exr");
        assert_eq!(f.ok(&format!("compare --exact {name}.exr m.exr")), "identical\n");
    }
}

#[test]
fn functions_measure_samplers() {
    let f = Folder::empty();
    let mut errors = Vec::new();
    for (sampler, integral) in [("independent", "step"), ("paddedsobol", "step"), ("paddedsobol", "gaussian")] {
        let scene = format!(
            r#"Film "rgb" "integer xresolution" 32 "integer yresolution" 32
Sampler "{sampler}" "integer pixelsamples" 64
Integrator "function" "string function" "{integral}" "string filename" "errors.txt"
WorldBegin
"#
        );
        std::fs::write(f.path("s.pbrt"), scene).unwrap();
        f.ok("render s.pbrt -q -o a.exr");
        let text = String::from_utf8(f.bytes("errors.txt")).unwrap();
        let rows: Vec<(u32, f64)> = text
            .lines()
            .map(|l| l.split_once(", ").map(|(n, e)| (n.parse().unwrap(), e.parse().unwrap())).unwrap())
            .collect();
        assert_eq!(rows.iter().map(|r| r.0).collect::<Vec<_>>(), [1, 2, 4, 8, 16, 32, 48, 64]);
        errors.push(rows);
    }
    // The variance of one sample of a step is one; over 1024 pixels its relative error is a few per cent.
    for (n, e) in &errors[0] {
        assert!((e * f64::from(*n) - 1.0).abs() < 0.3, "{n}: {e}");
    }
    // Halves of the square get exactly half of the points.
    assert!(
        errors[1].iter().filter(|(n, _)| n.is_power_of_two() && *n > 1).all(|(_, e)| *e < 1e-10),
        "{:?}",
        errors[1]
    );
    assert!(errors[2].last().unwrap().1 < 1e-3);
}

/// Photons and chains from outside: they render, they cut up, and what makes no sense is said.
#[test]
fn photons_and_chains_render_and_merge() {
    let integrators = [
        (r#"Integrator "sppm" "float radius" 0.2 "integer photonsperiteration" 500"#, "sppm"),
        (
            r#"Integrator "mlt" "integer bootstrapsamples" 500 "integer chains" 20 "integer mutationsperpixel" 16"#,
            "mlt",
        ),
    ];
    for (directive, name) in integrators {
        let scene = SCENE.replace("Integrator \"path\"", directive);
        let f = Folder::empty().with("s.pbrt", &scene);
        f.ok("render s.pbrt -q --sampler paddedsobol --spp 16 -o a.exr");
        assert!(image(&f, "a.exr").channel("G").unwrap().iter().sum::<f32>() > 1.0);
        assert_eq!(image(&f, "a.exr").metadata.text("steradian.biased"), (name == "sppm").then_some("sppm"));
        for i in 1..=3 {
            f.ok(&format!("render s.pbrt -q --sampler paddedsobol --spp 16 --threads {i} --shard {i}/3 -o {i}.part"));
        }
        f.ok("merge 1.part 2.part 3.part -q -o m.exr");
        assert_eq!(f.ok("compare --exact a.exr m.exr"), "identical\n", "{name}");
        f.ok("render s.pbrt -q --sampler paddedsobol --spp 5 --checkpoint c -o b.exr");
        f.ok("render s.pbrt -q --sampler paddedsobol --spp 16 --checkpoint c --resume -o b.exr");
        assert_eq!(f.ok("compare --exact a.exr b.exr"), "identical\n", "{name}");
        let ran = f.run("render s.pbrt --adaptive error -o x.exr");
        assert!(ran.code == Some(2) && ran.err.contains("bring light to all pixels alike"), "{}", ran.err);
        if name == "mlt" {
            let ran = f.run("render s.pbrt --error 5% -o x.exr");
            assert!(ran.code == Some(2) && ran.err.contains("no independent samples"), "{}", ran.err);
            let ran = f.run("trace s.pbrt --pixel 3,3 --sample 0");
            assert!(ran.code == Some(2) && ran.err.contains("belong to no pixel"), "{}", ran.err);
        } else {
            assert!(f.ok("trace s.pbrt --pixel 3,9 --sample 2").contains("pixel 3,9, sample 2"));
        }
    }
    for (wrong, said) in [
        (r#"Integrator "sppm" "float radius" -1"#, "`radius` must be positive"),
        (r#"Integrator "sppm" "integer photonsperiteration" 2000000000"#, "must be from 1 to 16777216"),
        (r#"Integrator "mlt" "integer chains" 0"#, "`chains`"),
        (r#"Integrator "mlt" "float sigma" 0"#, "sigma is 0"),
        (r#"Integrator "function" "string function" "steps""#, "steps"),
    ] {
        let f = Folder::empty().with("s.pbrt", SCENE.replace("Integrator \"path\" \"integer maxdepth\" [ 4 ]", wrong));
        let ran = f.run("render s.pbrt -o a.exr");
        assert!(ran.code == Some(2) && (ran.err.clone() + &ran.out).contains(said), "{wrong}: {}{}", ran.err, ran.out);
    }
}
