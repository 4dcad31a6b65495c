//! The lecture on the command line: counters, regular grids, and switches that have no effect.

mod common;

use common::Folder;
use serde_json::Value;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// Adds the numbers of one object to those of another, arrays entry by entry.
fn add(sum: &mut Value, more: &Value) {
    match (sum, more) {
        (Value::Object(a), Value::Object(b)) => b.iter().for_each(|(k, v)| add(&mut a[k], v)),
        (Value::Array(a), Value::Array(b)) => {
            a.resize(a.len().max(b.len()), 0.into());
            a.iter_mut().zip(b).for_each(|(x, y)| add(x, y));
        }
        (Value::Number(a), Value::Number(b)) => *a = (a.as_u64().unwrap_or(0) + b.as_u64().unwrap_or(0)).into(),
        _ => {}
    }
}

#[test]
fn counters_change_no_bit_and_depend_on_no_thread() {
    let f = Folder::with_scene();
    let line = "render small.pbrt -q --spp 8 --size 40x30 --sampler paddedsobol";
    f.ok(&format!("{line} -o plain.exr"));
    f.ok(&format!("{line} -o one.exr --threads 1 --counters one.json"));
    let out = f.ok(&format!("{line} -o three.exr --threads 3 --counters -"));
    f.ok("compare --exact plain.exr one.exr");
    f.ok("compare --exact plain.exr three.exr");
    assert_eq!(String::from_utf8(f.bytes("one.json")).unwrap(), out);
    let counts = json(&out);
    let camera = 8 * 40 * 30;
    assert_eq!((&counts["samples"], &counts["rays"]["camera"]), (&camera.into(), &camera.into()));
    let paths: u64 = counts["paths"]["by_bounces"].as_array().unwrap().iter().filter_map(Value::as_u64).sum();
    assert_eq!(paths, camera);
    assert!(counts["tests"]["box"].as_u64() > counts["rays"]["total"].as_u64());

    // The counters of the parts of a distributed render add up to those of the whole.
    let mut sum = json("{}");
    for part in 1..=3 {
        f.ok(&format!("{line} --shard {part}/3 -o {part}.part --counters {part}.json"));
        let one = json(&String::from_utf8(f.bytes(&format!("{part}.json"))).unwrap());
        if part == 1 { sum = one } else { add(&mut sum, &one) }
    }
    for key in ["samples", "rays", "tests"] {
        assert_eq!(sum[key], counts[key]);
    }
    assert_eq!(sum["paths"]["by_bounces"], counts["paths"]["by_bounces"]);

    // Going on counts what is added.
    f.ok(&format!("{line} --spp 4 -o half.exr --checkpoint c --counters first.json").replace("--spp 8 ", ""));
    f.ok(&format!("{line} -o half.exr --checkpoint c --resume --counters second.json"));
    let half = |name: &str| json(&String::from_utf8(f.bytes(name)).unwrap());
    let mut both = half("first.json");
    add(&mut both, &half("second.json"));
    assert_eq!((&both["rays"], &both["tests"]), (&counts["rays"], &counts["tests"]));
}

#[test]
fn counters_go_where_they_can_be_read() {
    let f = Folder::with_scene();
    for (line, said) in [
        ("-o a.exr --counters a.exr", "a.exr is to be written twice"),
        ("-o a.exr --counters no/such/place.json", "there is no folder no/such"),
        ("-o a.exr --counters - --progress json", "both want standard output"),
    ] {
        let ran = f.run(&format!("render small.pbrt {line}"));
        assert!(matches!(ran.code, Some(2 | 3)) && ran.err.contains(said), "{line}: {}", ran.err);
    }
    assert_eq!(f.list(), ["small.pbrt"]);
}

/// Middles of cells are the same with any seed, so that brute force draws its clumps, and says that it is biased.
#[test]
fn regular_grids_know_no_seed() {
    let f = Folder::with_scene();
    let line =
        "render small.pbrt -q --color rgb --integrator distribution --k 2 --s 3 --r 2 --max-depth 2 --filter box";
    for (seed, jitter, file) in [(1, "--no-jitter", "a"), (2, "--no-jitter", "b"), (1, "", "c"), (2, "", "d")] {
        f.ok(&format!("{line} --seed {seed} {jitter} -o {file}.pfm -o {file}.exr"));
    }
    assert_eq!(f.bytes("a.pfm"), f.bytes("b.pfm"));
    assert_ne!(f.bytes("c.pfm"), f.bytes("d.pfm"));
    assert_ne!(f.bytes("a.pfm"), f.bytes("c.pfm"));
    let about = f.ok("info a.exr");
    assert!(about.contains("no-jitter") && about.contains("biased"), "{about}");
    f.ok("render --like a.exr -q -o again.exr");
    f.ok("compare --exact a.exr again.exr");
}

/// The slide's own numbers are refused with what they would cost, before anything is written.
#[test]
fn the_laboratory_refuses_what_would_not_end() {
    let f = Folder::empty().with("file", "");
    for (line, code, said) in [
        ("lab cost --brute-force m=1000,k=8,a=8,s=8,r=8,d=8,n=1000000,l=4", 2, "years at 1e8 tests a second"),
        ("lab mis --brute-force k=2", 2, "for the topic 'cost'"),
        ("lab cost --brute-force q=2", 2, "none of the slide's m, k, a, s, r, d, n, l"),
        ("lab penumbr", 2, "did you mean 'penumbra'?"),
        ("lab cost -o file", 3, "cannot write file"),
    ] {
        let ran = f.run(line);
        assert!(ran.code == Some(code) && ran.err.contains(said), "{line}: {:?} {}", ran.code, ran.err);
    }
    assert_eq!(f.list(), ["file"]);
}

/// Claims go to one stream as objects, how things are going to the other as words.
#[test]
fn the_laboratory_tells_programs_and_people_apart() {
    let f = Folder::empty();
    let ran = f.run("lab supersampling --quick --json -o lab");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    for line in ran.out.lines() {
        let claim = json(line);
        let keys: Vec<&str> = claim.as_object().unwrap().keys().map(String::as_str).collect();
        for key in ["topic", "claim", "predicted", "measured", "interval", "verdict"] {
            assert!(keys.contains(&key), "{line}");
        }
        assert_eq!((&claim["topic"], &claim["verdict"]), (&"supersampling".into(), &"holds".into()));
    }
    assert!(ran.err.contains("1 of 1  supersampling"), "{}", ran.err);
    assert_eq!(f.run("lab supersampling --quick --json -q -o lab").err, "");
}

#[test]
fn switches_without_effect_are_named() {
    let f = Folder::with_scene();
    for (line, said) in [
        ("--k 2 --no-jitter", "of no effect here, but with --integrator distribution: --subpixels --no-jitter"),
        ("--ambient 1", "of no effect here, but with --integrator whitted: --ambient"),
        (
            "--integrator whitted --mis none",
            "of no effect here, but with --integrator path, and with volpath where there are no media: --mis",
        ),
    ] {
        let ran = f.run(&format!("render small.pbrt --spp 1 -o a.exr {line}"));
        assert!(ran.code == Some(0) && ran.err.contains(said), "{line}: {}", ran.err);
    }
    let ran = f.run("render small.pbrt --spp 1 -o a.exr --mis none --split 2 --stratify none");
    assert!(!ran.err.contains("of no effect"), "{}", ran.err);
}
