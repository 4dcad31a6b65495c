//! What an image file says besides its pixels: attributes, primaries, and where the pixels lie in the whole frame.

use std::collections::BTreeMap;

/// The value of one named attribute. The variants are those that OpenEXR can store and renderers use.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text; only characters up to U+00FF survive an EXR file.
    Text(String),
    /// A signed integer.
    Int(i32),
    /// A single precision number.
    Float(f32),
    /// A double precision number.
    Double(f64),
    /// Two single precision numbers.
    V2f([f32; 2]),
    /// Three single precision numbers.
    V3f([f32; 3]),
    /// Two integers.
    V2i([i32; 2]),
    /// A 4 x 4 matrix, row by row.
    M44f([f32; 16]),
    /// A list of texts.
    TextList(Vec<String>),
}

/// CIE 1931 xy coordinates of the primaries and the white point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chromaticities {
    /// Red primary, xy.
    pub red: [f32; 2],
    /// Green primary, xy.
    pub green: [f32; 2],
    /// Blue primary, xy.
    pub blue: [f32; 2],
    /// White point, xy.
    pub white: [f32; 2],
}

impl Chromaticities {
    /// The primaries of sRGB and Rec. 709 (ITU-R BT.709), which a file without any is taken to mean.
    pub const SRGB: Chromaticities =
        Chromaticities { red: [0.64, 0.33], green: [0.3, 0.6], blue: [0.15, 0.06], white: [0.3127, 0.329] };
}

/// A rectangle of pixels: position of the upper left corner (y down) and size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Column of the leftmost pixel.
    pub x: i32,
    /// Row of the topmost pixel.
    pub y: i32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Everything about an image that is not a pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Named attributes, kept in the order of their names so that equal images make equal files.
    pub attributes: BTreeMap<String, Attribute>,
    /// Primaries, where the file states them.
    pub chromaticities: Option<Chromaticities>,
    /// Position of the image's first pixel within the frame (the EXR data window's corner). Not zero for a crop.
    pub origin: [i32; 2],
    /// The whole frame (the EXR display window). `None`: the image is the frame.
    pub frame: Option<Window>,
}

impl Metadata {
    /// Puts in an attribute, replacing one of the same name.
    pub fn set(&mut self, name: &str, value: Attribute) {
        self.attributes.insert(name.to_owned(), value);
    }

    /// The text called `name`, if there is one.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.attributes.get(name)? {
            Attribute::Text(t) => Some(t),
            _ => None,
        }
    }

    /// The number called `name`, if there is one of any numeric type.
    pub fn number(&self, name: &str) -> Option<f64> {
        match self.attributes.get(name)? {
            Attribute::Int(i) => Some(f64::from(*i)),
            Attribute::Float(f) => Some(f64::from(*f)),
            Attribute::Double(d) => Some(*d),
            _ => None,
        }
    }
}
