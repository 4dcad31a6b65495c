//! Checkpoints, shares and adaptive sampling change no bit of the picture, however a render is cut up.

use crate::scenes::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;
use steradian_render::*;
use steradian_sampling::SamplerKind;
use steradian_scene::{LightSelection, Scene, SettingsError, World};
use steradian_spectrum::ColorMode;

fn world() -> World {
    let scene = cornell(40, 100, ColorMode::Rgb, SamplerKind::PaddedSobol, LightSelection::Tree);
    World::build(scene).expect("a scene")
}

fn goals(kind: &str) -> Goals {
    let error = Some(ErrorGoal::linear(0.12));
    match kind {
        "uniform" => Goals::default(),
        "adaptive" => Goals { adaptive: Adaptive::Error, ..Goals::default() },
        "contrast" => Goals { adaptive: Adaptive::Contrast, ..Goals::default() },
        "contrast to an error" => Goals { error, adaptive: Adaptive::Contrast, ..Goals::default() },
        "error" => Goals { error, ..Goals::default() },
        _ => Goals { error, adaptive: Adaptive::Error, ..Goals::default() },
    }
}

/// Cancels after a number of checkpoints, each of which it keeps; makes one after every tile.
struct Interrupter {
    left: AtomicU32,
    cancel: AtomicBool,
    last: Mutex<Option<Vec<u8>>>,
}

impl Observer for Interrupter {
    fn checkpoint_due(&self) -> bool {
        true
    }
    fn checkpoint(&self, bytes: Vec<u8>, _took: Duration) {
        *self.last.lock().unwrap() = Some(bytes);
        if self.left.fetch_sub(1, Ordering::SeqCst) == 1 {
            self.cancel.store(true, Ordering::SeqCst);
        }
    }
}

/// Some of what can be kept beside a picture.
fn layers(world: &World) -> Layers {
    Layers::new(vec![Layer::Direct, Layer::FoundByLobe, Layer::Outliers], world)
}

pub fn go(
    world: &World,
    goals: &Goals,
    threads: usize,
    resume: Option<Snapshot>,
    stop_after: Option<u32>,
) -> (Rendered, Option<Vec<u8>>) {
    let identity = Identity::new();
    let layers = layers(world);
    let task = Task {
        world,
        plan: Plan { spp: 100, threads, time_limit: None },
        goals: goals.clone(),
        layers: &layers,
        label: Label { identity: &identity, note: b"note" },
        resume,
    };
    let Some(after) = stop_after else {
        return (run(task, &Quiet, &AtomicBool::new(false)), None);
    };
    let i = Interrupter { left: AtomicU32::new(after), cancel: AtomicBool::new(false), last: Mutex::new(None) };
    let rendered = run(task, &i, &i.cancel);
    (rendered, i.last.into_inner().unwrap())
}

/// What can be gone on with.
pub fn kept(rendered: &Rendered) -> Snapshot {
    let bytes = rendered.encode(&Label { identity: &Identity::new(), note: &[] });
    let snapshot = Snapshot::decode(&bytes).unwrap();
    assert_eq!(snapshot.encode(), bytes);
    snapshot
}

/// Killed at random moments again and again: the last checkpoint that was stored is all that is known.
#[test]
fn a_render_that_is_killed_and_resumed_is_the_same() {
    let world = world();
    for kind in ["uniform", "adaptive", "error", "adaptive to an error", "contrast", "contrast to an error"] {
        let goals = goals(kind);
        let (whole, _) = go(&world, &goals, 2, None, None);
        let mut stored: Option<Vec<u8>> = None;
        let mut kills = 0;
        let resumed = loop {
            let resume = stored.as_ref().map(|bytes| Snapshot::decode(bytes).unwrap());
            let (rendered, last) = go(&world, &goals, 1 + kills % 3, resume, Some(5 + (kills as u32 * 7) % 23));
            if rendered.outcome != Outcome::Interrupted {
                break rendered;
            }
            stored = last.or(stored);
            kills += 1;
        };
        // How soon a request to stop is seen depends on the machine; that one was is what the test needs.
        assert!(kills >= 1, "{kind}: {kills}");
        assert!(resumed.film == whole.film, "{kind}: counts, rays and sums, bit by bit, after {kills} kills");
        assert_eq!((resumed.outcome, resumed.bound), (whole.outcome, whole.bound), "{kind}");
    }
}

