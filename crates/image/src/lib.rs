//! Pixel buffers, image files, reconstruction filters, tone mapping, error metrics.
//!
//! Two kinds of picture: [`Image`] holds named `f32` planes (what a renderer writes and a comparison reads), [`Texels`] holds a
//! texture in the precision of its file, and [`Pyramid`] is `Texels` prefiltered for look-up.
//!
//! Nothing here prints. Reading works on bytes that the caller has loaded; the only file-system access is [`write_file`].

mod buffer;
mod encoding;
mod error;
mod exact;
mod false_colour;
mod filter;
mod flip;
mod format;
mod metadata;
mod metrics;
mod pyramid;
mod read;
mod resample;
mod scratch;
mod texels;
mod tonemap;
mod write;

pub mod agreement;

pub use buffer::{Channel, Image, Precision};
pub use encoding::{Encoding, linear_to_srgb, srgb_to_linear};
pub use error::Error;
pub use exact::{Difference, exact_differences, is_volatile_attribute};
pub use false_colour::{false_colour, false_colour_image, false_colour_rgb};
pub use filter::{Filter, FilterKind, FilterSample};
pub use flip::{FlipSettings, HdrExposures, flip_hdr, flip_hdr_exposures, flip_ldr};
pub use format::Format;
pub use metadata::{Attribute, Chromaticities, Metadata, Window};
pub use metrics::{Metrics, metrics};
pub use pyramid::{Lookup, Pyramid, Wrap};
pub use read::{Limits, read, read_limited, read_texels, read_texels_limited};
pub use scratch::{MappedBytes, Scratch};
pub use texels::{SampleKind, Storage, Texels};
pub use tonemap::{Exposure, Operator, PreparedToneMap, ToneMap};
pub use write::{Compression, WriteOptions, encode, remove_leftovers, write_bytes_atomically, write_file};
