//! Accessors: typed, strided, perhaps normalised, perhaps sparse views of buffers.

use super::buffers::{View, missing, view};
use super::json::{Json, Result};

/// An accessor without any data may still say how many zeros it stands for; nobody needs more.
const MOST_ZEROS: usize = 1 << 24;

/// The type of one component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(json: &Json) -> Result<Component> {
        Ok(match json.need("componentType")?.as_count()? {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            other => return Err(json.need("componentType")?.problem(format!("{other} is no component type"))),
        })
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    #[inline]
    fn float(self, b: &[u8], normalized: bool) -> f32 {
        let (value, scale) = match self {
            Component::I8 => (f32::from(b[0] as i8), 127.0),
            Component::U8 => (f32::from(b[0]), 255.0),
            Component::I16 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            Component::U16 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            Component::U32 => (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32, 4_294_967_295.0),
            Component::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        if normalized { (value / scale).max(-1.0) } else { value }
    }

    #[inline]
    fn whole(self, b: &[u8]) -> Option<u32> {
        match self {
            Component::U8 => Some(u32::from(b[0])),
            Component::U16 => Some(u32::from(u16::from_le_bytes([b[0], b[1]]))),
            Component::U32 => Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            _ => None,
        }
    }
}

/// Components of a type by its name, and rows where it is a matrix.
fn shape(json: &Json) -> Result<(usize, usize)> {
    let kind = json.need("type")?;
    Ok(match kind.as_str()? {
        "SCALAR" => (1, 1),
        "VEC2" => (2, 1),
        "VEC3" => (3, 1),
        "VEC4" => (4, 1),
        "MAT2" => (4, 2),
        "MAT3" => (9, 3),
        "MAT4" => (16, 4),
        other => return Err(kind.problem(format!("`{other}` is no type of accessor"))),
    })
}

/// An accessor that is known to lie within its buffer.
pub(super) struct Accessor<'d, 'b> {
    json: Json<'d>,
    component: Component,
    /// Components of one element.
    pub width: usize,
    rows: usize,
    pub count: usize,
    normalized: bool,
    data: Option<(View<'b>, usize)>,
    buffers: Buffers<'d, 'b>,
}

/// What accessors look into.
#[derive(Clone)]
pub(super) struct Buffers<'d, 'b> {
    pub views: Vec<Json<'d>>,
    pub data: &'b [Option<Vec<u8>>],
    /// Views that were unpacked, by number.
    pub unpacked: &'b [Option<Vec<u8>>],
}

impl<'d, 'b> Buffers<'d, 'b> {
    pub fn view(&self, at: &Json, key: &str) -> Result<View<'b>> {
        let index = at.need(key)?.as_count()?;
        let json = self.views.get(index).ok_or_else(|| missing(at, key, "buffer view", index, self.views.len()))?;
        if let Some(bytes) = self.unpacked.get(index).and_then(Option::as_ref) {
            return Ok(View { bytes, stride: json.count("byteStride")? });
        }
        view(json, self.data, "buffer")
    }
}

impl<'d, 'b> Accessor<'d, 'b> {
    pub fn new(json: Json<'d>, buffers: Buffers<'d, 'b>) -> Result<Self> {
        let component = Component::of(&json)?;
        let (width, rows) = shape(&json)?;
        let count = json.need("count")?.as_count()?;
        let normalized = json.flag("normalized")?;
        let mut out = Accessor { json, component, width, rows, count, normalized, data: None, buffers };
        if out.json.get("bufferView").is_some() {
            let view = out.buffers.view(&out.json, "bufferView")?;
            let offset = out.json.count("byteOffset")?.unwrap_or(0);
            let (size, stride) = (out.size(), view.stride.unwrap_or(out.size()));
            if stride < size {
                return Err(out.json.problem(format!("an element takes {size} bytes, but `byteStride` is {stride}")));
            }
            let need = match count {
                0 => Some(0),
                n => (n - 1).checked_mul(stride).and_then(|v| v.checked_add(size)?.checked_add(offset)),
            };
            if need.is_none_or(|need| need > view.bytes.len()) {
                let have = view.bytes.len();
                let message = format!(
                    "`count` of {count} elements of {size} bytes does not fit into the {have} bytes of its view"
                );
                return Err(out.json.problem(message));
            }
            out.data = Some((view, offset));
        } else if count > MOST_ZEROS {
            return Err(out.json.problem(format!("claims {count} elements without any data")));
        }
        Ok(out)
    }

