//! Photons by place: a hashed grid of cells (Teschner et al. 2003).

use super::Photon;
use steradian_math::Point3;

/// Photons sorted by cell.
#[derive(Clone, Debug, Default)]
pub(super) struct PhotonGrid {
    /// Bucket by bucket; in a bucket, in the order in which they were given.
    photons: Vec<Photon>,
    radius: f32,
    /// Where each bucket starts; one more entry at the end.
    starts: Vec<u32>,
}

type Cell = [i32; 3];

impl PhotonGrid {
    /// Sorts photons, to be looked for within a radius.
    pub fn new(given: &[Vec<Photon>], radius: f32) -> Self {
        let all = || given.iter().flatten();
        let buckets = all().count().next_power_of_two();
        let of = |p: &Photon| bucket(cell_of(p.p, radius), buckets) as usize;
        let mut starts = vec![0u32; buckets + 1];
        for p in all() {
            starts[of(p) + 1] += 1;
        }
        for b in 0..buckets {
            starts[b + 1] += starts[b];
        }
        let mut next = starts.clone();
        let mut photons = vec![Photon::default(); starts[buckets] as usize];
        for p in all() {
            let at = &mut next[of(p)];
            photons[*at as usize] = *p;
            *at += 1;
        }
        Self { photons, radius, starts }
    }

    /// The photons within the radius of a point, in an order that depends on nothing but what was given.
    #[inline]
    pub fn within(&self, p: Point3, mut found: impl FnMut(&Photon)) {
        if self.photons.is_empty() {
            return;
        }
        let r = self.radius;
        let [low, high] = [-r, r].map(|r| cell_of(Point3::new(p.x + r, p.y + r, p.z + r), self.radius));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let cell = [x, y, z];
                    let b = bucket(cell, self.starts.len() - 1) as usize;
                    for photon in &self.photons[self.starts[b] as usize..self.starts[b + 1] as usize] {
                        // Two cells may share a bucket.
                        if photon.p.distance_squared(p) <= r * r && cell_of(photon.p, r) == cell {
                            found(photon);
                        }
                    }
                }
            }
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.photons.len()
    }
}

/// Cells are twice the radius wide, so that a ball touches at most two in each direction, or three by rounding.
fn cell_of(p: Point3, radius: f32) -> Cell {
    [p.x, p.y, p.z].map(|v| (v / (2.0 * radius)).floor() as i32)
}

fn bucket(cell: Cell, buckets: usize) -> u32 {
    let [x, y, z] = cell.map(|v| v as u32);
    let h = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
    (h ^ (h >> 16)) & (buckets as u32 - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sampling::Rng;

    #[test]
    fn all_neighbours_are_found_once() {
        let mut rng = Rng::new(4, 0);
        let mut point = |s: f32| Point3::new((rng.f32() - 0.5) * s, (rng.f32() - 0.5) * s, (rng.f32() - 0.5) * s);
        let photons: Vec<Vec<Photon>> = (0..3)
            .map(|k| (0..1000).map(|i| Photon { p: point(4.0), depth: k * 1000 + i, ..Photon::default() }).collect())
            .collect();
        for radius in [0.02, 0.3, 1.0, 5.0] {
            let grid = PhotonGrid::new(&photons, radius);
            assert_eq!(grid.len(), 3000);
            for _ in 0..50 {
                let p = point(5.0);
                let mut found = Vec::new();
                grid.within(p, |photon| found.push(photon.depth));
                found.sort_unstable();
                let expected: Vec<u32> = photons
                    .iter()
                    .flatten()
                    .filter(|q| q.p.distance_squared(p) <= radius * radius)
                    .map(|q| q.depth)
                    .collect();
                assert_eq!(found, expected, "{radius}");
            }
        }
        PhotonGrid::new(&[], 1.0).within(Point3::default(), |_| panic!("there are none"));
        // Cells that cannot be counted are still searched.
        let far = vec![Photon { p: Point3::new(3e30, 1e30, -2e30), ..Photon::default() }];
        let mut n = 0;
        PhotonGrid::new(&[far], 1e-20).within(Point3::new(3e30, 1e30, -2e30), |_| n += 1);
        assert_eq!(n, 1);
    }
}
