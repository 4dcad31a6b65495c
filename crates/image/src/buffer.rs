//! `Image`: named `f32` channels over one rectangle of pixels, plus what the file said about them.

use crate::{Error, Metadata};

/// Precision in which a channel is, or was, kept in a file. In memory all channels are `f32`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Precision {
    /// 16-bit float.
    Half,
    /// 32-bit float.
    #[default]
    Float,
    /// 32-bit unsigned integer; values above 2^24 are rounded in memory.
    Uint,
}

/// One plane of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name as in the file, with its layer: `R`, `Variance.R`, `N.X`.
    pub name: String,
    /// Row by row from the top left, `width * height` samples.
    pub samples: Vec<f32>,
    /// Precision in the file.
    pub precision: Precision,
}

/// A picture with any number of named channels. Planar; row 0 is the top row. Colours are linear.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    channels: Vec<Channel>,
    /// Attributes, primaries and windows.
    pub metadata: Metadata,
}

impl Image {
    /// A picture of this size without channels.
    pub fn new(width: usize, height: usize) -> Image {
        Image { width, height, channels: Vec::new(), metadata: Metadata::default() }
    }

    /// A picture with channels `R`, `G`, `B` from interleaved triples, row by row. `None` if the length does not fit.
    pub fn from_rgb(width: usize, height: usize, pixels: &[[f32; 3]]) -> Option<Image> {
        if pixels.len() != width.checked_mul(height)? {
            return None;
        }
        let mut image = Image::new(width, height);
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let samples = pixels.iter().map(|p| p[c]).collect();
            image.channels.push(Channel { name: name.to_owned(), samples, precision: Precision::Float });
        }
        Some(image)
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All channels in the order in which they were added or stand in the file.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Adds a channel of `width * height` samples.
    ///
    /// # Errors
    /// `Error::Shape` if the number of samples is wrong or the name is taken.
    pub fn add(&mut self, name: &str, samples: Vec<f32>, precision: Precision) -> Result<(), Error> {
        if samples.len() != self.width * self.height {
            return Err(Error::shape(format!(
                "channel {name} has {} samples for {} x {} pixels",
                samples.len(),
                self.width,
                self.height
            )));
        }
        if self.channel(name).is_some() {
            return Err(Error::shape(format!("channel {name} is there twice")));
        }
        self.channels.push(Channel { name: name.to_owned(), samples, precision });
        Ok(())
    }

    /// The samples of the channel called `name`.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.samples.as_slice())
    }

    /// The samples of the channel called `name`, to be changed.
    pub fn channel_mut(&mut self, name: &str) -> Option<&mut [f32]> {
        self.channels.iter_mut().find(|c| c.name == name).map(|c| c.samples.as_mut_slice())
    }

    /// Sets the file precision of the channels called `names`.
    pub fn set_precision_of(&mut self, names: &[&str], precision: Precision) {
        for c in self.channels.iter_mut().filter(|c| names.contains(&c.name.as_str())) {
            c.precision = precision;
        }
    }

    /// Sets the file precision of every channel.
    pub fn set_precision(&mut self, precision: Precision) {
        for c in &mut self.channels {
            c.precision = precision;
        }
    }

    /// The three planes `layer.R`, `layer.G`, `layer.B` (`R`, `G`, `B` for the empty layer name).
    pub fn planes(&self, layer: &str) -> Option<[&[f32]; 3]> {
        let find = |c: &str| if layer.is_empty() { self.channel(c) } else { self.channel(&format!("{layer}.{c}")) };
        Some([find("R")?, find("G")?, find("B")?])
    }

    /// The picture as colours: `R G B`, or else `Y` three times, or else the only channel three times.
    pub fn rgb(&self) -> Option<Vec<[f32; 3]>> {
        let [r, g, b] = self.colour_planes()?;
        Some((0..r.len()).map(|i| [r[i], g[i], b[i]]).collect())
    }

    /// The planes that `rgb` reads.
    pub fn colour_planes(&self) -> Option<[&[f32]; 3]> {
        if let Some(planes) = self.planes("") {
            return Some(planes);
        }
        let grey = self.channel("Y").or(match self.channels.as_slice() {
            [only] => Some(only.samples.as_slice()),
            _ => None,
        })?;
        Some([grey, grey, grey])
    }

    /// The rectangle `x, y, width, height` (clipped to the picture) as a picture of its own, which remembers where in the frame it lies.
    pub fn crop(&self, x: usize, y: usize, width: usize, height: usize) -> Image {
        let (x, y) = (x.min(self.width), y.min(self.height));
        let (width, height) = (width.min(self.width - x), height.min(self.height - y));
        let mut out = Image::new(width, height);
        out.metadata = self.metadata.clone();
        out.metadata.frame = Some(self.frame());
        out.metadata.origin = [self.metadata.origin[0] + x as i32, self.metadata.origin[1] + y as i32];
        for c in &self.channels {
            let rows = (y..y + height).flat_map(|j| &c.samples[j * self.width + x..j * self.width + x + width]);
            out.channels.push(Channel {
                name: c.name.clone(),
                samples: rows.copied().collect(),
                precision: c.precision,
            });
        }
        out
    }

    /// The whole frame that this picture belongs to: what the metadata say, or the picture itself.
    pub fn frame(&self) -> crate::Window {
        self.metadata.frame.unwrap_or(crate::Window {
            x: self.metadata.origin[0],
            y: self.metadata.origin[1],
            width: self.width,
            height: self.height,
        })
    }
}
