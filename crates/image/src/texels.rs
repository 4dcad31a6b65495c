//! `Texels`: a texture's samples in the precision of their file, decoded to `f32` on look-up.

use std::sync::Arc;

use half::f16;

use crate::scratch::{LEAST, MappedBytes, Scratch};
use crate::{Chromaticities, Encoding, Error, Image};

/// Interleaved samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Storage {
    /// 8-bit codes, decoded by a table of 256 entries.
    U8(Vec<u8>),
    /// 16-bit floats, linear.
    F16(Vec<f16>),
    /// 32-bit floats, linear.
    F32(Vec<f32>),
    /// Any of these in a scratch file, little endian.
    Mapped(SampleKind, MappedBytes),
}

/// How a sample is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// An 8-bit code.
    U8,
    /// A 16-bit float.
    F16,
    /// A 32-bit float.
    F32,
}

impl SampleKind {
    /// Bytes of a sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::F16 => 2,
            Self::F32 => 4,
        }
    }
}

/// One to four interleaved channels (Y; Y, A; R, G, B; or R, G, B, A), row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Texels {
    width: usize,
    height: usize,
    channels: usize,
    storage: Storage,
    encoding: Encoding,
    table: Arc<[f32; 256]>,
    /// Primaries, where the file states them.
    pub chromaticities: Option<Chromaticities>,
}

impl Texels {
    /// Takes interleaved samples. `encoding` gives the meaning of 8-bit codes; floats are linear.
    ///
    /// # Errors
    /// `Error::Shape` if there are not 1 to 4 channels, no pixels, or not `width * height * channels` samples.
    pub fn new(
        width: usize,
        height: usize,
        channels: usize,
        storage: Storage,
        encoding: Encoding,
    ) -> Result<Texels, Error> {
        let len = match &storage {
            Storage::U8(s) => s.len(),
            Storage::F16(s) => s.len(),
            Storage::F32(s) => s.len(),
            Storage::Mapped(kind, s) => s.len() / kind.bytes(),
        };
        let want = width.checked_mul(height).and_then(|n| n.checked_mul(channels));
        if !(1..=4).contains(&channels) || len == 0 || want != Some(len) {
            return Err(Error::shape(format!(
                "{len} samples do not make {width} x {height} texels of {channels} channels"
            )));
        }
        let table = Arc::new(encoding.table());
        Ok(Texels { width, height, channels, storage, encoding, table, chromaticities: None })
    }

    /// The colour (and alpha) of an image. Half-precision channels stay so.
    ///
    /// # Errors
    /// `Error::Shape` if there is no `R G B`, no `Y`, and more than one channel.
    pub fn from_image(image: &Image) -> Result<Texels, Error> {
        let mut planes: Vec<&[f32]> = match (image.planes(""), image.colour_planes()) {
            (Some(rgb), _) => rgb.to_vec(),
            (None, Some([grey, ..])) => vec![grey],
            (None, None) => {
                let names: Vec<_> = image.channels().iter().map(|c| c.name.as_str()).collect();
                return Err(Error::shape(format!("no channels R, G, B or Y among {}", names.join(", "))));
            }
        };
        if let Some(alpha) = image.channel("A").filter(|_| image.channels().len() > 1) {
            planes.push(alpha);
        }
        let n = image.width() * image.height();
        let interleaved = (0..n).flat_map(|i| planes.iter().map(move |p| p[i]));
        let is_half = image.channels().iter().all(|c| c.precision == crate::Precision::Half);
        let storage = if is_half {
            Storage::F16(interleaved.map(f16::from_f32).collect())
        } else {
            Storage::F32(interleaved.collect())
        };
        let mut texels = Texels::new(image.width(), image.height(), planes.len(), storage, Encoding::Linear)?;
        texels.chromaticities = image.metadata.chromaticities;
        Ok(texels)
    }

