//! Every claim of every topic holds, with fixed seeds. A true claim fails one time in ten million (`FALSE_ALARM`).

use steradian_lab::{Effort, Quiet, Setting, Topic, run};

fn check(topic: Topic) {
    let setting = Setting { effort: Effort::Least, seed: 1, threads: 2, brute_force: None };
    let report = run(&[topic], &setting, &Quiet).expect("an experiment");
    let experiment = &report.sections[0].experiment;
    assert!(experiment.claims.len() >= 4, "{topic} makes {} claims", experiment.claims.len());
    assert!(!experiment.result.is_empty() && !experiment.blocks.is_empty());
    let failing: Vec<String> = experiment.claims.iter().filter(|c| !c.holds()).map(|c| c.to_json()).collect();
    assert!(failing.is_empty(), "{}", failing.join("\n"));
}

macro_rules! topics {
    ($($test:ident: $topic:ident;)*) => {
        $(#[test] fn $test() { check(Topic::$topic); })*

        #[test]
        fn every_topic_has_a_test() {
            assert_eq!([$(Topic::$topic),*], Topic::ALL);
        }
    };
}

topics! {
    aliasing: Aliasing;
    supersampling: Supersampling;
    adaptive: Adaptive;
    gloss: Gloss;
    soft_shadows: SoftShadows;
    depth_of_field: DepthOfField;
    motion_blur: MotionBlur;
    cost: Cost;
    penumbra: Penumbra;
    quadrature: Quadrature;
    estimator: Estimator;
    importance: Importance;
    stratified: Stratified;
    mis: Mis;
    roulette: Roulette;
    sequences: Sequences;
    convergence: Convergence;
}
