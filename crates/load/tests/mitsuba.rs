//! Mitsuba scenes: plugins become what they stand for, and what is wrong has its line.

use std::path::Path;
use steradian_image::Wrap;
use steradian_load::{Input, LoadOptions, LoadOutcome, Memory, ModelOptions, load};
use steradian_math::{Point3, Ray, Vec3};
use steradian_scene::{Field, IntegratorKind, Light, Phase, Scattering, Scene, Slopes, Tilt, Volume, World};
use steradian_spectrum::Wavelengths;

const SCENE: &str = r#"<scene version="3.0.0">
    <default name="spp" value="16"/>
    <default name="depth" value="5"/>
    <integrator type="path"><integer name="max_depth" value="$depth"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 1, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="40"/><integer name="height" value="20"/>
            <rfilter type="tent"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    </sensor>
    <bsdf type="twosided" id="paint"><bsdf type="diffuse"><rgb name="reflectance" value="0.8 0.2 0.1"/></bsdf></bsdf>
    <shape type="sphere"><ref id="paint"/></shape>
    <shape type="rectangle">
        <transform name="to_world"><scale value="0.5"/><translate y="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="10"/></emitter>
    </shape>
    <emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>
</scene>"#;

fn load_text(text: &str, defines: &[(&str, &str)]) -> LoadOutcome {
    let files = Memory::new().with("s/scene.xml", text).with("outside.xml", "<scene/>");
    let defines = defines.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
    let model = ModelOptions { defines, ..ModelOptions::default() };
    let options = LoadOptions { model, ..LoadOptions::default() };
    load(Input::File(Path::new("s/scene.xml")), &files, &options)
}

fn scene(text: &str) -> Scene {
    let outcome = load_text(text, &[]);
    let said: Vec<String> = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
    outcome.scene.unwrap_or_else(|| panic!("{said:?}"))
}

fn said(text: &str) -> String {
    let outcome = load_text(text, &[]);
    assert!(outcome.scene.is_none(), "a scene in spite of errors");
    outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect()
}

#[test]
fn a_small_scene_is_what_it_says() {
    let s = scene(SCENE);
    assert_eq!(s.settings.film.resolution, [40, 20]);
    assert_eq!((s.settings.sampler.spp, s.settings.integrator.max_depth), (16, 4));
    assert_eq!(s.settings.integrator.kind, IntegratorKind::Path);
    assert_eq!(s.primitives.len(), 2);
    assert!(s.primitives[1].area_light.is_some());
    assert!(matches!(s.lights[0], Light::UniformInfinite { .. }));
    // 40 degrees across 40 pixels are fewer across 20.
    let steradian_scene::Projection::Perspective { fov } = s.camera.projection else { panic!("no perspective") };
    assert!((fov - 20.63).abs() < 0.1, "{fov}");
    World::build(s).unwrap();
}

