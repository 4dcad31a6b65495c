//! The part of a render that one of several machines does, and how parts become the whole again.

use crate::error::Error;
use crate::film::{Film, TILE_SIZE};

/// What to render of the film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Share {
    /// Everything.
    #[default]
    Whole,
    /// Every sample of some of the tiles.
    Tiles(Part),
    /// Some of the samples of every tile.
    Samples(Part),
    /// Some of the samples of some of the tiles: these are cut into `groups`, which divides the number of parts, and the samples of each
    /// group into as many pieces as are left.
    Blocks {
        /// Groups of tiles run fastest.
        part: Part,
        /// See above.
        groups: u32,
    },
}

/// Part `index`, from 0, of `count`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Which.
    pub index: u32,
    /// Of how many.
    pub count: u32,
}

impl Share {
    /// Part `part` of a film, cut by tiles as far as there are enough of them to go round evenly, and further by samples. Every piece of
    /// samples has sums of its own, so that what is to be merged grows with their number, and not with that of groups of tiles.
    pub fn of(film: &Film, part: Part) -> Self {
        const TILES_EACH: u64 = 8;
        let enough = |groups: &u32| film.tiles.len() as u64 >= u64::from(*groups) * TILES_EACH;
        match (1..=part.count).rev().find(|g| part.count.is_multiple_of(*g) && enough(g)) {
            Some(groups) if groups == part.count => Self::Tiles(part),
            Some(groups) if groups > 1 => Self::Blocks { part, groups },
            _ => Self::Samples(part),
        }
    }

    /// Which part this is, of how many.
    pub fn part(&self) -> Part {
        match *self {
            Share::Whole => Part { index: 0, count: 1 },
            Share::Tiles(part) | Share::Samples(part) | Share::Blocks { part, .. } => part,
        }
    }

    /// The samples of tile `i` that belong to this share, of `spp` in all. `width` is the number of tiles in a row.
    pub fn samples(&self, i: usize, width: usize, spp: u32) -> [u32; 2] {
        // Along diagonals, so that no part gets only the busy middle of the picture.
        let has = |part: Part| (i + i / width.max(1)) as u64 % u64::from(part.count.max(1)) == u64::from(part.index);
        let some = |part: Part| {
            let edge = |k: u32| (u64::from(spp) * u64::from(k) / u64::from(part.count.max(1))) as u32;
            [edge(part.index), edge(part.index + 1)]
        };
        match *self {
            Share::Whole => [0, spp],
            Share::Tiles(part) => [0, if has(part) { spp } else { 0 }],
            Share::Samples(part) => some(part),
            Share::Blocks { part: Part { index, count }, groups } => {
                if !has(Part { index: index % groups, count: groups }) {
                    return [0, 0];
                }
                some(Part { index: index / groups, count: count / groups })
            }
        }
    }
}

/// Joins films whose samples, tile by tile, follow on each other, whatever their order. The result has the bits of a film that was
/// rendered in one go.
///
/// # Errors
/// [`Error::Merge`] with the first tile whose samples overlap or are missing.
pub fn join(bounds: [u32; 4], films: &[&Film], spp: u32) -> Result<Film, Error> {
    join_up_to(bounds, films, Some(spp))
}

/// As [`join`], for parts of which some are still to come: of each tile, what follows on its first sample.
///
/// # Errors
/// [`Error::Merge`] where samples overlap.
pub fn join_what_is_there(bounds: [u32; 4], films: &[&Film]) -> Result<Film, Error> {
    join_up_to(bounds, films, None)
}

