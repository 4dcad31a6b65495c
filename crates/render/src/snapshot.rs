//! A render as bytes, from which it goes on to the same bits: checkpoints, and the parts of distributed renders.
//!
//! Little endian. `STERADIA`, format, identity (names and values), note, share, samples planned, seconds, round; the film's
//! bounds and number of layers; for each tile its schedule, counts, bad samples and sums; splats and chains, if there are any; what a
//! part has [`Seen`], if it has looked; the BLAKE3 hash of all that.

use crate::chains::{ChainState, Chains};
use crate::error::Error;
use crate::fault::{BadSample, Fault};
use crate::film::{FINE_TILE_SIZE, Film, NOISE_TILE_SIZE, REMEMBERED, TILE_SIZE, Tile, TileNode};
use crate::layers::MOST_LAYERS;
use crate::schedule::Schedule;
use crate::seen::Seen;
use crate::share::{Part, Share};
use crate::splats::{Fixed, SplatSum, Splats};
use crate::sums::{MOST_LEVEL, PixelSum, nodes_of};
use std::collections::BTreeMap;
use std::time::Duration;
use steradian_integrator::Coordinate;

const MAGIC: [u8; 8] = *b"STERADIA";
const FORMAT: u32 = 5;
pub(crate) const HASH: usize = 32;
/// More text than any panic needs.
const MOST_MESSAGE: usize = 4096;

/// What a stored render is of. Two renders with equal identities continue each other.
pub type Identity = BTreeMap<String, String>;

/// A render that can go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// What it is of.
    pub identity: Identity,
    /// Anything that whoever stored it wants to find again.
    pub note: Vec<u8>,
    /// The part of the whole.
    pub share: Share,
    /// Samples per pixel that were asked for.
    pub spp: u32,
    /// Time spent so far.
    pub elapsed: Duration,
    /// The samples.
    pub film: Film,
    /// What comes next.
    pub schedule: Schedule,
    /// What a part of a distributed render knows of what the camera sees, where it was asked for.
    pub seen: Option<Seen>,
}

/// What a snapshot says before its tiles.
#[derive(Clone, Copy, Debug)]
pub struct Label<'a> {
    /// What the render is of.
    pub identity: &'a Identity,
    /// See [`Snapshot::note`].
    pub note: &'a [u8],
}

/// Writes a snapshot tile by tile.
pub(crate) struct Writer(Vec<u8>);

impl Writer {
    pub fn new(
        label: &Label,
        share: Share,
        spp: u32,
        elapsed: Duration,
        bounds: [u32; 4],
        round: u32,
        [tiles, layers]: [usize; 2],
    ) -> Self {
        let mut w = Writer(MAGIC.to_vec());
        w.u32(FORMAT);
        w.u32(label.identity.len() as u32);
        for (name, value) in label.identity {
            w.bytes(name.as_bytes());
            w.bytes(value.as_bytes());
        }
        w.bytes(label.note);
        let (kind, groups) = match share {
            Share::Whole => (0, 0),
            Share::Tiles(_) => (1, 0),
            Share::Samples(_) => (2, 0),
            Share::Blocks { groups, .. } => (3, groups),
        };
        let part = share.part();
        for v in [kind, part.index, part.count, groups, spp] {
            w.u32(v);
        }
        w.u64(elapsed.as_nanos() as u64);
        w.u32(round);
        bounds.iter().for_each(|&v| w.u32(v));
        w.u32(tiles as u32);
        w.u32(layers as u32);
        w
    }

    pub fn tile(&mut self, tile: &Tile, base: u32, target: u32) {
        for v in [base, target, tile.first, tile.end] {
            self.u32(v);
        }
        for v in [tile.rays.camera, tile.rays.scattered, tile.rays.shadow, tile.bad_count] {
            self.u64(v);
        }
        self.u32(tile.bad.len() as u32);
        for bad in &tile.bad {
            for v in [bad.pixel[0], bad.pixel[1], bad.sample] {
                self.u32(v);
            }
            match &bad.fault {
                Fault::NotFinite => self.bytes(b""),
                // Never empty, so that the two can be told apart.
                Fault::Panic(message) => {
                    let message: String = message.chars().take(MOST_MESSAGE / 4).collect();
                    self.bytes(format!("!{message}").as_bytes());
                }
            }
        }
        // Which nodes there are follows from the range.
        let mut put = |v: &f32| self.0.extend_from_slice(&v.to_le_bytes());
        for node in &tile.nodes {
            node.sums.iter().for_each(|sum| sum.rgb.iter().chain(&sum.squares).for_each(&mut put));
            node.layers.iter().flatten().for_each(&mut put);
        }
    }

