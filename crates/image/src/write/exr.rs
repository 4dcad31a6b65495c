//! OpenEXR through the `exr` crate: one scan-line part with every channel, and attributes in sorted order.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Encoding, FlatSamples, Image as ExrImage, IntegerBounds, Layer,
    LayerAttributes, LineOrder, Text, Vec2, WritableImage, f16,
};

use crate::{Attribute, Error, Image, Precision, write::Compression};

pub(super) fn encode(image: &Image, name: &str, compression: Compression) -> Result<Vec<u8>, Error> {
    let size = Vec2(image.width(), image.height());
    let channels = image.channels().iter().map(|c| {
        let samples = match c.precision {
            Precision::Half => FlatSamples::F16(c.samples.iter().map(|&v| f16::from_f32(v)).collect()),
            Precision::Float => FlatSamples::F32(c.samples.clone()),
            // A cast saturates and sends NaN to 0.
            Precision::Uint => FlatSamples::U32(c.samples.iter().map(|&v| v as u32).collect()),
        };
        Ok(AnyChannel::new(text(&c.name, name)?, samples))
    });
    let channels = AnyChannels::sort(channels.collect::<Result<Vec<_>, Error>>()?.into());
    let encoding = Encoding {
        compression: match compression {
            Compression::Uncompressed => exr::prelude::Compression::Uncompressed,
            Compression::Zip => exr::prelude::Compression::ZIP16,
        },
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let meta = &image.metadata;
    let mut attributes = LayerAttributes { layer_position: Vec2(meta.origin[0], meta.origin[1]), ..Default::default() };
    for (key, value) in &meta.attributes {
        let value = value_of(value, name)?;
        if let Some(value) = place_standard(&mut attributes, key, value) {
            if key.is_empty() || key.len() > 255 || exr::meta::header::standard_names::ALL.contains(&key.as_bytes()) {
                return Err(Error::unsupported(name, format!("{key:?} cannot name an EXR attribute of this type")));
            }
            attributes.other.insert(text(key, name)?, value);
        }
    }
    let mut file = ExrImage::from_layer(Layer::new(size, attributes, encoding, channels));
    let frame = image.frame();
    file.attributes.display_window = IntegerBounds::new((frame.x, frame.y), (frame.width, frame.height));
    let xy = |v: [f32; 2]| Vec2(v[0], v[1]);
    file.attributes.chromaticities = meta.chromaticities.map(|c| exr::meta::attribute::Chromaticities {
        red: xy(c.red),
        green: xy(c.green),
        blue: xy(c.blue),
        white: xy(c.white),
    });
    let mut out = Cursor::new(Vec::new());
    file.write().non_parallel().to_buffered(&mut out).map_err(|e| Error::malformed(name, "EXR", e))?;
    let mut bytes = out.into_inner();
    sort_attributes(&mut bytes).ok_or_else(|| Error::malformed(name, "EXR", "its header cannot be walked"))?;
    Ok(bytes)
}

fn text(s: &str, name: &str) -> Result<Text, Error> {
    Text::new_or_none(s)
        .ok_or_else(|| Error::unsupported(name, format!("the text {s:?} has characters that EXR cannot hold")))
}

fn value_of(value: &Attribute, name: &str) -> Result<AttributeValue, Error> {
    Ok(match value {
        Attribute::Text(t) => {
            // Characters outside Latin-1 are written as escapes, so that no message from a scene can stop an image from being saved.
            let latin: String =
                t.chars().flat_map(|c| if (c as u32) < 256 { vec![c] } else { c.escape_default().collect() }).collect();
            AttributeValue::Text(text(&latin, name)?)
        }
        Attribute::Int(i) => AttributeValue::I32(*i),
        Attribute::Float(f) => AttributeValue::F32(*f),
        Attribute::Double(d) => AttributeValue::F64(*d),
        Attribute::V2f(v) => AttributeValue::FloatVec2(Vec2(v[0], v[1])),
        Attribute::V3f(v) => AttributeValue::FloatVec3((v[0], v[1], v[2])),
        Attribute::V2i(v) => AttributeValue::IntVec2(Vec2(v[0], v[1])),
        Attribute::M44f(m) => AttributeValue::Matrix4x4(*m),
        Attribute::TextList(list) => {
            AttributeValue::TextVector(list.iter().map(|t| text(t, name)).collect::<Result<_, _>>()?)
        }
    })
}

/// Puts an attribute that the library knows by name into its field, or gives it back.
fn place_standard(layer: &mut LayerAttributes, key: &str, value: AttributeValue) -> Option<AttributeValue> {
    let text = match key {
        "owner" => Some(&mut layer.owner),
        "comments" => Some(&mut layer.comments),
        "capDate" => Some(&mut layer.capture_date),
        "software" => Some(&mut layer.software_name),
        "wrapmodes" => Some(&mut layer.wrap_mode_name),
        "view" => Some(&mut layer.view_name),
        _ => None,
    };
    if let (Some(slot), AttributeValue::Text(t)) = (text, &value) {
        *slot = Some(t.clone());
        return None;
    }
    let number = match key {
        "whiteLuminance" => Some(&mut layer.white_luminance),
        "utcOffset" => Some(&mut layer.utc_offset),
        "longitude" => Some(&mut layer.longitude),
        "latitude" => Some(&mut layer.latitude),
        "altitude" => Some(&mut layer.altitude),
        "focus" => Some(&mut layer.focus),
        "expTime" => Some(&mut layer.exposure),
        "aperture" => Some(&mut layer.aperture),
        "isoSpeed" => Some(&mut layer.iso_speed),
        "near" => Some(&mut layer.near_clip_plane),
        "far" => Some(&mut layer.far_clip_plane),
        "fieldOfViewHorizontal" => Some(&mut layer.horizontal_field_of_view),
        "fieldOfViewVertical" => Some(&mut layer.vertical_field_of_view),
        _ => None,
    };
    if let (Some(slot), AttributeValue::F32(f)) = (number, &value) {
        *slot = Some(*f);
        return None;
    }
    let matrix = match key {
        "worldToCamera" => Some(&mut layer.world_to_camera),
        "worldToNDC" => Some(&mut layer.world_to_normalized_device),
        _ => None,
    };
    if let (Some(slot), AttributeValue::Matrix4x4(m)) = (matrix, &value) {
        *slot = Some(*m);
        return None;
    }
    Some(value)
}

/// Puts the attributes of the first header into the order of their names. The library walks a hash map, whose order differs from run
/// to run, and equal images must make equal files. The header's length, and so all offsets behind it, stay as they are.
fn sort_attributes(bytes: &mut [u8]) -> Option<()> {
    /// Magic number and version.
    const START: usize = 8;
    let word_end = |from: usize| bytes.get(from..)?.iter().position(|&b| b == 0).map(|n| from + n + 1);
    let mut records = Vec::new();
    let mut at = START;
    while *bytes.get(at)? != 0 {
        let name_end = word_end(at)?;
        let kind_end = word_end(name_end)?;
        let size = u32::from_le_bytes(bytes.get(kind_end..kind_end + 4)?.try_into().ok()?) as usize;
        let end = kind_end + 4 + size;
        records.push((bytes[at..name_end].to_vec(), bytes.get(at..end)?.to_vec()));
        at = end;
    }
    records.sort();
    let sorted: Vec<u8> = records.into_iter().flat_map(|(_, record)| record).collect();
    bytes[START..START + sorted.len()].copy_from_slice(&sorted);
    Some(())
}