fn join_up_to(bounds: [u32; 4], films: &[&Film], spp: Option<u32>) -> Result<Film, Error> {
    let layers = films.first().map_or(0, |f| f.layers());
    let mut whole = Film::with_tiles(bounds, TILE_SIZE, layers);
    whole.splats = films.first().and_then(|f| f.splats.clone());
    whole.chains = films.first().and_then(|f| f.chains.clone());
    for film in films.iter().skip(1) {
        let other = || Error::Merge("the parts are of different integrators".into());
        match (&mut whole.splats, &film.splats) {
            (Some(sum), Some(more)) => sum.merge(more),
            (None, None) => {}
            _ => return Err(other()),
        }
        match (&mut whole.chains, &film.chains) {
            (Some(all), Some(more)) => all.merge(more).then_some(()).ok_or_else(other)?,
            (None, None) => {}
            _ => return Err(other()),
        }
    }
    if films.iter().any(|f| f.bounds != bounds || f.tiles.len() != whole.tiles.len()) {
        return Err(Error::Merge("the parts are of different pictures".into()));
    }
    for (i, tile) in whole.tiles.iter_mut().enumerate() {
        let mut pieces: Vec<_> = films.iter().map(|f| &f.tiles[i]).filter(|t| t.samples() > 0).collect();
        pieces.sort_by_key(|t| t.first);
        let [x, y] = tile.origin;
        let at = |end: u32| format!("of the tile at pixel {x},{y}, samples {end}");
        for piece in pieces {
            if piece.first > tile.end && spp.is_none() {
                break;
            }
            if piece.first > tile.end {
                return Err(Error::Merge(format!("{} to {} are missing", at(tile.end), piece.first)));
            }
            if piece.first < tile.end {
                return Err(Error::Merge(format!("{} to {} are there twice", at(piece.first), tile.end)));
            }
            if !tile.append(piece) {
                return Err(Error::Merge("the parts have different tiles".into()));
            }
        }
        if let Some(spp) = spp.filter(|&spp| spp != tile.end) {
            return Err(Error::Merge(format!("{} to {spp} are missing", at(tile.end))));
        }
    }
    Ok(whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sums::{PixelSum, nodes_of};
    use proptest::prelude::*;

    fn value(p: [u32; 2], sample: u32) -> PixelSum {
        let bits = (p[0] * 7919 + p[1] * 104_729 + sample).wrapping_mul(2_654_435_769);
        PixelSum::of([bits as f32 * 1e-9, 1.0 / (1 + sample) as f32, (bits >> 9) as f32])
    }

    const BOUNDS: [u32; 4] = [5, 45, 2, 22];

    fn film(range: impl Fn(usize) -> [u32; 2]) -> Film {
        let mut film = Film::new(BOUNDS);
        for (i, tile) in film.tiles.iter_mut().enumerate() {
            let [first, end] = range(i);
            (tile.first, tile.end) = (first, first);
            tile.extend(end, |p, range, stack| range.for_each(|s| stack.push(value(p, s))));
        }
        film
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

        /// Cut into random pieces, tile by tile, shuffled over random films: the merged bits are those of the whole.
        #[test]
        fn any_partition_merges_to_the_whole(
            spp in 1u32..200,
            cuts in proptest::collection::vec((0u32..200, 0u32..200), 6),
            order in Just([0usize, 1, 2]).prop_shuffle(),
        ) {
            let whole = film(|_| [0, spp]);
            let parts: Vec<Film> = order
                .iter()
                .map(|&piece| {
                    film(|i| {
                        let (a, b) = cuts[i % cuts.len()];
                        let (a, b) = (a.min(b).min(spp), a.max(b).min(spp));
                        [[0, a], [a, b], [b, spp]][(piece + i) % 3]
                    })
                })
                .collect();
            let joined = join(BOUNDS, &parts.iter().collect::<Vec<_>>(), spp).unwrap();
            prop_assert_eq!(joined, whole);
        }

        #[test]
        fn shares_cover_every_sample_once(count in 1u32..40, spp in 1u32..100, by in 0..4) {
            let parts: Vec<Film> = (0..count)
                .map(|index| {
                    let part = Part { index, count };
                    let groups = (1..=count.min(3)).rev().find(|g| count.is_multiple_of(*g)).unwrap_or(1);
                    let share = match by {
                        0 => Share::Tiles(part),
                        1 => Share::Samples(part),
                        2 => Share::Blocks { part, groups },
                        _ => Share::of(&Film::new(BOUNDS), part),
                    };
                    film(|i| share.samples(i, 3, spp))
                })
                .collect();
            prop_assert_eq!(join(BOUNDS, &parts.iter().rev().collect::<Vec<_>>(), spp).unwrap(), film(|_| [0, spp]));
        }
    }

    /// 48 x 48 pixels are nine tiles; 160 x 160 a hundred.
    #[test]
    fn parts_are_cut_by_tiles_as_far_as_there_are_enough() {
        let of = |size: u32, count: u32| Share::of(&Film::new([0, size, 0, size]), Part { index: 1, count });
        let part = |count| Part { index: 1, count };
        assert_eq!(of(48, 2), Share::Samples(part(2)));
        assert_eq!(of(160, 12), Share::Tiles(part(12)));
        assert_eq!(of(160, 24), Share::Blocks { part: part(24), groups: 12 });
        assert_eq!(of(160, 26), Share::Blocks { part: part(26), groups: 2 });
        assert_eq!(of(160, 13), Share::Samples(part(13)));
    }

    #[test]
    fn what_overlaps_or_is_missing_is_named() {
        let said = |ranges: &[[u32; 2]]| {
            let parts: Vec<Film> = ranges.iter().map(|&r| film(|_| r)).collect();
            join(BOUNDS, &parts.iter().collect::<Vec<_>>(), 10).unwrap_err().to_string()
        };
        assert!(said(&[[0, 4], [5, 10]]).ends_with("of the tile at pixel 5,2, samples 4 to 5 are missing"));
        assert!(said(&[[0, 4], [3, 10]]).ends_with("samples 3 to 4 are there twice"));
        assert!(said(&[[0, 4]]).ends_with("samples 4 to 10 are missing"));
        assert_eq!(nodes_of(0, 10).len(), 2);
    }

    #[test]
    fn what_is_there_of_an_unfinished_render_is_its_beginning() {
        let parts: Vec<Film> = [[4, 7], [0, 4], [8, 10]].into_iter().map(|r| film(|_| r)).collect();
        let joined = join_what_is_there(BOUNDS, &parts.iter().collect::<Vec<_>>()).unwrap();
        assert_eq!(joined, film(|_| [0, 7]));
    }
}
