//! The photons of an iteration, sent out by all threads. Each is a function of its number, and they are put together in the order of
//! those, so that threads do not show.

use crate::fault::{BadSample, Fault};
use crate::renderer::{locked, message};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use steradian_integrator::record::Count;
use steradian_integrator::{Photon, PhotonMap, Sppm};
use steradian_scene::World;

/// A thread takes so many at a time.
const CHUNK: u32 = 1 << 10;

/// An iteration's photons, and what there is to say of them.
#[derive(Clone, Debug)]
pub(crate) struct Sent<C> {
    pub map: Arc<PhotonMap>,
    pub counts: C,
    pub bad: Vec<BadSample>,
    pub bad_count: u64,
}

/// What a thread has seen.
#[derive(Default)]
struct Seen<C> {
    counts: C,
    bad: Vec<(u32, Fault)>,
    bad_count: u64,
}

/// Sends out the photons of an iteration; `None` if cancelled.
pub(crate) fn send<C: Count>(
    world: &World,
    sppm: &Sppm,
    iteration: u32,
    threads: usize,
    cancel: &AtomicBool,
) -> Option<Sent<C>> {
    let chunks = sppm.per_iteration.div_ceil(CHUNK) as usize;
    let parts: Vec<Mutex<Vec<Photon>>> = (0..chunks).map(|_| Mutex::default()).collect();
    let next = AtomicUsize::new(0);
    let all = Mutex::new(Seen::<C>::default());
    let work = || {
        let mut seen = Seen::<C>::default();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= chunks || cancel.load(Ordering::Relaxed) {
                break;
            }
            let mut photons = Vec::new();
            chunk(world, sppm, iteration, k as u32 * CHUNK, &mut photons, &mut seen);
            *locked(&parts[k]) = photons;
        }
        let mut all = locked(&all);
        all.counts.merge(&seen.counts);
        all.bad.append(&mut seen.bad);
        all.bad_count += seen.bad_count;
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.max(1).min(chunks) {
            scope.spawn(work);
        }
        work();
    });
    if cancel.load(Ordering::Relaxed) {
        return None;
    }
    let parts: Vec<Vec<Photon>> =
        parts.into_iter().map(|p| p.into_inner().unwrap_or_else(PoisonError::into_inner)).collect();
    let Seen { counts, mut bad, bad_count } = all.into_inner().unwrap_or_else(PoisonError::into_inner);
    // Which of them is told does not depend on threads.
    bad.sort_by_key(|(number, _)| *number);
    let [x, _, y, _] = world.settings().film.pixel_bounds;
    let bad = bad.into_iter().take(1).map(|(_, fault)| BadSample { pixel: [x, y], sample: iteration, fault }).collect();
    Some(Sent { map: Arc::new(PhotonMap::new(sppm, iteration, &parts)), counts, bad, bad_count })
}

fn chunk<C: Count>(world: &World, sppm: &Sppm, iteration: u32, first: u32, out: &mut Vec<Photon>, seen: &mut Seen<C>) {
    let end = first.saturating_add(CHUNK).min(sppm.per_iteration);
    let all = catch_unwind(AssertUnwindSafe(|| {
        let mut counts = C::default();
        sppm.photons(world, iteration, first..end, &mut counts, out);
        counts
    }));
    let broken = out.iter().filter(|p| !p.is_finite()).count() as u64;
    match all {
        Ok(counts) => {
            seen.counts.merge(&counts);
            out.retain(Photon::is_finite);
            if broken > 0 {
                seen.bad_count += broken;
                seen.bad.push((first, Fault::NotFinite));
            }
        }
        Err(payload) => {
            // The whole chunk is lost: it is the first number that is told, and the trace of its sample panics alike.
            out.clear();
            seen.bad_count += 1;
            seen.bad.push((first, Fault::Panic(message(payload.as_ref()))));
        }
    }
}
