//! What there is to see of a pane, in half floats: the one copy that all tabs are served from.
//!
//! Each tile carries the moment when it last changed, and each tab the moment of the last change that it has been sent. A tab that is
//! slow so gets fewer and newer pictures, and nothing is ever queued for it.

use half::f16;
use std::sync::Arc;
use steradian_render::TILE_SIZE;

/// Red, green, blue, and the relative standard error.
pub(crate) const CHANNELS: usize = 4;

/// Stands for an error that is not known.
pub(crate) const UNKNOWN_ERROR: f32 = 60_000.0;

/// A pixel as it is sent.
pub(crate) fn encode(rgb: [f32; 3], error: f32) -> [u16; CHANNELS] {
    // What half floats cannot hold is at least as bright as they can say; what is no number is sent as one.
    let held = |v: f32| f16::from_f32(v.clamp(-65504.0, 65504.0)).to_bits();
    [held(rgb[0]), held(rgb[1]), held(rgb[2]), held(error)]
}

/// A rectangle of pixels.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patch {
    /// When it last changed.
    pub stamp: u64,
    /// Samples in each of its pixels.
    pub samples: u32,
    /// Row by row, [`CHANNELS`] numbers for each pixel.
    pub texels: Arc<[u16]>,
}

/// The whole picture, coarsely.
#[derive(Clone, Debug)]
pub(crate) struct Coarse {
    /// When it was made.
    pub stamp: u64,
    /// Pixels between samples.
    pub stride: u32,
    /// Width and height of what there is.
    pub size: [u32; 2],
    /// Row by row.
    pub texels: Arc<[u16]>,
}

/// The picture of a pane.
#[derive(Debug, Default)]
pub(crate) struct Canvas {
    /// Counts the changes of what the picture is of.
    pub generation: u32,
    /// Width and height.
    pub size: [u32; 2],
    /// The first pixel in x and y, in the full image.
    pub origin: [u32; 2],
    /// The newest coarse picture.
    pub coarse: Option<Coarse>,
    /// The tiles, row by row; without texels until they have been rendered.
    pub tiles: Vec<Patch>,
    clock: u64,
}

impl Canvas {
    /// Starts again with another picture.
    pub fn reset(&mut self, generation: u32, bounds: [u32; 4]) {
        let [x0, x1, y0, y1] = bounds;
        self.generation = generation;
        self.origin = [x0, y0];
        self.size = [x1 - x0, y1 - y0];
        let [columns, rows] = self.grid();
        self.coarse = None;
        self.tiles = vec![Patch::default(); (columns * rows) as usize];
    }

    /// Columns and rows of tiles.
    pub fn grid(&self) -> [u32; 2] {
        self.size.map(|n| n.div_ceil(TILE_SIZE))
    }

    /// Width and height of a tile.
    pub fn tile_size(&self, i: usize) -> [u32; 2] {
        let columns = self.grid()[0].max(1);
        let at = [i as u32 % columns, i as u32 / columns];
        std::array::from_fn(|axis| TILE_SIZE.min(self.size[axis] - at[axis] * TILE_SIZE))
    }

    /// Takes a coarse picture.
    pub fn put_coarse(&mut self, stride: u32, size: [u32; 2], texels: Vec<u16>) {
        self.clock += 1;
        self.coarse = Some(Coarse { stamp: self.clock, stride, size, texels: texels.into() });
    }

    /// Takes a tile.
    pub fn put(&mut self, i: usize, samples: u32, texels: Vec<u16>) {
        self.clock += 1;
        if let Some(tile) = self.tiles.get_mut(i) {
            *tile = Patch { stamp: self.clock, samples, texels: texels.into() };
        }
    }

    /// A pixel, from its place in the picture: its colour, and its number of samples. `None` where nothing has been rendered.
    pub fn pixel(&self, x: u32, y: u32) -> Option<([u16; CHANNELS], u32)> {
        if x >= self.size[0] || y >= self.size[1] {
            return None;
        }
        let i = (y / TILE_SIZE * self.grid()[0] + x / TILE_SIZE) as usize;
        let tile = &self.tiles[i];
        let at = ((y % TILE_SIZE) * self.tile_size(i)[0] + x % TILE_SIZE) as usize * CHANNELS;
        Some((tile.texels.get(at..at + CHANNELS)?.try_into().ok()?, tile.samples))
    }

    /// All pixels as colours; `None` unless all have been rendered.
    pub fn colors(&self) -> Option<Vec<[f32; 3]>> {
        let [w, h] = self.size;
        let mut out = Vec::with_capacity((w * h) as usize);
        for y in 0..h {
            for x in 0..w {
                let (texel, _) = self.pixel(x, y)?;
                out.push(std::array::from_fn(|c| f16::from_bits(texel[c]).to_f32()));
            }
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_found_in_tiles_cut_at_the_edge() {
        let mut canvas = Canvas::default();
        canvas.reset(1, [0, 20, 0, 18]);
        assert_eq!((canvas.grid(), canvas.tile_size(0), canvas.tile_size(3)), ([2, 2], [16, 16], [4, 2]));
        assert!(canvas.colors().is_none());
        for i in 0..4 {
            let [w, h] = canvas.tile_size(i);
            let texels = (0..w * h).flat_map(|p| encode([i as f32, p as f32, 1e9], f32::NAN)).collect();
            canvas.put(i, 7, texels);
        }
        let (texel, samples) = canvas.pixel(19, 17).unwrap();
        assert_eq!(samples, 7);
        assert_eq!(texel[..3].iter().map(|&v| f16::from_bits(v).to_f32()).collect::<Vec<_>>(), [3.0, 7.0, 65504.0]);
        assert!(canvas.pixel(20, 0).is_none());
        assert_eq!(canvas.colors().unwrap().len(), 360);
        assert_eq!(canvas.clock, 4);
    }
}