    /// Whether there are splats, and those; comes after the tiles.
    pub fn splats(&mut self, splats: Option<&Splats>) {
        self.u32(u32::from(splats.is_some()));
        if let Some(splats) = splats {
            self.u64(splats.frame);
            for v in splats.sums.iter().flat_map(|s| s.rgb.iter().chain(&s.squares)) {
                self.0.extend_from_slice(&v.0.to_le_bytes());
            }
        }
    }

    /// Whether there are chains, and those; comes after the splats.
    pub fn chains<'c>(&mut self, chains: Option<impl ExactSizeIterator<Item = &'c ChainState>>) {
        self.u32(u32::from(chains.is_some()));
        let Some(chains) = chains else { return };
        self.u32(chains.len() as u32);
        for chain in chains {
            let (place, rays) = (&chain.place, &chain.rays);
            for v in [place.step, place.age, place.large[0], place.large[1], chain.bad] {
                self.u64(v);
            }
            for v in [rays.camera, rays.scattered, rays.shadow] {
                self.u64(v);
            }
            for stream in &place.coordinates {
                self.u32(stream.len() as u32);
                for c in stream {
                    self.u32(c.value.to_bits());
                    self.u64(c.age);
                }
            }
        }
    }

    /// Whether there is something of what the camera sees, and that; comes last.
    pub fn seen(&mut self, seen: Option<&Seen>) {
        self.u32(u32::from(seen.is_some()));
        if let Some(seen) = seen {
            seen.write(&mut self.0);
        }
    }

    pub fn finish(mut self) -> Vec<u8> {
        let hash = blake3::hash(&self.0);
        self.0.extend_from_slice(hash.as_bytes());
        self.0
    }

    fn u32(&mut self, v: u32) {
        self.0.extend_from_slice(&v.to_le_bytes());
    }

    fn u64(&mut self, v: u64) {
        self.0.extend_from_slice(&v.to_le_bytes());
    }

    fn bytes(&mut self, v: &[u8]) {
        self.u32(v.len() as u32);
        self.0.extend_from_slice(v);
    }
}

impl Snapshot {
    /// The bytes to store.
    pub fn encode(&self) -> Vec<u8> {
        let label = Label { identity: &self.identity, note: &self.note };
        let film = &self.film;
        let counts = [film.tiles.len(), film.layers()];
        let mut w = Writer::new(&label, self.share, self.spp, self.elapsed, film.bounds, self.schedule.round, counts);
        for (i, tile) in film.tiles.iter().enumerate() {
            w.tile(tile, self.schedule.base[i], self.schedule.targets[i]);
        }
        w.splats(film.splats.as_ref());
        w.chains(film.chains.as_ref().map(|c| c.states.iter()));
        w.seen(self.seen.as_ref());
        w.finish()
    }

    /// Reads what `encode` wrote. Takes no more memory than the bytes justify, whatever they claim.
    ///
    /// # Errors
    /// [`Error::Damaged`] and [`Error::Version`].
    pub fn decode(bytes: &[u8]) -> Result<Snapshot, Error> {
        let damaged = |what: &str| Error::Damaged(what.into());
        let (body, hash) = bytes.split_at(bytes.len().saturating_sub(HASH));
        if body.get(..8) != Some(&MAGIC) {
            return Err(damaged("it is no stored render"));
        }
        let mut r = Reader(&body[8..]);
        let format = r.u32()?;
        if format != FORMAT {
            return Err(Error::Version { found: format, known: FORMAT });
        }
        if blake3::hash(body).as_bytes() != hash {
            return Err(damaged("its checksum is wrong"));
        }
        let mut identity = Identity::new();
        for _ in 0..r.u32()? {
            let (name, value) = (r.text()?, r.text()?);
            identity.insert(name, value);
        }
        let note = r.bytes()?.to_vec();
        let (kind, part, groups) = (r.u32()?, Part { index: r.u32()?, count: r.u32()? }, r.u32()?);
        if part.index >= part.count {
            return Err(damaged("its share does not exist"));
        }
        let share = match kind {
            0 => Share::Whole,
            1 => Share::Tiles(part),
            2 => Share::Samples(part),
            3 if groups > 0 && part.count.is_multiple_of(groups) => Share::Blocks { part, groups },
            _ => return Err(damaged("its share is of no known kind")),
        };
        let spp = r.u32()?;
        let elapsed = Duration::from_nanos(r.u64()?);
        let round = r.u32()?;
        if round > 64 {
            return Err(damaged("its schedule is out of range"));
        }
        let bounds = [r.u32()?, r.u32()?, r.u32()?, r.u32()?];
        let (tiles, layers) = (r.u32()?, r.u32()?);
        if layers > MOST_LAYERS {
            return Err(damaged("it has too many layers"));
        }
        let mut film = empty_film(bounds, tiles, layers as usize, r.0.len())?;
        let mut schedule = Schedule { round, base: Vec::new(), targets: Vec::new() };
        for tile in &mut film.tiles {
            let (base, target) = r.tile(tile)?;
            schedule.base.push(base);
            schedule.targets.push(target);
        }
        film.splats = r.splats(&film)?;
        film.chains = r.chains()?;
        let seen = match r.u32()? {
            0 => None,
            1 => Some(Seen::read(&mut r, bounds)?),
            _ => return Err(damaged("what it has seen is of no known kind")),
        };
        if !r.0.is_empty() {
            return Err(damaged("it goes on after its end"));
        }
        Ok(Snapshot { identity, note, share, spp, elapsed, film, schedule, seen })
    }