/// Stopped by request: the picture is of whole passes, and what is kept goes on from inside the pass.
#[test]
fn an_interrupted_picture_is_of_whole_passes() {
    let world = world();
    let (whole, _) = go(&world, &Goals::default(), 2, None, None);
    // One thread sees the request at its next tile; of two, one may finish all before the other has made it.
    let (stopped, _) = go(&world, &Goals::default(), 1, None, Some(40));
    assert_eq!(stopped.outcome, Outcome::Interrupted);
    let [least, most] = stopped.film.samples();
    assert!(least == most && least == stopped.spp && least > 0, "{least} {most}");
    let plan = Plan { spp: stopped.spp, threads: 1, time_limit: None };
    assert_eq!(stopped.film.mean(), render(&world, &plan, &Quiet, &AtomicBool::new(false)).film.mean());
    let snapshot = kept(&stopped);
    assert!(snapshot.film.total_samples() > u64::from(least) * 1600, "the pass is not lost");
    let (finished, _) = go(&world, &Goals::default(), 2, Some(snapshot), None);
    assert!(finished.film == whole.film);
}

#[test]
fn a_finished_render_goes_on_to_more_samples() {
    let world = world();
    for kind in ["uniform", "adaptive", "contrast"] {
        let goals = goals(kind);
        let at = |spp: u32, resume: Option<Snapshot>| {
            let identity = Identity::new();
            let label = Label { identity: &identity, note: &[] };
            let plan = Plan { spp, threads: 2, time_limit: None };
            let layers = layers(&world);
            let task = Task { world: &world, plan, goals: goals.clone(), layers: &layers, label, resume };
            run(task, &Quiet, &AtomicBool::new(false))
        };
        let first = kept(&at(50, None));
        let second = kept(&at(71, Some(first)));
        assert!(at(100, Some(second)).film == at(100, None).film, "{kind}");
    }
}

#[test]
fn shares_join_to_the_whole() {
    let world = world();
    let plan = Plan { spp: 21, threads: 2, time_limit: None };
    let layers = layers(&world);
    let identity = Identity::new();
    let of_share = |share| {
        let goals = Goals { share, ..Goals::default() };
        let label = Label { identity: &identity, note: &[] };
        let task = Task { world: &world, plan: plan.clone(), goals, layers: &layers, label, resume: None };
        run(task, &Quiet, &AtomicBool::new(false))
    };
    let whole = of_share(Share::Whole);
    for count in [1, 3, 6] {
        for kind in
            [Share::Tiles, Share::Samples, |part| Share::Blocks { part, groups: if part.count == 6 { 2 } else { 1 } }]
        {
            let mut parts: Vec<Snapshot> =
                (0..count).map(|index| kept(&of_share(kind(Part { index, count })))).collect();
            parts.reverse();
            let films: Vec<&Film> = parts.iter().map(|p| &p.film).collect();
            assert!(join(whole.film.bounds, &films, 21).unwrap() == whole.film, "{count} {:?}", parts[0].share);
        }
    }
}

#[test]
fn a_time_limit_ends_at_a_whole_pass() {
    let world = world();
    let plan = Plan { spp: ENDLESS_SPP, threads: 2, time_limit: Some(Duration::from_millis(50)) };
    let r = render(&world, &plan, &Quiet, &AtomicBool::new(false));
    assert_eq!(r.outcome, Outcome::TimeLimit);
    let same = Plan { spp: r.spp, threads: 1, time_limit: None };
    assert_eq!(r.film.mean(), render(&world, &same, &Quiet, &AtomicBool::new(false)).film.mean());
}

/// Four parts of a render of `spp` samples, by tiles, by samples and by both, have the bits of the whole.
pub(crate) fn parts_join(world: &World, whole: &Rendered, spp: u32, what: &str) {
    for kind in [Share::Tiles, Share::Samples, |part| Share::Blocks { part, groups: 2 }] {
        let parts: Vec<Snapshot> = [2, 0, 3, 1]
            .map(|index| {
                let share = kind(Part { index, count: 4 });
                kept(&go(world, &Goals { share, ..Goals::default() }, 2, None, None).0)
            })
            .into();
        let films: Vec<&Film> = parts.iter().map(|p| &p.film).collect();
        assert!(join(whole.film.bounds, &films, spp).unwrap() == whole.film, "{what}: {:?}", parts[0].share);
    }
}

/// Why a scene with settings that cannot work is not put together.
pub(crate) fn refused(scene: Scene) -> SettingsError {
    match World::build(scene) {
        Err(steradian_scene::Error::Settings(e)) => e,
        other => panic!("{:?}", other.map(|_| ())),
    }
}
