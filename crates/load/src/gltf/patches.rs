//! Patches of a mesh that are given tangents one by one, on all cores, with the same result as all at once.
//!
//! A tangent of MikkTSpace depends on the faces around its vertex alone, but for faces without an area in the texture: they join whom they
//! meet first, so that all of them that hang together, and what is around them, go into one patch.

use super::meshes::Geometry;
use rayon::prelude::*;
use std::collections::BTreeMap;
use steradian_math::{Bounds3, Point3, Vec3};

/// Faces of a patch: about as many as a core keeps at hand.
const PATCH: usize = 1 << 14;
/// Fans of more faces around a point are taken apart: time grows with the square of their number, and the stack with it.
const FAN: u32 = 1024;
/// If patches and what is around them have this many times the faces of the mesh, it is not worth it.
const MOST: usize = 4;

/// A set of small numbers.
struct Marks(Vec<u64>);

impl Marks {
    fn new(size: usize) -> Self {
        Self(vec![0; size.div_ceil(64)])
    }

    fn contains(&self, i: u32) -> bool {
        self.0[i as usize / 64] >> (i % 64) & 1 == 1
    }

    fn insert(&mut self, i: u32) {
        self.0[i as usize / 64] |= 1 << (i % 64);
    }

    /// All of them, from the least on.
    fn list(&self) -> Vec<u32> {
        let mut out = Vec::new();
        for (k, &word) in self.0.iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                out.push(64 * k as u32 + rest.trailing_zeros());
                rest &= rest - 1;
            }
        }
        out
    }
}

/// A mesh in patches.
pub(super) struct Patches {
    mesh: Neighbours,
    cut: Vec<Vec<u32>>,
    /// Whether what is around a patch goes with it.
    overlap: bool,
}

impl Patches {
    /// Cuts a mesh; into one patch where that is as good.
    pub fn new(geometry: &Geometry, set: usize) -> Self {
        let mesh = Neighbours::new(geometry, set);
        let count = mesh.points.len();
        if count > 2 * PATCH || mesh.has_fans {
            let cut = mesh.cut(geometry);
            // A part of them tells.
            let some: Vec<&Vec<u32>> = cut.iter().step_by(8).collect();
            let own: usize = some.iter().map(|faces| faces.len()).sum();
            let all: usize = some.par_iter().map(|faces| mesh.with_neighbours(faces).len()).sum();
            let overlap = all <= MOST * own;
            if overlap || mesh.has_fans {
                return Self { mesh, cut, overlap };
            }
        }
        Self { mesh, cut: vec![(0..count as u32).collect()], overlap: false }
    }

    /// How many there are.
    #[cfg(test)]
    pub fn count(&self) -> usize {
        self.cut.len()
    }

    /// What `work` makes of the faces that it is given, for each face. It is given patches with what is around them, from the least
    /// face on.
    pub fn each<T: Copy + Send>(&self, nothing: T, work: impl Fn(&[u32]) -> Vec<T> + Sync) -> Vec<T> {
        let one = |faces: &Vec<u32>| -> Vec<(u32, T)> {
            let mut own = faces.clone();
            own.sort_unstable();
            let all = if self.overlap { self.mesh.with_neighbours(faces) } else { own.clone() };
            let found = all.iter().copied().zip(work(&all));
            found.filter(|(f, _)| own.binary_search(f).is_ok()).collect()
        };
        let found: Vec<Vec<(u32, T)>> = self.cut.par_iter().map(one).collect();
        let mut out = vec![nothing; self.mesh.points.len()];
        found.into_iter().flatten().for_each(|(f, t)| out[f as usize] = t);
        out
    }
}

/// Which faces meet in which points.
struct Neighbours {
    /// The points of each face.
    points: Vec<[u32; 3]>,
    /// Where the faces around each point begin in `faces`.
    begin: Vec<u32>,
    faces: Vec<u32>,
    /// Faces without an area in the texture.
    is_flat: Marks,
    has_fans: bool,
}

impl Neighbours {
    fn new(geometry: &Geometry, set: usize) -> Self {
        let points = points(geometry);
        let most = points.iter().flatten().max().map_or(0, |&p| p as usize + 1);
        let mut begin = vec![0u32; most + 1];
        points.iter().flatten().for_each(|&p| begin[p as usize + 1] += 1);
        let has_fans = begin.iter().any(|&n| n > FAN);
        (0..most).for_each(|p| begin[p + 1] += begin[p]);
        let mut next = begin.clone();
        let mut faces = vec![0; 3 * points.len()];
        for (f, corners) in points.iter().enumerate() {
            for &p in corners {
                faces[next[p as usize] as usize] = f as u32;
                next[p as usize] += 1;
            }
        }
        let mut is_flat = Marks::new(points.len());
        for f in (0..points.len()).filter(|&f| is_flat_in_texture(geometry, set, f)) {
            is_flat.insert(f as u32);
        }
        Self { points, begin, faces, is_flat, has_fans }
    }

