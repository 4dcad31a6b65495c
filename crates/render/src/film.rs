//! The film: tiles of pixel sums, and the image that they amount to.

use crate::sums::{PixelStack, PixelSum, bits};

/// Width and height of a tile. Part of no result: pixels do not know their tile.
pub const TILE_SIZE: u32 = 16;

/// A rectangle of pixels with one plane of partial sums for each bit of its sample count.
#[derive(Clone, Debug)]
pub struct Tile {
    /// First pixel in x and y, in the full image.
    pub origin: [u32; 2],
    /// Width and height.
    pub size: [u32; 2],
    /// Samples taken in every pixel.
    pub samples: u32,
    planes: Vec<Vec<PixelSum>>,
}

impl Tile {
    fn new(origin: [u32; 2], size: [u32; 2]) -> Self {
        Self { origin, size, samples: 0, planes: Vec::new() }
    }

    /// The number of pixels.
    pub fn len(&self) -> usize {
        (self.size[0] * self.size[1]) as usize
    }

    /// Whether the tile has no pixels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The position of pixel `i` in the full image.
    pub fn pixel(&self, i: usize) -> [u32; 2] {
        let i = i as u32;
        [self.origin[0] + i % self.size[0], self.origin[1] + i / self.size[0]]
    }

    /// Adds samples `self.samples .. end` to every pixel: `fill(pixel, stack)` pushes them in order.
    pub fn extend(&mut self, end: u32, mut fill: impl FnMut([u32; 2], std::ops::Range<u32>, &mut PixelStack)) {
        let begin = self.samples;
        if end <= begin {
            return;
        }
        for k in bits(end) {
            if self.planes.len() <= k {
                self.planes.resize_with(k + 1, Vec::new);
            }
            if self.planes[k].is_empty() {
                self.planes[k] = vec![PixelSum::default(); self.len()];
            }
        }
        let mut stack = PixelStack::new();
        for i in 0..self.len() {
            stack.resume(begin, |k| self.planes[k][i]);
            fill(self.pixel(i), begin..end, &mut stack);
            for k in bits(end) {
                self.planes[k][i] = stack.level(k);
            }
        }
        self.samples = end;
        // A plane whose bit is clear holds nothing: give its memory back, so that memory does not grow with samples.
        for (k, plane) in self.planes.iter_mut().enumerate() {
            if end & (1 << k) == 0 {
                *plane = Vec::new();
            }
        }
    }

    /// The sum over all samples of pixel `i`, joined from small to large.
    pub fn sum(&self, i: usize) -> PixelSum {
        bits(self.samples).map(|k| self.planes[k][i]).reduce(|a, b| b.add(&a)).unwrap_or_default()
    }
}

/// The pixels of the rendered part of the image.
#[derive(Clone, Debug)]
pub struct Film {
    /// x0, x1, y0, y1 in the full image, the ends excluded.
    pub bounds: [u32; 4],
    /// The tiles, row by row.
    pub tiles: Vec<Tile>,
}

impl Film {
    /// An empty film.
    pub fn new(bounds: [u32; 4]) -> Self {
        let [x0, x1, y0, y1] = bounds;
        let mut tiles = Vec::new();
        for y in (y0..y1).step_by(TILE_SIZE as usize) {
            for x in (x0..x1).step_by(TILE_SIZE as usize) {
                tiles.push(Tile::new([x, y], [TILE_SIZE.min(x1 - x), TILE_SIZE.min(y1 - y)]));
            }
        }
        Self { bounds, tiles }
    }

    /// Width and height of the rendered part.
    pub fn size(&self) -> [usize; 2] {
        let [x0, x1, y0, y1] = self.bounds;
        [(x1 - x0) as usize, (y1 - y0) as usize]
    }

    /// One value for each pixel, row by row, from the pixel's sum and sample count.
    pub fn map<T: Clone + Default>(&self, mut f: impl FnMut(&PixelSum, u32) -> T) -> Vec<T> {
        let [width, height] = self.size();
        let mut out = vec![T::default(); width * height];
        for tile in &self.tiles {
            for i in 0..tile.len() {
                let [x, y] = tile.pixel(i);
                let at = (y - self.bounds[2]) as usize * width + (x - self.bounds[0]) as usize;
                out[at] = f(&tile.sum(i), tile.samples);
            }
        }
        out
    }

    /// The mean of each pixel.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        self.map(|s, n| s.mean(n))
    }

    /// The variance of the mean of each pixel.
    pub fn variance(&self) -> Vec<[f32; 3]> {
        self.map(|s, n| s.variance_of_mean(n))
    }

    /// The root mean square over pixels of the standard error, relative to the mean brightness of the image: how grainy
    /// the picture is as a whole. `None` before two samples.
    pub fn relative_error(&self) -> Option<f32> {
        let (mut variance, mut mean, mut pixels) = (0.0f64, 0.0f64, 0u64);
        for tile in &self.tiles {
            if tile.samples < 2 {
                return None;
            }
            for i in 0..tile.len() {
                let sum = tile.sum(i);
                variance += sum.variance_of_mean(tile.samples).iter().map(|&v| f64::from(v)).sum::<f64>();
                mean += sum.mean(tile.samples).iter().map(|&v| f64::from(v.abs())).sum::<f64>();
                pixels += 3;
            }
        }
        (mean > 0.0).then(|| ((variance / pixels as f64).sqrt() / (mean / pixels as f64)) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(pixel: [u32; 2], sample: u32) -> [f32; 3] {
        [(pixel[0] * 7 + sample) as f32 * 0.1, 1.0 / (1 + pixel[1] + sample) as f32, sample as f32]
    }

    #[test]
    fn tiles_cover_the_crop_once() {
        let film = Film::new([3, 40, 5, 25]);
        let total: usize = film.tiles.iter().map(Tile::len).sum();
        assert_eq!(total, 37 * 20);
    }

    #[test]
    fn passes_of_any_size_give_the_same_image() {
        let run = |ends: &[u32]| {
            let mut film = Film::new([0, 20, 0, 18]);
            for &end in ends {
                for tile in &mut film.tiles {
                    tile.extend(end, |p, range, stack| range.for_each(|s| stack.push(PixelSum::of(value(p, s)))));
                }
            }
            film.map(|s, n| (s.rgb, s.squares, n))
        };
        let whole = run(&[100]);
        assert_eq!(whole, run(&[1, 2, 4, 8, 50, 99, 100]));
        assert_eq!(whole[0].0[2], (0..100).sum::<u32>() as f32);
    }
}