    /// What is wrong with pixels that are infinite or undefined: how many, and where the first is; of what has just been read, which is
    /// in no scratch file.
    pub fn not_finite(&self) -> Option<String> {
        let bad: Vec<usize> = match &self.storage {
            Storage::U8(_) | Storage::Mapped(..) => return None,
            Storage::F16(s) => (0..s.len()).filter(|&i| !s[i].is_finite()).collect(),
            Storage::F32(s) => (0..s.len()).filter(|&i| !s[i].is_finite()).collect(),
        };
        let mut pixels: Vec<usize> = bad.into_iter().map(|i| i / self.channels).collect();
        pixels.dedup();
        let first = *pixels.first()?;
        let (n, all, [x, y]) = (pixels.len(), self.width * self.height, [first % self.width, first / self.width]);
        Some(format!("{n} of {all} pixels infinite or undefined, the first at {x},{y}"))
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Channels, 1 to 4.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Meaning of 8-bit codes.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// The samples as they are kept.
    pub fn storage(&self) -> &Storage {
        &self.storage
    }

    /// How samples are kept.
    pub fn kind(&self) -> SampleKind {
        match &self.storage {
            Storage::U8(_) => SampleKind::U8,
            Storage::F16(_) => SampleKind::F16,
            Storage::F32(_) => SampleKind::F32,
            Storage::Mapped(kind, _) => *kind,
        }
    }

    /// Bytes of samples, wherever they are.
    pub fn bytes(&self) -> usize {
        self.width * self.height * self.channels * self.kind().bytes()
    }

    /// Bytes of memory that samples take; none in a scratch file.
    pub fn memory(&self) -> usize {
        if matches!(self.storage, Storage::Mapped(..)) { 0 } else { self.bytes() }
    }

    /// The same texels in a scratch file; small ones stay where they are.
    ///
    /// # Errors
    /// Those of the file.
    pub fn into_scratch(self, scratch: &Scratch) -> std::io::Result<Texels> {
        if self.bytes() < LEAST {
            return Ok(self);
        }
        let kind = self.kind();
        let stored = match &self.storage {
            Storage::U8(s) => scratch.store(s)?,
            Storage::F16(s) => scratch.store(&s.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?,
            Storage::F32(s) => scratch.store(&s.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())?,
            Storage::Mapped(..) => return Ok(self),
        };
        Ok(Texels { storage: Storage::Mapped(kind, stored), ..self })
    }

    /// Which channel is alpha, if one is.
    #[inline]
    pub fn alpha_channel(&self) -> Option<usize> {
        matches!(self.channels, 2 | 4).then(|| self.channels - 1)
    }

    /// The linear value of channel `c` of the texel whose first sample is `first = (y * width + x) * channels`. Alpha is coverage,
    /// to which the encoding does not apply.
    #[inline]
    pub fn value(&self, first: usize, c: usize) -> f32 {
        match &self.storage {
            Storage::U8(s) => self.decoded(s[first + c], c),
            Storage::F16(s) => s[first + c].to_f32(),
            Storage::F32(s) => s[first + c],
            Storage::Mapped(kind, s) => self.mapped(*kind, s, first + c, c),
        }
    }

    /// The linear values of the first three channels at column `x`, row `y`; all in range.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline]
    pub fn texel3(&self, x: usize, y: usize) -> [f32; 3] {
        self.value3((y * self.width + x) * self.channels)
    }

    /// The linear values of the first three channels of the texel whose first sample is `first`, none of them alpha.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline]
    pub fn value3(&self, first: usize) -> [f32; 3] {
        let [v] = self.values3([Some(first)]);
        v
    }

    /// The same for some texels, black ones among them.
    #[inline]
    pub(crate) fn values3<const N: usize>(&self, first: [Option<usize>; N]) -> [[f32; 3]; N] {
        debug_assert!(self.channels >= 3);
        fn three<T: Copy>(s: &[T], first: usize) -> [T; 3] {
            let s = &s[first..first + 3];
            [s[0], s[1], s[2]]
        }
        match &self.storage {
            Storage::U8(s) => {
                let of = |i| three(s, i).map(|code| self.table[usize::from(code)]);
                first.map(|i| i.map_or([0.0; 3], of))
            }
            Storage::F16(s) => first.map(|i| i.map_or([0.0; 3], |i| three(s, i).map(f16::to_f32))),
            Storage::F32(s) => first.map(|i| i.map_or([0.0; 3], |i| three(s, i))),
            Storage::Mapped(kind, s) => {
                let of = |i| std::array::from_fn(|c| self.mapped(*kind, s, i + c, c));
                first.map(|i| i.map_or([0.0; 3], of))
            }
        }
    }

    #[inline]
    fn decoded(&self, code: u8, c: usize) -> f32 {
        if self.alpha_channel() == Some(c) { f32::from(code) / 255.0 } else { self.table[usize::from(code)] }
    }

    fn mapped(&self, kind: SampleKind, s: &[u8], i: usize, c: usize) -> f32 {
        match kind {
            SampleKind::U8 => self.decoded(s[i], c),
            SampleKind::F16 => f16::from_le_bytes([s[2 * i], s[2 * i + 1]]).to_f32(),
            SampleKind::F32 => f32::from_le_bytes([s[4 * i], s[4 * i + 1], s[4 * i + 2], s[4 * i + 3]]),
        }
    }

    /// Linear value of channel `c` at column `x`, row `y`; all in range.
    #[inline]
    pub fn texel(&self, x: usize, y: usize, c: usize) -> f32 {
        self.value((y * self.width + x) * self.channels, c)
    }

    /// Whether there is an alpha channel that is below one anywhere.
    pub fn has_transparency(&self) -> bool {
        let n = self.width * self.height;
        self.alpha_channel().is_some_and(|a| (0..n).any(|i| self.value(i * self.channels, a) < 1.0))
    }

    /// The same texels with only the first `channels` channels, so that an opaque alpha takes no memory.
    pub fn truncated(self, channels: usize) -> Texels {
        if channels == 0 || channels >= self.channels {
            return self;
        }
        fn keep<T: Copy>(s: &[T], from: usize, to: usize) -> Vec<T> {
            s.chunks_exact(from).flat_map(|p| p[..to].iter().copied()).collect()
        }
        let from = self.channels;
        let storage = match &self.storage {
            Storage::U8(s) => Storage::U8(keep(s, from, channels)),
            Storage::F16(s) => Storage::F16(keep(s, from, channels)),
            Storage::F32(s) => Storage::F32(keep(s, from, channels)),
            Storage::Mapped(SampleKind::U8, s) => Storage::U8(keep(s, from, channels)),
            Storage::Mapped(SampleKind::F16, s) => {
                let all: Vec<f16> = s.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]])).collect();
                Storage::F16(keep(&all, from, channels))
            }
            Storage::Mapped(SampleKind::F32, s) => {
                let all: Vec<f32> = s.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
                Storage::F32(keep(&all, from, channels))
            }
        };
        Texels { channels, storage, ..self }
    }

    /// One channel as a grey texture; a channel that is not there is the last colour there is, or 1 where it is alpha.
    ///
    /// # Errors
    /// Never for texels that are in order.
    pub fn channel(&self, c: usize) -> Result<Texels, Error> {
        let has = if c == 3 { self.alpha_channel() } else { Some(c.min(if self.channels < 3 { 0 } else { 2 })) };
        fn pick<T: Copy>(s: &[T], n: usize, c: Option<usize>, one: T) -> Vec<T> {
            s.chunks_exact(n).map(|p| c.map_or(one, |c| p[c])).collect()
        }
        let n = self.channels;
        let storage = match &self.storage {
            Storage::U8(s) => Storage::U8(pick(s, n, has, 255)),
            Storage::F16(s) => Storage::F16(pick(s, n, has, f16::ONE)),
            Storage::F32(s) => Storage::F32(pick(s, n, has, 1.0)),
            Storage::Mapped(..) => {
                let texels = 0..self.width * self.height;
                let values = texels.map(|i| has.map_or(1.0, |c| self.value(i * n, c))).collect();
                return Texels::new(self.width, self.height, 1, Storage::F32(values), Encoding::Linear);
            }
        };
        let encoding = if c == 3 { Encoding::Linear } else { self.encoding };
        Texels::new(self.width, self.height, 1, storage, encoding)
    }

    /// A float image with channels `Y`, `Y A`, `R G B` or `R G B A`.
    pub fn to_image(&self) -> Image {
        let names: &[&str] = match self.channels {
            1 => &["Y"],
            2 => &["Y", "A"],
            3 => &["R", "G", "B"],
            _ => &["R", "G", "B", "A"],
        };
        let precision = if self.kind() == SampleKind::F16 { crate::Precision::Half } else { crate::Precision::Float };
        let mut image = Image::new(self.width, self.height);
        let n = self.width * self.height;
        for (c, name) in names.iter().enumerate() {
            let samples = (0..n).map(|i| self.value(i * self.channels, c)).collect();
            // The names above are distinct and the lengths are right, so this cannot fail.
            image.add(name, samples, precision).expect("texels of a consistent shape");
        }
        image.metadata.chromaticities = self.chromaticities;
        image
    }
}