#[test]
fn what_an_integrator_does_otherwise_is_said() {
    let with = |integrator: &str| {
        let text = SCENE
            .replace(r#"<integrator type="path"><integer name="max_depth" value="$depth"/></integrator>"#, integrator);
        assert_ne!(text, SCENE);
        let outcome = load_text(&text, &[]);
        let said: String = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
        (outcome.scene.expect(&said).settings.integrator.max_depth, said)
    };
    let (depth, said) = with(r#"<integrator type="ptracer"><integer name="max_depth" value="3"/></integrator>"#);
    assert!(depth == 2 && said.contains("`--integrator lightpath`"), "{said}");
    let (depth, said) = with(
        r#"<integrator type="moment"><integrator type="path"><integer name="max_depth" value="4"/></integrator></integrator>"#,
    );
    assert!(depth == 3 && said.contains("`--variance`"), "{said}");
}

#[test]
fn variables_of_the_command_line_win() {
    let outcome = load_text(SCENE, &[("spp", "3")]);
    assert_eq!(outcome.scene.unwrap().settings.sampler.spp, 3);
    assert!(said(&SCENE.replace("<default name=\"spp\" value=\"16\"/>", "")).contains("`$spp` has no value"));
}

#[test]
fn what_is_wrong_has_its_line() {
    let cases = [
        ("type=\"sphere\"", "type=\"spheer\"", "the shape `spheer` is not built", "scene.xml:15:"),
        ("<ref id=\"paint\"/>", "<ref id=\"pain\"/>", "nothing has the id `pain`", "scene.xml:15:"),
        ("</sensor>", "</senso>", "not XML", "scene.xml:13:"),
        ("value=\"0.8 0.2 0.1\"", "value=\"0.8 0.2\"", "is no rgb", "scene.xml:14:"),
        ("<scale value=\"0.5\"/>", "<scale value=\"0\"/>", "a transform that cannot be", "scene.xml:17:"),
        (
            "<emitter type=\"constant\">",
            "<include filename=\"../outside.xml\"/><emitter type=\"constant\">",
            "outside",
            "scene.xml:20:",
        ),
    ];
    for (from, to, words, place) in cases {
        let text = said(&SCENE.replacen(from, to, 1));
        assert!(text.contains(words) && text.contains(place), "{to}: {text}");
    }
}

#[test]
fn old_names_are_understood_in_old_scenes() {
    let old = SCENE.replace("3.0.0", "0.6.0").replace("max_depth", "maxDepth").replace("to_world", "toWorld");
    assert_eq!(scene(&old).settings.integrator.max_depth, 4);
}

#[test]
fn materials_become_what_they_are() {
    type Is = fn(&Scattering) -> bool;
    let kinds: &[(&str, Is)] = &[
        (r#"<bsdf type="dielectric"><string name="int_ior" value="bk7"/></bsdf>"#, |s| {
            matches!(s, Scattering::Altered { .. })
        }),
        (r#"<bsdf type="roughconductor"><string name="material" value="Au"/></bsdf>"#, |s| {
            matches!(s, Scattering::Altered { slopes: Slopes::Beckmann, .. })
        }),
        (r#"<bsdf type="plastic"/>"#, |s| matches!(s, Scattering::Plastic(_))),
        (r#"<bsdf type="principled"><float name="metallic" value="1"/></bsdf>"#, |s| {
            matches!(s, Scattering::Principled(_))
        }),
        (r#"<bsdf type="null"/>"#, |s| matches!(s, Scattering::Interface)),
        (r#"<bsdf type="blendbsdf"><bsdf type="diffuse"/><bsdf type="conductor"/></bsdf>"#, |s| {
            matches!(s, Scattering::Mix { .. })
        }),
    ];
    for (bsdf, is) in kinds {
        let s = scene(&SCENE.replace("<ref id=\"paint\"/>", bsdf));
        let worn = &s.materials[s.primitives[0].material].scattering;
        let front = match worn {
            Scattering::Sides { front, .. } => &s.materials[*front].scattering,
            other => other,
        };
        assert!(is(front), "{bsdf}");
        let opaque = !bsdf.contains("dielectric") && !bsdf.contains("null") && !bsdf.contains("principled");
        assert_eq!(matches!(worn, Scattering::Sides { .. }), opaque, "{bsdf}");
    }
}

#[test]
fn hair_grows_on_curves_and_merged_shapes_are_the_shapes() {
    let merged = r#"<shape type="merge"><shape type="cube"/><shape type="bsplinecurve"><string name="filename" value="a.txt"/>
        <bsdf type="hair"><float name="eumelanin" value="0.4"/></bsdf></shape></shape></scene>"#;
    let curves = "0 0 0 0.1\n1 0 0 0.1\n2 0 0 0.1\n3 0 0 0.1\n4 0 0 0.1\n\n0 1 0 1\n1 1 0 1\n2 1 0 1\n3 1 0 1\n";
    let load_with = |curves: &str| {
        let text = SCENE.replace("</scene>", merged);
        let files = Memory::new().with("s/scene.xml", text).with("s/a.txt", curves);
        load(Input::File(Path::new("s/scene.xml")), &files, &LoadOptions::default())
    };
    let s = load_with(curves).scene.unwrap();
    assert_eq!(s.primitives.len(), 4);
    let steradian_scene::Shape::Curves(curves) = &s.primitives[3].shape else { panic!("no curves") };
    // Two segments of five points, one of four; a uniform spline keeps even distances and radii.
    let ends: Vec<_> =
        curves.iter().map(|c| (c.parameters().0[0].x, c.parameters().0[3].x, c.parameters().1)).collect();
    for (found, expected) in ends.iter().zip([(1.0, 2.0, [0.2; 2]), (2.0, 3.0, [0.2; 2]), (1.0, 2.0, [2.0; 2])]) {
        let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
        assert!(near(found.0, expected.0) && near(found.1, expected.1) && near(found.2[1], expected.2[1]), "{ends:?}");
    }
    assert!(matches!(s.materials[s.primitives[3].material].scattering, Scattering::Hair { .. }));
    World::build(s).unwrap();
    for (bad, words) in [("0 0 0 1\n", "takes 4"), ("0 0 x 1\n", "line 1"), ("", "no curves"), ("0 0 0 -1", "line 1")] {
        let outcome = load_with(bad);
        let said: String = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
        assert!(outcome.scene.is_none() && said.contains(words), "{bad}: {said}");
    }
}