    /// Bytes of one element: columns of matrices begin at multiples of four.
    fn size(&self) -> usize {
        let column = self.width / self.rows * self.component.size();
        if self.rows > 1 { column.next_multiple_of(4) * self.rows } else { column }
    }

    /// Where component `c` of an element begins in it.
    #[inline]
    fn at(&self, c: usize) -> usize {
        if self.rows == 1 {
            return c * self.component.size();
        }
        let in_column = self.width / self.rows;
        let column = (in_column * self.component.size()).next_multiple_of(4);
        c / in_column * column + c % in_column * self.component.size()
    }

    #[inline]
    fn element(&self, i: usize) -> Option<&'b [u8]> {
        let (view, offset) = self.data?;
        Some(&view.bytes[offset + i * view.stride.unwrap_or(self.size())..])
    }

    pub fn problem(&self, message: impl Into<String>) -> super::json::Problem {
        self.json.problem(message)
    }

    /// All elements as floats; what is not there is zero.
    ///
    /// Infinite and undefined values are errors.
    pub fn floats<const N: usize>(&self) -> Result<Vec<[f32; N]>> {
        if self.width < N {
            let message = format!("has {} components where {N} are needed", self.width);
            return Err(self.json.problem(message));
        }
        let offsets: [usize; N] = std::array::from_fn(|c| self.at(c));
        let read =
            |b: &[u8]| -> [f32; N] { std::array::from_fn(|c| self.component.float(&b[offsets[c]..], self.normalized)) };
        let mut out: Vec<[f32; N]> = match self.data {
            Some(_) => (0..self.count).map(|i| self.element(i).map_or([0.0; N], read)).collect(),
            None => vec![[0.0; N]; self.count],
        };
        self.sparse(|i, b| out[i] = read(b))?;
        match out.iter().position(|v| v.iter().any(|v| !v.is_finite())) {
            Some(i) => Err(self.json.problem(format!("element {i} is not finite"))),
            None => Ok(out),
        }
    }

    /// All elements as whole numbers.
    pub fn indices(&self) -> Result<Vec<u32>> {
        let wrong = || self.json.problem("indices must be unsigned whole numbers");
        if self.width != 1 || self.component.whole(&[0; 4]).is_none() {
            return Err(wrong());
        }
        let read = |b: &[u8]| self.component.whole(b).unwrap_or(0);
        let mut out: Vec<u32> = (0..self.count).map(|i| self.element(i).map_or(0, read)).collect();
        self.sparse(|i, b| out[i] = read(b))?;
        Ok(out)
    }

    /// Four whole numbers an element: the joints of a skin.
    pub fn joints(&self) -> Result<Vec<[u32; 4]>> {
        if self.width != 4 || self.component.whole(&[0; 4]).is_none() {
            return Err(self.json.problem("joints must be four unsigned whole numbers"));
        }
        let offsets: [usize; 4] = std::array::from_fn(|c| self.at(c));
        let read = |b: &[u8]| offsets.map(|o| self.component.whole(&b[o..]).unwrap_or(0));
        let mut out: Vec<[u32; 4]> = (0..self.count).map(|i| self.element(i).map_or([0; 4], read)).collect();
        self.sparse(|i, b| out[i] = read(b))?;
        Ok(out)
    }

    /// Hands out the elements that replace others.
    fn sparse(&self, mut put: impl FnMut(usize, &[u8])) -> Result<()> {
        let Some(sparse) = self.json.get("sparse") else { return Ok(()) };
        let count = sparse.need("count")?.as_count()?;
        let (indices, values) = (sparse.need("indices")?, sparse.need("values")?);
        let component = Component::of(&indices)?;
        if component.whole(&[0; 4]).is_none() {
            return Err(indices.problem("indices must be unsigned whole numbers"));
        }
        let part = |json: &Json<'d>, size: usize| -> Result<&'b [u8]> {
            let view = self.buffers.view(json, "bufferView")?;
            let offset = json.count("byteOffset")?.unwrap_or(0);
            let end = count.checked_mul(size).and_then(|n| n.checked_add(offset));
            let bytes = end.and_then(|end| view.bytes.get(offset..end));
            bytes.ok_or_else(|| sparse.problem(format!("`count` of {count} does not fit into its views")))
        };
        let (places, data) = (part(&indices, component.size())?, part(&values, self.size())?);
        for k in 0..count {
            let i = component.whole(&places[k * component.size()..]).unwrap_or(0) as usize;
            if i >= self.count {
                let message = format!("replaces element {i}, but there are only {}", self.count);
                return Err(indices.problem(message));
            }
            put(i, &data[k * self.size()..(k + 1) * self.size()]);
        }
        Ok(())
    }
}