    /// Faces and those that their tangents depend on, from the least on.
    fn with_neighbours(&self, faces: &[u32]) -> Vec<u32> {
        let mut marks = Marks::new(self.points.len());
        let mut in_fan: BTreeMap<u32, u32> = BTreeMap::new();
        let mut is_welcome = |f: u32| {
            let fans = self.points[f as usize].into_iter().filter(|&p| self.has_fans && self.is_fan(p));
            fans.fold(true, |all, p| {
                let n = in_fan.entry(p).or_default();
                *n += 1;
                all && *n <= 2 * FAN
            })
        };
        for &f in faces {
            marks.insert(f);
            is_welcome(f);
        }
        let mut flat: Vec<u32> = faces.iter().copied().filter(|&f| self.is_flat.contains(f)).collect();
        let mut add = |around: u32, flat: &mut Vec<u32>| {
            for &f in self.points[around as usize].iter().flat_map(|&p| self.around(p)) {
                if !marks.contains(f) && is_welcome(f) {
                    marks.insert(f);
                    if self.is_flat.contains(f) {
                        flat.push(f);
                    }
                }
            }
        };
        faces.iter().for_each(|&f| add(f, &mut flat));
        while let Some(f) = flat.pop() {
            add(f, &mut flat);
        }
        marks.list()
    }

    fn is_fan(&self, p: u32) -> bool {
        self.begin[p as usize + 1] - self.begin[p as usize] > FAN
    }

    /// The faces around a point; none if they are a fan that is taken apart.
    fn around(&self, p: u32) -> &[u32] {
        let [a, b] = [p, p + 1].map(|k| self.begin[k as usize] as usize);
        if self.is_fan(p) { &[] } else { &self.faces[a..b] }
    }

    /// Faces that lie near each other, cut where there are enough of them or of a fan.
    fn cut(&self, geometry: &Geometry) -> Vec<Vec<u32>> {
        let mut in_fan = vec![0u32; if self.has_fans { self.begin.len() } else { 0 }];
        let mut out = vec![Vec::new()];
        for f in along_a_curve(geometry) {
            let fans = self.points[f as usize].into_iter().filter(|&p| self.has_fans && self.is_fan(p));
            let mut is_full = out.last().is_some_and(|last| last.len() >= PATCH);
            for p in fans.clone() {
                in_fan[p as usize] += 1;
                is_full |= in_fan[p as usize] > FAN;
            }
            if is_full {
                in_fan.fill(0);
                fans.for_each(|p| in_fan[p as usize] = 1);
                out.push(Vec::new());
            }
            out.last_mut().into_iter().for_each(|last| last.push(f));
        }
        out
    }
}

/// Numbers for the places where vertices are, by face.
fn points(geometry: &Geometry) -> Vec<[u32; 3]> {
    let bits = |(v, p): (usize, &[f32; 3])| {
        let [x, y, z] = p.map(|c| u128::from(c.to_bits()));
        x << 96 | y << 64 | z << 32 | v as u128
    };
    let mut sorted: Vec<u128> = geometry.positions.par_iter().enumerate().map(bits).collect();
    sorted.par_sort_unstable();
    let mut number = vec![0u32; sorted.len()];
    let mut last = 0;
    for (k, &key) in sorted.iter().enumerate() {
        last += u32::from(k > 0 && sorted[k - 1] >> 32 != key >> 32);
        number[key as u32 as usize] = last;
    }
    geometry.indices.par_iter().map(|f| f.map(|v| number[v as usize])).collect()
}

/// The faces by where they are on Morton's curve.
fn along_a_curve(geometry: &Geometry) -> impl Iterator<Item = u32> {
    let corner = |f: &[u32; 3]| {
        let [x, y, z] = geometry.positions[f[0] as usize];
        Point3::new(x, y, z)
    };
    let bounds = geometry.indices.iter().fold(Bounds3::default(), |b, f| b.union_point(corner(f)));
    let spread = |v: u32| (0..10).fold(0u32, |out, k| out | (v >> k & 1) << (3 * k));
    let key = |(i, f): (usize, &[u32; 3])| {
        let o = bounds.offset(corner(f));
        let [x, y, z] = [o.x, o.y, o.z].map(|c| spread((c * 1023.0) as u32));
        u64::from(x | y << 1 | z << 2) << 32 | i as u64
    };
    let mut sorted: Vec<u64> = geometry.indices.par_iter().enumerate().map(key).collect();
    sorted.par_sort_unstable();
    sorted.into_iter().map(|k| k as u32)
}

/// Whether the texture says nothing about the directions on a face.
fn is_flat_in_texture(geometry: &Geometry, set: usize, face: usize) -> bool {
    let corners = geometry.indices[face].map(|v| v as usize);
    let [a, b, c] = corners.map(|v| geometry.uvs[set][v]);
    let [p, q, r] = corners.map(|v| Vec3::from_array(geometry.positions[v]));
    let ([du1, dv1], [du2, dv2]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let area = (du1 * dv2 - dv1 * du2).abs();
    let (s, t) = ((q - p) * dv2 - (r - p) * dv1, (r - p) * du1 - (q - p) * du2);
    const LEAST: f32 = 1e-30;
    !(area > LEAST && s.length() > LEAST && t.length() > LEAST)
}
