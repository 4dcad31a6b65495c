//! glTF assets: what they say is what comes out, and nothing that is wrong with them is more than an error.

use std::path::Path;
use steradian_load::{LoadOptions, LoadOutcome, Memory, ModelOptions, load_model};
use steradian_math::{Point3, Vec3};
use steradian_scene::{Light, Projection, Scattering, Scene, Shape, World};

/// Bytes of base64.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    bytes
        .chunks(3)
        .map(|c| {
            let n = c.iter().enumerate().fold(0u32, |n, (i, b)| n | u32::from(*b) << (16 - 8 * i));
            let digit = |k: usize| if k <= c.len() { DIGITS[(n >> (18 - 6 * k) & 63) as usize] as char } else { '=' };
            (0..4).map(digit).collect::<String>()
        })
        .collect()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// A square of two triangles: 48 bytes of positions, 32 of coordinates, 6 indices of 16 bits.
fn square_data() -> Vec<u8> {
    let mut data = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    data.extend(floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    [0u16, 1, 2, 0, 2, 3].iter().for_each(|i| data.extend(i.to_le_bytes()));
    data
}

/// An asset of one square, with changes to its text.
fn square(changes: &[(&str, &str)]) -> String {
    let mut text = format!(
        r#"{{"asset": {{"version": "2.0"}},
"scene": 0, "scenes": [{{"nodes": [0]}}],
"nodes": [{{"mesh": 0, "name": "square"}}],
"meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "TEXCOORD_0": 1}}, "indices": 2, "material": 0}}]}}],
"materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [0.8, 0.4, 0.2, 1.0], "metallicFactor": 0.0}}}}],
"accessors": [
{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
{{"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"}},
{{"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}}],
"bufferViews": [
{{"buffer": 0, "byteLength": 48}},
{{"buffer": 0, "byteOffset": 48, "byteLength": 32}},
{{"buffer": 0, "byteOffset": 80, "byteLength": 12}}],
"buffers": [{{"byteLength": 92, "uri": "data:application/octet-stream;base64,{}"}}]}}"#,
        base64(&square_data())
    );
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    text
}

fn load_with(text: &str, options: &ModelOptions) -> LoadOutcome {
    let files = Memory::new().with("a/scene.gltf", text).with("a/../secret.bin", square_data());
    load_model(Path::new("a/scene.gltf"), &files, options)
}

fn scene(text: &str) -> Scene {
    let outcome = load_with(text, &ModelOptions::default());
    outcome.scene.unwrap_or_else(|| panic!("{:?}", outcome.diagnostics))
}

/// The words of the first error.
fn error(text: &str) -> String {
    let outcome = load_with(text, &ModelOptions::default());
    assert!(outcome.scene.is_none(), "a scene in spite of errors");
    outcome
        .diagnostics
        .iter()
        .find(|d| d.hint.is_some())
        .or(outcome.diagnostics.first())
        .unwrap()
        .render(&outcome.sources)
}

#[test]
fn a_square_is_read_and_put_on_a_stage() {
    let s = scene(&square(&[]));
    assert_eq!(s.primitives.len(), 2, "the square and the ground");
    let Shape::Triangles(mesh) = s.primitives[0].shape else { panic!("no triangles") };
    assert_eq!((s.triangle_meshes[mesh].positions.len(), s.triangle_meshes[mesh].indices.len()), (4, 2));
    assert!(matches!(s.materials[s.primitives[0].material].scattering, Scattering::MetallicRoughness(_)));
    assert!(matches!(s.lights[0], Light::ImageInfinite { .. }));
    assert!(matches!(s.camera.projection, Projection::Perspective { .. }));
    World::build(s).unwrap();
    let alone = ModelOptions { ground: false, ..ModelOptions::default() };
    assert_eq!(load_with(&square(&[]), &alone).scene.unwrap().primitives.len(), 1);
}

#[test]
fn a_binary_file_says_the_same_as_a_text() {
    let mut json = square(&[]).into_bytes();
    let start = json.windows(7).position(|w| w == b", \"uri\"").unwrap();
    let end = start + json[start..].iter().position(|&b| b == b'}').unwrap();
    json.drain(start..end);
    json.resize(json.len().next_multiple_of(4), b' ');
    let data = square_data();
    let mut glb = b"glTF".to_vec();
    let total = 12 + 8 + json.len() + 8 + data.len();
    let words = [2, total as u32, json.len() as u32, 0x4e4f_534a];
    words.iter().for_each(|w| glb.extend(w.to_le_bytes()));
    glb.extend(&json);
    [data.len() as u32, 0x004e_4942].iter().for_each(|w| glb.extend(w.to_le_bytes()));
    glb.extend(&data);
    let load = |bytes: &[u8]| {
        let files = Memory::new().with("a.glb", bytes);
        load_model(Path::new("a.glb"), &files, &ModelOptions::default())
    };
    let text = scene(&square(&[]));
    let binary = load(&glb).scene.unwrap();
    assert_eq!(text.triangle_meshes.as_slice(), binary.triangle_meshes.as_slice());
    // Cut off anywhere it is an error, never a panic.
    for n in 0..glb.len() {
        assert!(load(&glb[..n]).scene.is_none(), "{n} bytes");
    }
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let cases: &[(&[(&str, &str)], &str)] = &[
        (&[("\"count\": 4", "\"count\": 5")], "#/accessors/0: `count` of 5 elements"),
        (&[("\"count\": 4", "\"count\": 4000000000000")], "#/accessors/0: `count`"),
        (&[("\"count\": 4", "\"count\": -1")], "#/accessors/0/count: must be a whole number"),
        (
            &[(
                "\"bufferView\": 0, \"componentType\": 5126, \"count\": 4",
                "\"componentType\": 5126, \"count\": 900000000",
            )],
            "#/accessors/0: claims 900000000",
        ),
        (&[("\"byteLength\": 48", "\"byteLength\": 480")], "#/bufferViews/0: reaches to byte 0 + 480 of buffer 0"),
        (&[("\"byteLength\": 92", "\"byteLength\": 93")], "#/buffers/0: `byteLength` is 93"),
        (&[("\"POSITION\": 0", "\"POSITION\": 9")], "attributes/POSITION: refers to accessor 9, but there are only 3"),
        (&[("\"material\": 0", "\"material\": 7")], "material: refers to material 7, but there are only 1"),
        (&[("\"mesh\": 0", "\"mesh\": 3")], "#/nodes/0/mesh: refers to mesh 3"),
        (&[("\"mesh\": 0", "\"mesh\": 0, \"children\": [0]")], "its own ancestor"),
        (&[("{\"nodes\": [0]}", "{\"nodes\": [0, 0]}")], "the child of two nodes"),
        (&[("\"5126\"", "\"5126\"")][..0], ""),
        (
            &[("5126, \"count\": 4, \"type\": \"VEC3\"", "77, \"count\": 4, \"type\": \"VEC3\"")],
            "componentType: 77 is no component type",
        ),
        (&[("\"VEC3\"", "\"VEC2\"")], "has 2 components where 3 are needed"),
        (&[("\"2.0\"", "\"1.0\"")], "#/asset/version: version 1.0"),
        (&[("\"scene\": 0", "\"extensionsRequired\": [\"XYZ_magic\"]")], "requires the extension `XYZ_magic`"),
        (&[("\"scene\": 0", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"]")], "gltf-transform"),
        (&[("data:application/octet-stream;base64,", "http://example.org/")], "on the network"),
        (&[("0.8, 0.4, 0.2, 1.0", "0.8, 0.4, 0.2")], "baseColorFactor: must have 4 numbers, not 3"),
        (&[("0.8, 0.4", "1e39, 0.4")], "too large"),
        (&[("0.8, 0.4", "-0.8, 0.4")], "#/materials/0/pbrMetallicRoughness/baseColorFactor/0: must not be negative"),
        (&[("{\"version\": \"2.0\"}", "{\"version\": \"2.1\", \"minVersion\": \"2.1\"}")], "#/asset/minVersion"),
        (&[("\"pbrMetallicRoughness\": {", "\"pbrMetallicRoughness\": [], \"x\": {")], "Roughness: must be an object"),
        (
            &[("\"pbrMetallicRoughness\"", "\"extensions\": {\"KHR_materials_ior\": 1.3}, \"pbrMetallicRoughness\"")],
            "#/materials/0/extensions/KHR_materials_ior: must be an object",
        ),
        (
            &[("\"name\": \"square\"", "\"matrix\": [1,0,0,0.5, 0,1,0,0, 0,0,1,0, 0,0,0,1]")],
            "#/nodes/0/matrix: its last row",
        ),
        (
            &[("\"name\": \"square\"", "\"extensions\": {\"EXT_mesh_gpu_instancing\": {\"attributes\": {}}}")],
            "attributes: no attribute says how many",
        ),
        (&[("\"name\": \"square\"", "\"scale\": [1e30, 1e30, 1e30], \"translation\": [1e38, 1e38, 1e38]")], ""),
    ];
    for (changes, words) in cases.iter().filter(|c| !c.0.is_empty()) {
        let text = square(changes);
        let outcome = load_with(&text, &ModelOptions::default());
        let said: Vec<String> = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
        assert!(words.is_empty() || said.iter().any(|s| s.contains(words)), "{changes:?}: {said:?}");
        assert!(words.is_empty() || outcome.scene.is_none(), "{changes:?}");
    }
}

#[test]
fn positions_that_are_not_finite_and_indices_out_of_range_are_errors() {
    let with = |data: Vec<u8>| square(&[(&base64(&square_data()), &base64(&data))]);
    let mut data = square_data();
    data[4..8].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert!(error(&with(data)).contains("#/accessors/0: element 0 is not finite"));
    let mut data = square_data();
    data[82] = 9;
    assert!(error(&with(data)).contains("indices: index 1 refers to vertex 9, but there are only 4"));
}

/// The square as a binary file.
fn glb(text: &str, data: &[u8]) -> Vec<u8> {
    let mut json = text.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut data = data.to_vec();
    data.resize(data.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + data.len();
    let mut out = b"glTF".to_vec();
    out.extend([2, total as u32, json.len() as u32, 0x4e4f_534a].iter().flat_map(|v| v.to_le_bytes()));
    out.extend(json);
    out.extend([data.len() as u32, 0x004e_4942].iter().flat_map(|v| v.to_le_bytes()));
    out.extend(data);
    out
}

#[test]
fn binary_files_that_are_cut_or_lie_are_errors() {
    let uri = format!(", \"uri\": \"data:application/octet-stream;base64,{}\"", base64(&square_data()));
    let text = square(&[(&uri, "")]);
    let whole = glb(&text, &square_data());
    let load_bytes =
        |bytes: Vec<u8>| load_model(Path::new("a.glb"), &Memory::new().with("a.glb", bytes), &ModelOptions::default());
    assert!(load_bytes(whole.clone()).scene.is_some(), "{:?}", load_bytes(whole.clone()).diagnostics);
    // Cut anywhere before its data are complete.
    for keep in (0..whole.len() - 4).step_by(7).chain([4, 11, 12, 19, 20]) {
        let outcome = load_bytes(whole[..keep].to_vec());
        assert!(outcome.scene.is_none() && outcome.errors() > 0, "{keep}");
    }
    // Lengths of the file and of its chunks that go beyond it.
    for at in [8, 12, whole.len() - square_data().len().next_multiple_of(4) - 8] {
        let mut lying = whole.clone();
        lying[at..at + 4].copy_from_slice(&0xffff_fff0u32.to_le_bytes());
        let outcome = load_bytes(lying);
        assert!(outcome.scene.is_none() && outcome.errors() > 0, "{at}");
    }
}

#[test]
fn numbers_that_are_none_skins_that_go_round_and_pictures_from_elsewhere_are_told() {
    let with = |changes: &[(&str, &str)]| load_with(&square(changes), &ModelOptions::default());
    let said = |o: &LoadOutcome| o.diagnostics.iter().map(|d| d.render(&o.sources)).collect::<String>();
    let node = "{\"mesh\": 0, \"name\": \"square\"}";
    let skin = |joints: &str, more: &str| format!("\"scene\": 0, \"skins\": [{{\"joints\": {joints}{more}}}]");
    let cases: Vec<(Vec<(String, String)>, &str)> = vec![
        // A skin whose joint does not exist, one without joints, one that names itself as a bone, and bones that go round.
        (
            vec![(node.into(), "{\"mesh\": 0, \"skin\": 0}".into()), ("\"scene\": 0".into(), skin("[9]", ""))],
            "#/skins/0/joints/0",
        ),
        (vec![(node.into(), "{\"mesh\": 0, \"skin\": 4}".into())], "skin"),
        (
            vec![
                (node.into(), "{\"mesh\": 0, \"skin\": 0}, {\"children\": [2]}, {\"children\": [1]}".into()),
                ("\"scene\": 0".into(), skin("[1, 2]", "")),
            ],
            "#/skins/0/joints/0: joint 1 is no node of the scene",
        ),
        (vec![("0.8, 0.4".into(), "NaN, 0.4".into())], "not JSON"),
        (vec![("\"byteLength\": 92".into(), "\"byteLength\": 18446744073709551615".into())], "#/buffers/0"),
        (vec![("\"byteLength\": 92".into(), "\"byteLength\": 1e300".into())], "#/buffers/0/byteLength"),
        (vec![("data:application/octet-stream;base64,".into(), "https://example.org/".into())], "on the network"),
        (vec![("data:application/octet-stream;base64,".into(), "%2e%2e/".into())], "outside"),
    ];
    for (changes, words) in &cases {
        let changes: Vec<(&str, &str)> = changes.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
        let outcome = with(&changes);
        let text = said(&outcome);
        assert!(outcome.scene.is_none() && text.contains(words), "{changes:?}: {text}");
    }
}

#[test]
fn files_outside_the_folder_are_read_only_where_that_is_allowed() {
    let uri = format!("data:application/octet-stream;base64,{}", base64(&square_data()));
    let text = square(&[(&uri, "../secret.bin")]);
    assert!(error(&text).contains("outside the scene's folder"));
    assert!(error(&text).contains("--allow-outside"));
    let options = ModelOptions { allow_outside: true, ..ModelOptions::default() };
    assert!(load_with(&text, &options).scene.is_some());
    assert!(error(&square(&[(&uri, "/secret.bin")])).contains("outside"));
}

#[test]
fn sparse_accessors_replace_elements() {
    let sparse = r#""count": 4, "type": "VEC3", "sparse": {"count": 1,
        "indices": {"bufferView": 2, "byteOffset": 2, "componentType": 5123}, "values": {"bufferView": 0, "byteOffset": 24}}"#;
    let s = scene(&square(&[("\"count\": 4, \"type\": \"VEC3\"", sparse)]));
    let Shape::Triangles(mesh) = s.primitives[0].shape else { panic!("no triangles") };
    // Vertex 1 has become vertex 2, so that one triangle has no area.
    assert_eq!(s.triangle_meshes[mesh].indices.len(), 1);
}

#[test]
fn a_mesh_that_is_used_twice_is_an_object_with_two_instances() {
    let twice = [
        ("{\"nodes\": [0]}", "{\"nodes\": [0, 1]}"),
        ("\"name\": \"square\"}", "\"name\": \"square\"}, {\"mesh\": 0, \"translation\": [2, 0, 0]}"),
    ];
    let s = scene(&square(&twice));
    assert_eq!((s.objects.len(), s.instances.len(), s.primitives.len()), (1, 2, 1));
}

#[test]
fn a_chain_of_many_nodes_takes_no_stack() {
    let n = 100_000;
    let chain: Vec<String> = (0..n).map(|i| format!("{{\"children\": [{}]}}", i + 1)).collect();
    let text = square(&[("{\"mesh\": 0, \"name\": \"square\"}", &format!("{}, {{\"mesh\": 0}}", chain.join(",")))]);
    assert_eq!(scene(&text).primitives.len(), 2);
}

#[test]
fn lights_and_cameras_of_the_file_are_taken() {
    let more = r#""scene": 0, "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 0.5}}],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 20, "spot": {"outerConeAngle": 0.5}}]}}"#;
    let node = r#""name": "square"}, {"camera": 0, "name": "eye", "translation": [0, 0, 3]},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}}"#;
    let changes =
        [("\"scene\": 0", more), ("\"name\": \"square\"}", node), ("{\"nodes\": [0]}", "{\"nodes\": [0, 1, 2]}")];
    let text = square(&changes);
    let s = scene(&text);
    assert_eq!((s.lights.len(), s.primitives.len()), (1, 1));
    assert!(matches!(s.lights[0], Light::Spot { .. }));
    let [w, h] = s.settings.film.resolution;
    assert!((w as f32 / h as f32 - 0.5).abs() < 0.01);
    let wanted = |name: &str| ModelOptions { camera: Some(name.into()), ..ModelOptions::default() };
    assert!(load_with(&text, &wanted("eye")).scene.is_some());
    assert!(load_with(&text, &wanted("nose")).scene.is_none());
}

#[test]
fn what_is_squeezed_is_no_error_and_what_is_flat_is_seen() {
    let count = |node: &str| scene(&square(&[("\"name\": \"square\"}", node)])).primitives.len();
    // Square and ground, nothing, and both.
    assert_eq!(count("\"scale\": [1, 1, 1]}"), 2);
    assert_eq!(count("\"scale\": [0, 0, 1]}"), 0);
    assert_eq!(count("\"scale\": [2, 3, 0]}"), 2);
    // A joint that hides what hangs on it, with another below it.
    let skin = |scale: &str| {
        let changes = [
            ("\"scene\": 0", "\"scene\": 0, \"skins\": [{\"joints\": [2, 1]}]"),
            ("{\"nodes\": [0]}", "{\"nodes\": [0, 1]}"),
            ("\"POSITION\": 0", "\"POSITION\": 0, \"JOINTS_0\": 3, \"WEIGHTS_0\": 4"),
            (
                "\"SCALAR\"}]",
                "\"SCALAR\"}, {\"componentType\": 5121, \"count\": 4, \"type\": \"VEC4\"}, {\"componentType\": 5126, \"count\": 4, \"type\": \"VEC4\"}]",
            ),
        ];
        let node = format!(
            "\"skin\": 0}}, {{\"children\": [2], \"scale\": {scale}, \"translation\": [5, 0, 0]}}, {{\"translation\": [0, 1, 0]}}"
        );
        let text = square(&changes).replace("\"name\": \"square\"}", &node);
        scene(&text)
    };
    let s = skin("[2, 2, 2]");
    let Shape::Triangles(mesh) = s.primitives[0].shape else { panic!("no triangles") };
    let p = s.triangle_meshes[mesh].positions[2];
    assert_eq!([p.x, p.y, p.z], [7.0, 4.0, 0.0]);
    assert!(skin("[0, 0, 0]").primitives.is_empty());
}

#[test]
fn lights_move_with_their_nodes_and_tracks_have_as_many_numbers_as_they_need() {
    let more = r#""scene": 0, "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot"}]}},
        "animations": [{"samplers": [{"input": 3, "output": 4}], "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}]"#;
    let accessors = r#""SCALAR"}, {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR"},
        {"bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3"}]"#;
    let node = r#""name": "square"}, {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [1, 0, 0, 0]}"#;
    let text = square(&[
        ("\"scene\": 0", more),
        ("\"SCALAR\"}]", accessors),
        ("\"name\": \"square\"}", node),
        ("{\"nodes\": [0]}", "{\"nodes\": [0, 1]}"),
    ]);
    let open = ModelOptions { time: Some(0.0), shutter: 1.0, ..ModelOptions::default() };
    let s = load_with(&text, &open).scene.unwrap();
    let Light::Moving { world_from_light, .. } = &s.lights[0] else { panic!("{:?}", s.lights[0]) };
    let axis = Vec3::new(0.0, 0.0, 1.0);
    for time in [0.0, 0.25, 1.0] {
        let t = world_from_light.at(time);
        assert!((t.point(Point3::default()) - Point3::new(time, 0.0, 0.0)).length() < 1e-6, "{time}");
        // Half a turn about x sends -z of the node to +z.
        assert!((t.vector(axis) - axis).length() < 1e-6, "{time}");
    }
    let cubic = text.replace("\"output\": 4", "\"output\": 4, \"interpolation\": \"CUBICSPLINE\"");
    let outcome = load_with(&cubic, &open);
    let said: Vec<String> = outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect();
    assert!(outcome.scene.is_none() && said[0].contains("#/accessors/4: 2 values for 2 key frames"), "{said:?}");
}

#[test]
fn numbers_beyond_their_range_are_told() {
    let outcome = load_with(&square(&[("0.8, 0.4", "1.5, 1.0000001")]), &ModelOptions::default());
    let said: Vec<String> = outcome.diagnostics.iter().map(|d| d.message.clone()).collect();
    assert!(outcome.scene.is_some());
    assert_eq!(
        said,
        ["a/scene.gltf#/materials/0/pbrMetallicRoughness/baseColorFactor/0: 1.5 is more than 1, and counts as 1"]
    );
}

#[test]
fn no_damage_to_a_file_is_more_than_an_error() {
    let original = square(&[]).into_bytes();
    // A linear congruential generator with Knuth's constants.
    let mut state = 7u64;
    let mut random = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let bytes = b"0123456789-.e\"{}[],:nt AZ\x00\xff";
    for _ in 0..500 {
        let mut text = original.clone();
        for _ in 0..=random(4) {
            let at = random(text.len());
            match random(3) {
                0 => text[at] = bytes[random(bytes.len())],
                1 => drop(text.remove(at)),
                _ => text.insert(at, bytes[random(bytes.len())]),
            }
        }
        let files = Memory::new().with("a.gltf", text.clone());
        let outcome = load_model(Path::new("a.gltf"), &files, &ModelOptions::default());
        match outcome.scene {
            None => assert!(outcome.diagnostics.iter().any(|d| d.severity == steradian_syntax::Severity::Error)),
            // What the loader lets pass must make a world, or say why not.
            Some(scene) => drop(World::build(scene)),
        }
    }
}

#[test]
fn options_say_nothing_by_default() {
    assert_eq!(LoadOptions::default().model, ModelOptions::default());
}

#[test]
fn an_environment_lies_as_in_blender_and_turns_with_its_rotation() {
    // Eight columns: the brightest is the one right of the middle.
    let mut pfm = b"PF\n8 4\n-1.0\n".to_vec();
    for i in 0..32 {
        let v = if i % 8 == 4 { 5.0f32 } else { 0.1 };
        (0..3).for_each(|_| pfm.extend(v.to_le_bytes()));
    }
    let files = Memory::new().with("a/scene.gltf", square(&[])).with("sky.pfm", pfm);
    for (rotation, expected) in [(0.0, [1.0f32, 0.0]), (90.0, [0.0, -1.0])] {
        let environment = steradian_load::EnvironmentMap { file: "sky.pfm".into(), rotation, strength: 1.0 };
        let options = ModelOptions { environment: Some(environment), ..ModelOptions::default() };
        let scene = load_model(Path::new("a/scene.gltf"), &files, &options).scene.unwrap();
        let Light::ImageInfinite { world_from_light, .. } = &scene.lights[0] else { panic!("no map") };
        // Halfway around from the edge of the picture, where the azimuth is zero.
        let middle = world_from_light.vector(Vec3::new(-1.0, 0.0, 0.0));
        assert!(
            (middle.x - expected[0]).abs() < 1e-5 && (middle.z - expected[1]).abs() < 1e-5,
            "{rotation}: {middle:?}"
        );
    }
}

/// A picture of 4 x 4 texels, (200, 100, 50), lossless.
const WEBP: &[u8] = include_bytes!("data/orange.webp");

#[test]
fn textures_in_webp_are_read_from_uris_and_buffers() {
    let textured = |source: &str, image: &str| {
        square(&[
            (r#""baseColorFactor": [0.8, 0.4, 0.2, 1.0]"#, r#""baseColorTexture": {"index": 0}"#),
            (r#""scene": 0"#, &format!(r#""images": [{image}], "textures": [{{{source}}}], "scene": 0"#)),
        ])
    };
    let uri = format!(r#"{{"uri": "data:image/webp;base64,{}"}}"#, base64(WEBP));
    let by_extension = r#""extensions": {"EXT_texture_webp": {"source": 0}}"#;
    for text in [textured(by_extension, &uri), textured(r#""source": 0"#, &uri)] {
        let s = scene(&text);
        let image = s.images.iter().find(|i| i.texels.width() == 4).unwrap();
        assert_eq!(image.texels.texel3(1, 2).map(|v| (v * 1e4).round()), [5776.0, 1274.0, 319.0]);
    }
    let cut = format!(r#"{{"uri": "data:image/webp;base64,{}"}}"#, base64(&WEBP[..WEBP.len() - 8]));
    assert!(error(&textured(by_extension, &cut)).contains("WebP"));
}