    /// Whether this is of the render that `wanted` describes.
    ///
    /// # Errors
    /// [`Error::Foreign`] with everything that differs.
    pub fn check(&self, wanted: &Identity) -> Result<(), Error> {
        let differences = differences(&self.identity, wanted, "stored with", "now");
        if differences.is_empty() { Ok(()) } else { Err(Error::Foreign(differences)) }
    }
}

/// All entries in which two identities differ, in words.
pub fn differences(a: &Identity, b: &Identity, name_a: &str, name_b: &str) -> Vec<String> {
    const LONGEST: usize = 80;
    let names: std::collections::BTreeSet<_> = a.keys().chain(b.keys()).collect();
    let word = |v: Option<&String>| {
        v.map_or("nothing".to_owned(), |v| if v.len() > LONGEST { "another value".to_owned() } else { v.clone() })
    };
    names
        .into_iter()
        .filter(|n| a.get(*n) != b.get(*n))
        .map(|n| format!("{n}: {name_a} {}, {name_b} {}", word(a.get(n)), word(b.get(n))))
        .collect()
}

/// The film of these bounds, if `left` bytes can hold it.
fn empty_film(bounds: [u32; 4], tiles: u32, layers: usize, left: usize) -> Result<Film, Error> {
    const LEAST_TILE: usize = 4 * 4 + 4 * 8 + 4;
    let [x0, x1, y0, y1] = bounds;
    let grid = |a: u32, b: u32, size: u32| u64::from(b.saturating_sub(a)).div_ceil(u64::from(size));
    // The number of tiles tells their size: where two sizes make as many, they make the same tiles.
    let size = [TILE_SIZE, NOISE_TILE_SIZE, FINE_TILE_SIZE]
        .into_iter()
        .find(|&s| x0 < x1 && y0 < y1 && grid(x0, x1, s) * grid(y0, y1, s) == u64::from(tiles))
        .filter(|_| (tiles as usize).saturating_mul(LEAST_TILE) <= left);
    size.map(|s| Film::with_tiles(bounds, s, layers))
        .ok_or_else(|| Error::Damaged("its size does not fit its content".into()))
}

pub(crate) struct Reader<'a>(pub &'a [u8]);

