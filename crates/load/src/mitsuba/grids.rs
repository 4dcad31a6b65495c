//! Mitsuba's grids of values, in files of their own, and what reads them besides media: textures and signed distances.

use super::Mitsuba;
use super::tree::Object;
use crate::files::read_all;
use steradian_geometry::DistanceGrid;
use steradian_image::Wrap;
use steradian_math::{Bounds3, Point3, Transform};
use steradian_scene::{GridTexture, Handle, Shape};

/// A grid as a file has it: one or three channels at the centres of cells, x fastest.
struct Grid {
    size: [u32; 3],
    channels: usize,
    values: Vec<f32>,
    bounds: Bounds3,
}

impl Mitsuba<'_> {
    /// The grid of a medium's coefficient, and where the unit cube that it fills lies.
    pub(super) fn grid(&mut self, v: &Object) -> Option<(GridTexture, Transform)> {
        let grid = self.placed_grid(v)?;
        let place = grid.texture_from_world.inverse();
        Some((grid, place))
    }

    fn values(&mut self, o: &Object) -> Option<Grid> {
        let Some(name) = self.text(o, "filename") else {
            self.error("a grid needs a `filename`", o.span);
            return None;
        };
        let read = self.reader.resolve(&name).and_then(|p| read_all(self.files, &p));
        let grid = read.and_then(|bytes| parse(&bytes).map_err(|m| format!("{name}: {m}")));
        grid.map_err(|m| self.error(m, o.span)).ok()
    }

    /// A grid that a texture looks up.
    pub(super) fn grid_texture(&mut self, v: &Object) -> Option<Handle<GridTexture>> {
        let grid = self.placed_grid(v)?;
        self.finish(v);
        Some(self.scene.grids.push(grid))
    }

    fn placed_grid(&mut self, v: &Object) -> Option<GridTexture> {
        let grid = self.values(v)?;
        for ignored in ["raw", "accel"] {
            v.get(ignored);
        }
        let wrap = match self.text(v, "wrap_mode").as_deref() {
            None | Some("clamp") => Wrap::Clamp,
            Some("repeat") => Wrap::Repeat,
            Some("mirror") => Wrap::Mirror,
            Some(other) => {
                self.error(format!("`{other}` is none of repeat, mirror and clamp"), v.span);
                Wrap::Clamp
            }
        };
        let nearest = self.text(v, "filter_type").as_deref() == Some("nearest");
        let mut place = self.transform(v, "to_world");
        if self.flag(v, "use_grid_bbox", false) {
            let (low, d) = (grid.bounds.min, grid.bounds.diagonal());
            let Some(unit) = Transform::scale(d.x, d.y, d.z) else {
                self.error("the box of the grid is empty", v.span);
                return None;
            };
            place = place.mul(&Transform::translate(low.to_vec())).mul(&unit);
        }
        let Grid { size, channels, values, .. } = grid;
        let texture_from_world = place.inverse();
        Some(GridTexture { texture_from_world, size, channels, values, wrap, nearest })
    }

    /// A surface where signed distances are zero.
    pub(super) fn distances(&mut self, o: &Object) -> Option<Shape> {
        let grid = self.values(o)?;
        let smooth = match self.text(o, "normals").as_deref() {
            None | Some("smooth") => true,
            Some("analytic") => false,
            Some(other) => {
                self.error(format!("`{other}` is none of the normals smooth and analytic"), o.span);
                true
            }
        };
        if grid.channels != 1 {
            self.error(format!("signed distances have one channel, not {}", grid.channels), o.span);
            return None;
        }
        let distances = DistanceGrid::new(grid.size, grid.values, smooth);
        let distances = distances.map_err(|e| self.error(e.to_string(), o.span)).ok()?;
        Some(Shape::Distances(self.scene.distance_grids.push(distances)))
    }
}

/// The largest grid that is read, in numbers.
const MOST_VALUES: u64 = 1 << 31;

/// Mitsuba's grids: a header of 48 bytes, then floats.
fn parse(bytes: &[u8]) -> Result<Grid, String> {
    let word = |at: usize| -> Result<[u8; 4], String> {
        bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).ok_or_else(|| "truncated header".to_string())
    };
    let whole = |at: usize| word(at).map(i32::from_le_bytes);
    let float = |at: usize| word(at).map(f32::from_le_bytes);
    if !bytes.starts_with(b"VOL") || bytes.get(3) != Some(&3) {
        return Err("not a grid of Mitsuba's version 3".into());
    }
    if whole(4)? != 1 {
        return Err("a grid of another type than 32-bit floats".into());
    }
    let mut size = [0u32; 3];
    for (k, n) in size.iter_mut().enumerate() {
        *n = u32::try_from(whole(8 + 4 * k)?).ok().filter(|&n| n > 0).ok_or("a grid without cells")?;
    }
    let channels = whole(20)?;
    if !matches!(channels, 1 | 3) {
        return Err(format!("a grid of {channels} channels; 1 and 3 can be read"));
    }
    let channels = channels as usize;
    let mut corner = [0.0; 6];
    for (k, c) in corner.iter_mut().enumerate() {
        *c = float(24 + 4 * k)?;
    }
    let count = size.iter().try_fold(channels as u64, |c, &n| c.checked_mul(u64::from(n))).unwrap_or(u64::MAX);
    let data = &bytes[48..];
    if count > MOST_VALUES || data.len() as u64 / 4 < count {
        return Err(format!("the header promises {count} numbers, the file has {}", data.len() / 4));
    }
    let values = data.as_chunks::<4>().0.iter().take(count as usize).map(|b| f32::from_le_bytes(*b)).collect();
    let bounds = Bounds3 {
        min: Point3::new(corner[0], corner[1], corner[2]),
        max: Point3::new(corner[3], corner[4], corner[5]),
    };
    Ok(Grid { size, channels, values, bounds })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(size: [i32; 3], values: &[f32]) -> Vec<u8> {
        let mut out = b"VOL\x03".to_vec();
        out.extend([1, size[0], size[1], size[2], 1].iter().flat_map(|v: &i32| v.to_le_bytes()));
        out.extend([0.0f32, 0.0, 0.0, 2.0, 1.0, 1.0].iter().flat_map(|v| v.to_le_bytes()));
        out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        out
    }

    #[test]
    fn a_grid_is_read() {
        let g = parse(&file([2, 1, 1], &[3.0, 5.0])).unwrap();
        assert_eq!((g.size, g.channels, g.values), ([2, 1, 1], 1, vec![3.0, 5.0]));
        assert_eq!((g.bounds.min.x, g.bounds.max.x, g.bounds.max.y), (0.0, 2.0, 1.0));
    }

    #[test]
    fn a_header_that_lies_is_an_error() {
        assert!(parse(&file([2, 1, 1], &[3.0])).is_err_and(|m| m.contains("promises 2")));
        assert!(parse(&file([i32::MAX, i32::MAX, i32::MAX], &[3.0])).is_err());
        assert!(parse(&file([-1, 1, 1], &[3.0])).is_err());
        assert!(parse(b"VOL\x03").is_err() && parse(b"").is_err());
    }
}
