//! The text header of a PLY file: what elements follow, how many of each, and how each of their properties is stored (Turk 1994).

use super::PlyError;

/// How the data after the header are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number type of the format.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &str) -> Option<Scalar> {
        Some(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// Bytes that one number takes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }
}

/// One property of an element.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Property {
    pub name: String,
    /// The type of the length, for a list.
    pub list: Option<Scalar>,
    pub ty: Scalar,
}

/// One kind of element.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

impl Element {
    /// Bytes of one element in a binary file, when it has no lists.
    pub fn stride(&self) -> Option<usize> {
        if self.properties.iter().any(|p| p.list.is_some()) {
            return None;
        }
        Some(self.properties.iter().map(|p| p.ty.size()).sum())
    }

    /// Fewest bytes that one element can take.
    fn least_size(&self, encoding: Encoding) -> usize {
        let size = |p: &Property| p.list.unwrap_or(p.ty).size();
        match encoding {
            // A digit and something between it and the next.
            Encoding::Ascii => 2 * self.properties.len(),
            _ => self.properties.iter().map(size).sum(),
        }
    }
}

/// A whole header and where the data start.
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    pub data: usize,
}

/// A header has a few dozen lines; a file that goes on for longer is something else.
const MOST_HEADER: usize = 1 << 20;

/// Reads the header and holds its counts against the length of the file, so that nothing is allocated on the word of a lie.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, PlyError> {
    let mut at = 0;
    let mut line = || {
        let rest = &bytes[at..bytes.len().min(MOST_HEADER)];
        let end = rest.iter().position(|&b| b == b'\n')?;
        at += end + 1;
        let line = std::str::from_utf8(&rest[..end]).ok()?.trim_end_matches('\r');
        Some((line, at))
    };
    match line() {
        Some(("ply", _)) => {}
        _ => return Err(PlyError::NotPly),
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let (text, data) = line().ok_or(PlyError::Header("it has no `end_header`".into()))?;
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let bad = || PlyError::Header(format!("`{}` is not understood", text.chars().take(60).collect::<String>()));
        match words.as_slice() {
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, "1.0"] => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(bad()),
                });
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| bad())?;
                if elements.iter().any(|e| e.name == *name) {
                    return Err(PlyError::Header(format!("element `{name}` is there twice")));
                }
                elements.push(Element { name: name.to_string(), count, properties: Vec::new() });
            }
            ["property", "list", length, ty, name] => {
                let (length, ty) = (Scalar::from_name(length).ok_or_else(bad)?, Scalar::from_name(ty).ok_or_else(bad)?);
                if matches!(length, Scalar::F32 | Scalar::F64) {
                    return Err(bad());
                }
                let element = elements.last_mut().ok_or_else(bad)?;
                element.properties.push(Property { name: name.to_string(), list: Some(length), ty });
            }
            ["property", ty, name] => {
                let ty = Scalar::from_name(ty).ok_or_else(bad)?;
                let element = elements.last_mut().ok_or_else(bad)?;
                element.properties.push(Property { name: name.to_string(), list: None, ty });
            }
            ["end_header"] => {
                let encoding = encoding.ok_or(PlyError::Header("it has no `format`".into()))?;
                let header = Header { encoding, elements, data };
                header.check_counts(bytes.len())?;
                return Ok(header);
            }
            _ => return Err(bad()),
        }
    }
}

impl Header {
    fn check_counts(&self, length: usize) -> Result<(), PlyError> {
        let mut left = (length - self.data) as u128;
        // The last number of a text file needs nothing after it.
        left += u128::from(self.encoding == Encoding::Ascii);
        for e in &self.elements {
            let need = e.count as u128 * e.least_size(self.encoding) as u128;
            if need > left {
                return Err(PlyError::Promise {
                    element: e.name.clone(),
                    count: e.count,
                    need: need - u128::from(self.encoding == Encoding::Ascii && need > 0),
                    left: left.saturating_sub(u128::from(self.encoding == Encoding::Ascii)),
                });
            }
            left -= need;
        }
        Ok(())
    }
}