impl<'a> Reader<'a> {
    pub fn take(&mut self, n: usize) -> Result<&'a [u8], Error> {
        let (head, rest) = self.0.split_at_checked(n).ok_or_else(|| Error::Damaged("it ends too early".into()))?;
        self.0 = rest;
        Ok(head)
    }

    pub fn u32(&mut self) -> Result<u32, Error> {
        let b = self.take(4)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    pub fn u64(&mut self) -> Result<u64, Error> {
        Ok(u64::from(self.u32()?) | u64::from(self.u32()?) << 32)
    }

    pub fn bytes(&mut self) -> Result<&'a [u8], Error> {
        let n = self.u32()? as usize;
        self.take(n)
    }

    fn text(&mut self) -> Result<String, Error> {
        String::from_utf8(self.bytes()?.to_vec()).map_err(|_| Error::Damaged("a text in it is none".into()))
    }

    fn splats(&mut self, film: &Film) -> Result<Option<Splats>, Error> {
        match self.u32()? {
            0 => return Ok(None),
            1 => {}
            _ => return Err(Error::Damaged("its splats are of no known kind".into())),
        }
        let frame = self.u64()?;
        let [w, h] = film.size();
        let data = self.take((w * h).saturating_mul(size_of::<SplatSum>()))?;
        let fixed = |b: &[u8]| Fixed(i128::from_le_bytes(std::array::from_fn(|i| b[i])));
        let sums = data.chunks_exact(size_of::<SplatSum>()).map(|b| {
            let at = |i: usize| fixed(&b[16 * i..16 * i + 16]);
            SplatSum { rgb: [at(0), at(1), at(2)], squares: [at(3), at(4), at(5)] }
        });
        Ok(Some(Splats { frame, sums: sums.collect() }))
    }

    fn chains(&mut self) -> Result<Option<Chains>, Error> {
        match self.u32()? {
            0 => return Ok(None),
            1 => {}
            _ => return Err(Error::Damaged("its chains are of no known kind".into())),
        }
        let mut states = Vec::new();
        for _ in 0..self.u32()? {
            let mut state = ChainState::default();
            let place = &mut state.place;
            (place.step, place.age, place.large) = (self.u64()?, self.u64()?, [self.u64()?, self.u64()?]);
            state.bad = self.u64()?;
            (state.rays.camera, state.rays.scattered, state.rays.shadow) = (self.u64()?, self.u64()?, self.u64()?);
            let [age, step] = place.large;
            if place.age > place.step || age > place.age || step > place.step {
                return Err(Error::Damaged("a chain has come further than it went".into()));
            }
            for stream in &mut place.coordinates {
                const SIZE: usize = 4 + 8;
                let n = self.u32()? as usize;
                for c in self.take(n.saturating_mul(SIZE))?.chunks_exact(SIZE) {
                    let value = f32::from_le_bytes([c[0], c[1], c[2], c[3]]);
                    let age = u64::from_le_bytes(std::array::from_fn(|i| c[4 + i]));
                    if !(0.0..1.0).contains(&value) || age > place.age {
                        return Err(Error::Damaged("a chain is where none can be".into()));
                    }
                    stream.push(Coordinate { value, age });
                }
            }
            states.push(state);
        }
        Ok(Some(Chains { states }))
    }

    /// Fills a tile; its samples at the start and the end of the round.
    fn tile(&mut self, tile: &mut Tile) -> Result<(u32, u32), Error> {
        let (base, target) = (self.u32()?, self.u32()?);
        (tile.first, tile.end) = (self.u32()?, self.u32()?);
        if tile.first > tile.end || tile.end > 1 << MOST_LEVEL || target > 1 << MOST_LEVEL || base > target {
            return Err(Error::Damaged("its samples are out of range".into()));
        }
        tile.rays.camera = self.u64()?;
        tile.rays.scattered = self.u64()?;
        tile.rays.shadow = self.u64()?;
        tile.bad_count = self.u64()?;
        let bad = self.u32()? as usize;
        if bad > REMEMBERED {
            return Err(Error::Damaged("too many bad samples are listed".into()));
        }
        for _ in 0..bad {
            let (pixel, sample) = ([self.u32()?, self.u32()?], self.u32()?);
            let fault = match self.text()?.strip_prefix('!') {
                Some(message) => Fault::Panic(message.to_owned()),
                None => Fault::NotFinite,
            };
            tile.bad.push(BadSample { pixel, sample, fault });
        }
        let count = tile.len();
        for node in nodes_of(tile.first, tile.end) {
            let sums = sums(self.take(count * size_of::<PixelSum>())?);
            let layers = colors(self.take(count * tile.layers * size_of::<[f32; 3]>())?);
            tile.nodes.push(TileNode { node, sums, layers });
        }
        Ok((base, target))
    }
}

fn colors(data: &[u8]) -> Vec<[f32; 3]> {
    let float = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    data.chunks_exact(size_of::<[f32; 3]>()).map(|b| [float(b), float(&b[4..]), float(&b[8..])]).collect()
}

fn sums(data: &[u8]) -> Vec<PixelSum> {
    colors(data).chunks_exact(2).map(|pair| PixelSum { rgb: pair[0], squares: pair[1] }).collect()
}