#[test]
fn spectra_of_emitters_keep_their_strength() {
    let of = |radiance: &str| {
        let s = scene(&SCENE.replace(r#"<rgb name="radiance" value="0.1"/>"#, radiance));
        let Light::UniformInfinite { radiance, scale } = &s.lights[0] else { panic!("{:?}", s.lights) };
        radiance.luminance() * scale
    };
    // A colour, a number and an even spectrum of one: each as bright as white is.
    for text in [
        r#"<rgb name="radiance" value="1"/>"#,
        r#"<float name="radiance" value="1"/>"#,
        r#"<spectrum name="radiance" value="1"/>"#,
        r#"<spectrum name="radiance" type="d65"/>"#,
        r#"<spectrum name="radiance" type="uniform"><float name="value" value="1"/></spectrum>"#,
    ] {
        assert!((of(text) - 1.0).abs() < 2e-3, "{text}: {}", of(text));
    }
    assert!((of(r#"<spectrum name="radiance" value="360:2, 830:2"/>"#) - 2.0).abs() < 2e-3);
}

#[test]
fn attributes_of_a_mesh_are_read_by_their_names() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float heat_0\nelement face 2\nproperty list uchar int vertex_indices\nproperty float tint_r\n\
        property float tint_g\nproperty float tint_b\nend_header\n0 0 0 1\n1 0 0 2\n0 1 0 3\n2 0 0 4\n\
        3 0 1 3 9 9 9\n3 0 1 2 0.1 0.2 0.3\n";
    let shape = r#"<shape type="ply"><string name="filename" value="m.ply"/><bsdf type="diffuse">
        <texture type="mesh_attribute" name="reflectance"><string name="name" value="face_tint_color"/></texture>
        </bsdf></shape>"#;
    let text = SCENE.replace(r#"<shape type="sphere"><ref id="paint"/></shape>"#, shape);
    let files = Memory::new().with("s/scene.xml", text).with("s/m.ply", ply);
    let outcome = load(Input::File(Path::new("s/scene.xml")), &files, &LoadOptions::default());
    let s = outcome.scene.unwrap();
    let mesh = s.triangle_meshes.iter().next().unwrap();
    // The first face has no area, and its colour goes with it.
    assert_eq!(mesh.attribute("face_tint_color", 0, 0.2, 0.2), Some([0.1, 0.2, 0.3]));
    assert_eq!(mesh.attribute("vertex_heat", 0, 0.5, 0.5), Some([2.5; 3]));
    assert_eq!(mesh.attribute("vertex_cold", 0, 0.5, 0.5), None);
    World::build(s).unwrap();
}

/// A file of a grid in the unit cube.
fn grid(size: [i32; 3], channels: i32, values: &[f32]) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    bytes.extend([1, size[0], size[1], size[2], channels].iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend([0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0].iter().chain(values).flat_map(|v| v.to_le_bytes()));
    bytes
}

#[test]
fn phase_functions_are_what_they_are_called() {
    let of = |phase: &str| {
        let shape = r#"<shape type="cube"><bsdf type="null"/><medium type="homogeneous" name="interior">PHASE</medium></shape>"#;
        let text = SCENE.replace(r#"<shape type="sphere"><ref id="paint"/></shape>"#, &shape.replace("PHASE", phase));
        load_text(&text, &[])
    };
    let phase = |text: &str| {
        let s = of(text).scene.expect(text);
        let phase = s.media.iter().next().unwrap().phase.clone();
        World::build(s).unwrap();
        phase
    };
    let hg = |g| Phase::HenyeyGreenstein { g };
    assert_eq!((phase(""), phase(r#"<phase type="isotropic"/>"#)), (hg(0.0), hg(0.0)));
    assert_eq!(phase(r#"<phase type="rayleigh"/>"#), Phase::Rayleigh);
    let table = r#"<phase type="tabphase"><string name="values" value="1, 0.5 2"/></phase>"#;
    assert_eq!(phase(table), Phase::Tabulated(vec![1.0, 0.5, 2.0]));
    let blend = |inner: &str| format!(r#"<phase type="blendphase"><float name="weight" value="0.25"/>{inner}</phase>"#);
    let two = r#"<phase type="hg"><float name="g" value="0.5"/></phase><phase type="rayleigh"/>"#;
    let Phase::Blend { parts, .. } = phase(&blend(two)) else { panic!("no blend") };
    assert_eq!(*parts, [hg(0.5), Phase::Rayleigh]);
    // Four in one another are well, five are said to be too many.
    let nested = |n: usize| (2..n).fold(blend(two), |inner, _| blend(&format!(r#"<phase type="isotropic"/>{inner}"#)));
    assert_eq!(phase(&nested(4)).leaves().len(), 4);
    for (bad, words) in [
        (nested(5).as_str(), "more than 4"),
        (blend(r#"<phase type="isotropic"/>"#).as_str(), "needs two phase functions"),
        (r#"<phase type="tabphase"><string name="values" value="1 x"/></phase>"#, "list of numbers"),
        (r#"<phase type="tabphase"><string name="values" value="0 0"/></phase>"#, "two values or more"),
        (r#"<phase type="sggx"/>"#, "`sggx` is not built"),
    ] {
        let outcome = of(bad);
        let said: String = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
        assert!(outcome.scene.is_none() && said.contains(words), "{bad}: {said}");
    }
}

#[test]
fn grids_are_textures_and_signed_distances() {
    let load_with = |shape: &str, file: Vec<u8>| {
        let text = SCENE.replace(r#"<shape type="sphere"><ref id="paint"/></shape>"#, shape);
        let files = Memory::new().with("s/scene.xml", text).with("s/a.vol", file);
        load(Input::File(Path::new("s/scene.xml")), &files, &LoadOptions::default())
    };
    let textured = r#"<shape type="sphere"><bsdf type="diffuse"><texture type="volume" name="reflectance">
        <volume type="gridvolume" name="volume"><string name="filename" value="a.vol"/>
        <string name="wrap_mode" value="repeat"/></volume></texture></bsdf></shape>"#;
    let values = [0.1f32, 0.2, 0.3, 0.4, 0.5, 0.6];
    let s = load_with(textured, grid([2, 1, 1], 3, &values)).scene.unwrap();
    let texture = s.grids.iter().next().unwrap();
    assert_eq!((texture.size, texture.channels, texture.values.as_slice()), ([2, 1, 1], 3, &values[..]));
    World::build(s).unwrap();

    let surface = r#"<shape type="sdfgrid"><string name="filename" value="a.vol"/><ref id="paint"/></shape>"#;
    let distances = [-1.0f32, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    let s = load_with(surface, grid([2, 2, 2], 1, &distances)).scene.unwrap();
    assert_eq!(s.distance_grids.iter().next().unwrap().size(), [2; 3]);
    let world = World::build(s).unwrap();
    // The corner at the origin is inside: the surface is half a cell away from it along each edge.
    let hit = |o: [f32; 3], d: [f32; 3]| {
        let ray = Ray::new(Point3::new(o[0], o[1], o[2]), Vec3::new(d[0], d[1], d[2]), 0.0);
        world.intersect(&ray).map(|h| (h.t, world.surface(&ray, &h)))
    };
    let (t, surface) = hit([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]).unwrap();
    assert!((t - 2.5).abs() < 1e-5 && surface.n.dot(Vec3::new(1.0, 1.0, 1.0)) > 0.0, "{t}");
    assert!(hit([0.8, 0.8, 3.0], [0.0, 0.0, -1.0]).is_none());
    for (file, words) in [
        (grid([2, 2, 2], 1, &[1.0; 8]), "one sign"),
        (grid([2, 2, 2], 3, &[1.0; 24]), "one channel"),
        (grid([2, 2, 1], 1, &[1.0; 4]), "two or more"),
        (grid([2, 2, 2], 1, &[f32::NAN; 8]), "not finite"),
    ] {
        let outcome = load_with(r#"<shape type="sdfgrid"><string name="filename" value="a.vol"/></shape>"#, file);
        let said: String = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
        assert!(outcome.scene.is_none() && said.contains(words), "{said}");
    }
}

#[test]
fn filters_of_polarised_light_dim_what_is_not_polarised() {
    let text = |kind: &str| {
        let paint = r#"<bsdf type="twosided" id="paint"><bsdf type="diffuse"><rgb name="reflectance" value="0.8 0.2 0.1"/></bsdf></bsdf>"#;
        let filter = format!(
            r#"<bsdf type="{kind}" id="paint"><float name="theta" value="30"/><spectrum name="transmittance" value="0.9"/></bsdf>"#
        );
        SCENE.replace(paint, &filter)
    };
    for (kind, expected) in [("polarizer", 0.45), ("circular", 0.45), ("retarder", 0.9)] {
        let files = Memory::new().with("s/scene.xml", text(kind));
        let outcome = load(Input::File(Path::new("s/scene.xml")), &files, &LoadOptions::default());
        let world = World::build(outcome.scene.unwrap()).unwrap();
        let ray = Ray::new(Point3::new(0.0, 0.0, 5.0), Vec3::new(0.0, 0.0, -1.0), 0.0);
        let hit = world.intersect(&ray).unwrap();
        let straight = world.straight(&ray, &hit, &Wavelengths::rgb()).unwrap();
        assert!((straight.transmittance[0] - expected).abs() < 1e-6 && straight.chance == 1.0, "{kind}: {straight:?}");
    }
}

#[test]
fn maps_shadow_and_mirror_what_they_tilt_also_inside_of_blends() {
    let bump = r#"<bsdf type="bumpmap" id="paint"><boolean name="flip_invalid_normals" value="false"/>
        <texture type="checkerboard" name="arbitrary"/>
        <bsdf type="blendbsdf"><float name="weight" value="0.3"/><bsdf type="plastic"/><bsdf type="conductor"/></bsdf></bsdf>"#;
    let paint = r#"<bsdf type="twosided" id="paint"><bsdf type="diffuse"><rgb name="reflectance" value="0.8 0.2 0.1"/></bsdf></bsdf>"#;
    let files = Memory::new().with("s/scene.xml", SCENE.replace(paint, bump));
    let outcome = load(Input::File(Path::new("s/scene.xml")), &files, &LoadOptions::default());
    let s = outcome.scene.unwrap();
    let tilt = Tilt { shadowing: true, mirrors: false };
    let tilted: Vec<_> = s.materials.iter().filter(|m| m.tilt == Some(tilt)).collect();
    assert_eq!(tilted.len(), 2);
    assert!(tilted.iter().all(|m| m.displacement.is_some()));
    World::build(s).unwrap();
}

#[test]
fn heterogeneous_media_are_grids() {
    let grid = grid([2, 2, 2], 1, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    let shape = r#"<shape type="cube"><bsdf type="null"/><medium type="heterogeneous" name="interior">
        <volume type="gridvolume" name="sigma_t"><string name="filename" value="smoke.vol"/></volume>
        <rgb name="albedo" value="0.9 0.8 0.7"/><phase type="hg"><float name="g" value="0.3"/></phase>
        </medium></shape>"#;
    let text = SCENE.replace(r#"<shape type="sphere"><ref id="paint"/></shape>"#, shape);
    let files = Memory::new().with("s/scene.xml", text).with("s/smoke.vol", grid);
    let outcome = load(Input::File(Path::new("s/scene.xml")), &files, &LoadOptions::default());
    let s = outcome.scene.unwrap();
    let medium = s.media.iter().next().unwrap();
    let Volume::Fields(fields) = &medium.volume else { panic!("no fields") };
    let Field::Grid(sigma_t) = &fields.sigma_t else { panic!("no grid") };
    assert_eq!(medium.phase, Phase::HenyeyGreenstein { g: 0.3 });
    assert_eq!((sigma_t.size, sigma_t.values[2], sigma_t.wrap), ([2, 2, 2], 3.0, Wrap::Clamp));
    assert!(matches!(&fields.albedo, Field::Even(s) if s.rgb() == [0.9, 0.8, 0.7]));
    // The unit cube that grids fill, whatever the surface around.
    assert_eq!((fields.bounds.min, fields.bounds.max), (Point3::default(), Point3::splat(1.0)));
    assert_eq!(s.settings.integrator.kind, IntegratorKind::VolPath);
    World::build(s).unwrap();
}

#[test]
fn no_damage_to_a_file_is_more_than_an_error() {
    let original = SCENE.as_bytes().to_vec();
    let mut state = 11u64;
    let mut random = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for _ in 0..1000 {
        let mut text = original.clone();
        for _ in 0..=random(3) {
            let at = random(text.len());
            match random(3) {
                0 => text[at] = b"0123456789-<>/\"= $e"[random(19)],
                1 => drop(text.remove(at)),
                _ => text.insert(at, b"0123456789-<>/\"= $e"[random(19)]),
            }
        }
        let files = Memory::new().with("a.xml", text);
        let outcome = load(Input::File(Path::new("a.xml")), &files, &LoadOptions::default());
        if let Some(scene) = outcome.scene
            && scene.settings.film.resolution.iter().all(|&n| n < 10_000)
        {
            drop(World::build(scene));
        }
    }
}

#[test]
fn the_sun_and_the_sky_stand_as_they_are_told() {
    let with = |emitter: &str| {
        SCENE.replace(r#"<emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>"#, emitter)
    };
    let s = scene(&with(
        r#"<emitter type="sunsky"><vector name="sun_direction" value="0, 3, 4"/><float name="sun_scale" value="0.5"/>
        <transform name="to_world"><rotate x="1" angle="-90"/></transform></emitter>"#,
    ));
    assert_eq!(s.lights.len(), 2);
    let Light::Sun { to_light, half_angle, profile, .. } = &s.lights[1] else { panic!("{:?}", s.lights[1]) };
    assert!((to_light.y - 0.6).abs() < 1e-5 && (half_angle.to_degrees() - 0.2679).abs() < 1e-4 && profile.len() == 1);
    let Light::ImageInfinite { world_from_light, image, .. } = &s.lights[0] else { panic!("no sky") };
    // Up is +y: above the horizon there is light, below there is none.
    let up = world_from_light.vector(Vec3::new(0.0, 0.0, 1.0));
    assert!((up.y - 1.0).abs() < 1e-5);
    let texels = &s.images[*image].texels;
    assert!(texels.texel(5, 20, 2) > 0.0 && texels.texel(5, 500, 2) == 0.0);
    World::build(s).unwrap();
    let one = |emitter: &str| scene(&with(emitter)).lights;
    assert!(matches!(one(r#"<emitter type="sun"/>"#)[..], [Light::Sun { .. }]));
    assert!(matches!(one(r#"<emitter type="sky"/>"#)[..], [Light::ImageInfinite { .. }]));
    let complex = one(r#"<emitter type="sunsky"><boolean name="complex_sun" value="true"/></emitter>"#);
    assert!(matches!(&complex[1], Light::Sun { profile, .. } if profile.len() == 6));
    // The older dialect has its own frame and names: in the afternoon of the northern summer the sun is in the west, which is -x.
    let old = with(r#"<emitter type="sun"><float name="sunRadiusScale" value="2"/></emitter>"#)
        .replace("version=\"3.0.0\"", "version=\"0.6.0\"");
    let lights = scene(&old).lights;
    let Light::Sun { to_light, half_angle, .. } = &lights[0] else { panic!("no sun") };
    assert!(to_light.x < -0.5 && to_light.y > 0.5 && half_angle.to_degrees() > 0.5, "{to_light:?}");
    // By night there is nothing, and it is said.
    let night = load_text(&with(r#"<emitter type="sunsky"><float name="hour" value="22"/></emitter>"#), &[]);
    assert!(night.scene.unwrap().lights.is_empty());
    assert!(night.diagnostics.iter().any(|d| d.message.contains("below the horizon")));
    for (bad, why) in [
        (r#"<float name="turbidity" value="11"/>"#, "from 1 to 10"),
        (r#"<float name="sun_aperture" value="0"/>"#, "above 0"),
        (r#"<float name="sky_scale" value="-1"/>"#, "positive"),
        (r#"<integer name="year" value="99999999999"/>"#, "of a date"),
        (r#"<vector name="sun_direction" value="0, 0, 1"/><float name="hour" value="3"/>"#, "stated twice"),
    ] {
        let words = said(&with(&format!(r#"<emitter type="sunsky">{bad}</emitter>"#)));
        assert!(words.contains(why), "{words}");
    }
}
