//! Mitsuba scenes: plugins become what they stand for, and what is wrong has its line.

use std::path::Path;
use steradian_load::{Input, LoadOptions, LoadOutcome, Memory, ModelOptions, load};
use steradian_scene::{IntegratorKind, Light, Scattering, Scene, World};

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
            matches!(s, Scattering::Dielectric { .. })
        }),
        (r#"<bsdf type="roughconductor"><string name="material" value="Au"/></bsdf>"#, |s| {
            matches!(s, Scattering::Conductor { .. })
        }),
        (r#"<bsdf type="plastic"/>"#, |s| matches!(s, Scattering::CoatedDiffuse { .. })),
        (r#"<bsdf type="principled"><float name="metallic" value="1"/></bsdf>"#, |s| {
            matches!(s, Scattering::MetallicRoughness(_))
        }),
        (r#"<bsdf type="null"/>"#, |s| matches!(s, Scattering::Interface)),
        (r#"<bsdf type="blendbsdf"><bsdf type="diffuse"/><bsdf type="conductor"/></bsdf>"#, |s| {
            matches!(s, Scattering::Mix { .. })
        }),
    ];
    for (bsdf, is) in kinds {
        let s = scene(&SCENE.replace("<ref id=\"paint\"/>", bsdf));
        assert!(is(&s.materials[s.primitives[0].material].scattering), "{bsdf}");
    }
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