/// The nodes of a finished range are those that its ends imply; anything else is a bug of this crate.
#[cfg(test)]
fn has_canonical_nodes(tile: &Tile) -> bool {
    tile.nodes.iter().map(|n| n.node).eq(nodes_of(tile.first, tile.end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::Landed;

    fn example() -> Snapshot {
        let mut film = Film::with_tiles([3, 40, 5, 25], TILE_SIZE, 2);
        for (i, tile) in film.tiles.iter_mut().enumerate() {
            tile.extend(5 + i as u32, |p, range, stack| {
                let sum = |s: u32| PixelSum::of([p[0] as f32 + s as f32 * 0.3, -1.0, f32::MIN_POSITIVE]);
                range.for_each(|s| stack.push_layers(sum(s), &[[s as f32, 1.0, -0.5], [p[1] as f32; 3]]));
            });
            tile.rays.shadow = u64::MAX - i as u64;
            assert!(has_canonical_nodes(tile));
        }
        let panic = BadSample { pixel: [4, 6], sample: 2, fault: Fault::Panic("é".into()) };
        let nan = BadSample { pixel: [5, 6], sample: 3, fault: Fault::NotFinite };
        film.tiles[0].remember(vec![panic, nan], 7);
        let mut splats = Splats::new([50, 60], film.bounds);
        splats.add(&[Landed { pixel: 7, rgb: [0.1, -2.0, 3e9] }, Landed { pixel: 0, rgb: [1e-9; 3] }]);
        film.splats = Some(splats);
        let mut states = vec![ChainState::default(); 3];
        states[1].place.coordinates[2] = vec![Coordinate { value: 0.25, age: 6 }, Coordinate { value: 0.0, age: 0 }];
        (states[1].place.step, states[1].place.age, states[1].place.large, states[1].bad) = (9, 6, [4, 5], 2);
        film.chains = Some(Chains { states });
        let schedule = Schedule { round: 3, base: vec![4; film.tiles.len()], targets: vec![8; film.tiles.len()] };
        Snapshot {
            identity: [("scene", "abc"), ("seed", "7")].map(|(k, v)| (k.to_owned(), v.to_owned())).into(),
            note: vec![1, 2, 3],
            share: Share::Blocks { part: Part { index: 2, count: 6 }, groups: 3 },
            spp: 64,
            elapsed: Duration::from_millis(1234),
            film,
            schedule,
            seen: Some(crate::seen::example([3, 40, 5, 25])),
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let snapshot = example();
        assert_eq!(Snapshot::decode(&snapshot.encode()).unwrap(), snapshot);
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_noticed() {
        let bytes = example().encode();
        for n in (0..bytes.len()).step_by(101).chain(0..200) {
            assert!(Snapshot::decode(&bytes[..n]).is_err(), "cut to {n} bytes");
            let mut changed = bytes.clone();
            changed[n] ^= 1 << (n % 8);
            assert!(Snapshot::decode(&changed).is_err(), "byte {n} changed");
        }
    }

    /// With the checksum set right, what is read is what was written or an error; never a panic or a huge allocation.
    #[test]
    fn lies_under_a_right_checksum_are_survived() {
        let bytes = example().encode();
        let body = bytes.len() - HASH;
        let mut rng = steradian_sampling::rng::Rng::new(5, 1);
        // FUZZ_ROUNDS asks for more.
        let rounds = std::env::var("FUZZ_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000u64);
        for round in 0..rounds {
            let mut changed = bytes[..body].to_vec();
            for _ in 0..=round % 3 {
                let at = (rng.f32() * if round % 2 == 0 { 300.0 } else { body as f32 }) as usize;
                changed[at] = (rng.f32() * 256.0) as u8;
            }
            if round % 5 == 0 {
                changed.truncate((rng.f32() * body as f32) as usize);
            }
            let hash = blake3::hash(&changed);
            changed.extend_from_slice(hash.as_bytes());
            if let Ok(read) = Snapshot::decode(&changed) {
                assert!(read.film.tiles.iter().all(has_canonical_nodes));
                assert_eq!(read.film.tiles.len(), read.schedule.targets.len());
            }
        }
    }

    #[test]
    fn what_differs_is_said() {
        let snapshot = example();
        assert_eq!(snapshot.check(&snapshot.identity), Ok(()));
        let mut other = snapshot.identity.clone();
        other.insert("seed".into(), "8".into());
        other.insert("crop".into(), "0,1".into());
        let said = snapshot.check(&other).unwrap_err().to_string();
        assert_eq!(said, "of another render: crop: stored with nothing, now 0,1; seed: stored with 7, now 8");
        let mut newer = snapshot.encode();
        newer[8] = 99;
        assert_eq!(Snapshot::decode(&newer), Err(Error::Version { found: 99, known: FORMAT }));
    }
}
