//! Skins: vertices that hang on joints (glTF 2.0, 3.7.3).

use super::Gltf;
use super::buffers::missing;
use super::json::{Json, Result};
use super::meshes::{Geometry, Pose};
use rayon::prelude::*;
use steradian_math::{Point3, Transform, Vec3};

/// The first three rows of an affine matrix. It need not have an inverse: joints are squeezed to nothing to hide what hangs on them.
pub(super) type Rows = [[f32; 4]; 3];

impl<'d> Gltf<'d, '_> {
    /// Where the joints of a skin put what was bound to them.
    pub(super) fn joints(&self, at: &Json, skin: usize) -> Result<Vec<Rows>> {
        let skins = self.root.list("skins")?;
        let skin = skins.get(skin).ok_or_else(|| missing(at, "skin", "skin", skin, skins.len()))?;
        let joints = skin.need("joints")?.items()?;
        if joints.is_empty() {
            return Err(skin.problem("a skin without joints"));
        }
        let bind = match skin.get("inverseBindMatrices") {
            Some(_) => {
                let a = self.accessor(skin, "inverseBindMatrices")?;
                let m = a.floats::<16>()?;
                if m.len() < joints.len() {
                    return Err(a.problem(format!("{} matrices for {} joints", m.len(), joints.len())));
                }
                m
            }
            None => Vec::new(),
        };
        let place = |(i, j): (usize, &Json)| {
            let node = j.as_count()?;
            let Some(world) = self.joint_places.get(&node) else {
                return Err(j.problem(format!("joint {node} is no node of the scene")));
            };
            Ok(match bind.get(i) {
                Some(m) => multiply(world, &std::array::from_fn(|r| std::array::from_fn(|c| m[4 * c + r]))),
                None => *world,
            })
        };
        joints.iter().enumerate().map(place).collect()
    }

    /// Moves vertices with the joints of a skin.
    pub(super) fn skin(&self, attributes: &Json<'d>, pose: &Pose, g: &mut Geometry) -> Result<()> {
        if pose.joints.is_empty() {
            return Ok(());
        }
        let (mut joints, mut weights) = (Vec::new(), Vec::new());
        for set in 0..4 {
            let (j, w) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
            if attributes.get(&j).is_none() {
                break;
            }
            let j = self.accessor(attributes, &j)?;
            joints.push(j.joints()?);
            weights.push(self.accessor(attributes, &w)?.floats::<4>()?);
            let n = g.positions.len();
            if joints[set].len() != n || weights[set].len() != n {
                return Err(j.problem(format!("joints and weights for other than the {n} vertices there are")));
            }
            let most = pose.joints.len();
            if let Some(v) = joints[set].iter().position(|js| js.iter().any(|&j| j as usize >= most)) {
                return Err(j.problem(format!("vertex {v} hangs on a joint that the skin, with {most}, does not have")));
            }
        }
        if joints.is_empty() {
            return Ok(());
        }
        let matrices = &pose.joints;
        let blend = |v: usize| {
            let mut m: Rows = [[0.0; 4]; 3];
            let mut total = 0.0;
            for (js, ws) in joints.iter().zip(&weights) {
                for k in 0..4 {
                    let w = ws[v][k].max(0.0);
                    if w > 0.0 {
                        total += w;
                        let j = &matrices[js[v][k] as usize];
                        (0..3).for_each(|r| (0..4).for_each(|c| m[r][c] += w * j[r][c]));
                    }
                }
            }
            if total > 0.0 {
                m.iter_mut().flatten().for_each(|x| *x /= total);
                m
            } else {
                matrices[0]
            }
        };
        let blended: Vec<Rows> = (0..g.positions.len()).into_par_iter().map(blend).collect();
        let turn = |m: &Rows, v: [f32; 3]| -> [f32; 3] {
            std::array::from_fn(|r| m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2])
        };
        for (p, m) in g.positions.iter_mut().zip(&blended) {
            let moved = turn(m, *p);
            *p = std::array::from_fn(|r| moved[r] + m[r][3]);
        }
        for (n, m) in g.normals.iter_mut().zip(&blended) {
            *n = cofactors(m, *n);
        }
        for (t, m) in g.tangents.iter_mut().zip(&blended) {
            let [x, y, z] = turn(m, [t[0], t[1], t[2]]);
            *t = [x, y, z, t[3]];
        }
        Ok(())
    }
}

/// The first three rows of an affine transform.
pub(super) fn rows(t: &Transform) -> Rows {
    let o = t.point(Point3::default());
    let columns = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)].map(|v| t.vector(v));
    std::array::from_fn(|r| [columns[0][r], columns[1][r], columns[2][r], o[r]])
}

/// The matrix that applies `b` first and then `a`.
pub(super) fn multiply(a: &Rows, b: &Rows) -> Rows {
    let entry = |r: usize, c: usize| {
        let sum: f64 = (0..3).map(|k| f64::from(a[r][k]) * f64::from(b[k][c])).sum();
        (if c == 3 { sum + f64::from(a[r][3]) } else { sum }) as f32
    };
    std::array::from_fn(|r| std::array::from_fn(|c| entry(r, c)))
}

/// A normal moved as surfaces are: by the matrix of cofactors.
fn cofactors(m: &Rows, n: [f32; 3]) -> [f32; 3] {
    let row = |r: usize| Vec3::new(m[r][0], m[r][1], m[r][2]);
    let (a, b, c) = (row(0), row(1), row(2));
    let n = Vec3::from_array(n);
    [b.cross(c).dot(n), c.cross(a).dot(n), a.cross(b).dot(n)]
}
