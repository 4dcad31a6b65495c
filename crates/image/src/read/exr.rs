//! OpenEXR through the `exr` crate: any flat channels, of all parts that share the first part's size.

use std::{collections::HashMap, io::Cursor};

use exr::prelude::{
    AttributeValue, FlatSamples, IntegerBounds, LayerAttributes, MetaData, ReadChannels, ReadLayers, Text, Vec2,
};

use crate::{Attribute, Chromaticities, Error, Image, Metadata, Precision, Window, read::Limits};

pub(super) fn read(bytes: &[u8], name: &str, limits: Limits) -> Result<Image, Error> {
    let bad = |e: exr::error::Error| match e {
        exr::error::Error::NotSupported(what) => Error::unsupported(name, what),
        other => Error::malformed(name, "EXR", other),
    };
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(bad)?;
    check_size(&meta, bytes.len(), name, limits)?;
    let file = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(bad)?;

    let first = file.layer_data.first().ok_or_else(|| Error::malformed(name, "EXR", "it has no layer"))?;
    let mut image = Image::new(first.size.width(), first.size.height());
    image.metadata = metadata(&file.attributes, &first.attributes);
    let several = file.layer_data.len() > 1;
    for layer in &file.layer_data {
        if layer.size != first.size {
            return Err(Error::unsupported(name, "parts of different sizes"));
        }
        let prefix = layer.attributes.layer_name.as_ref().filter(|_| several).map(Text::to_string);
        for channel in &layer.channel_data.list {
            let own = channel.name.to_string();
            // Parts are named twice by some writers: part "N" with channel "N.X".
            let full = match &prefix {
                Some(p) if !own.starts_with(&format!("{p}.")) && image.channel(&own).is_some() => format!("{p}.{own}"),
                _ => own,
            };
            let (samples, precision): (Vec<f32>, _) = match &channel.sample_data {
                FlatSamples::F16(s) => (s.iter().map(|h| h.to_f32()).collect(), Precision::Half),
                FlatSamples::F32(s) => (s.clone(), Precision::Float),
                FlatSamples::U32(s) => (s.iter().map(|&u| u as f32).collect(), Precision::Uint),
            };
            image.add(&full, samples, precision).map_err(|e| Error::unsupported(name, e))?;
        }
    }
    Ok(image)
}

/// Holds the sizes in the headers against the limits.
fn check_size(meta: &MetaData, file_len: usize, name: &str, limits: Limits) -> Result<(), Error> {
    let mut total_per_pixel = 0_u64;
    let (mut width, mut height) = (0, 0);
    for header in &meta.headers {
        let size = header.layer_size;
        (width, height) = (width.max(size.width() as u64), height.max(size.height() as u64));
        // Decoded planes and our own copy as f32.
        let stored: u64 = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u64 + 4).sum();
        total_per_pixel = total_per_pixel.saturating_add(stored);
        if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
            return Err(Error::unsupported(name, "subsampled channels"));
        }
    }
    if width == 0 || height == 0 {
        return Err(Error::malformed(name, "EXR", "it has no pixels"));
    }
    limits.check(name, file_len, width, height, total_per_pixel.max(1))
}

fn metadata(shared: &exr::meta::header::ImageAttributes, layer: &LayerAttributes) -> Metadata {
    let mut meta = Metadata { origin: [layer.layer_position.x(), layer.layer_position.y()], ..Metadata::default() };
    let IntegerBounds { position, size } = shared.display_window;
    meta.frame = Some(Window { x: position.x(), y: position.y(), width: size.width(), height: size.height() });
    let xy = |v: Vec2<f32>| [v.x(), v.y()];
    meta.chromaticities = shared.chromaticities.map(|c| Chromaticities {
        red: xy(c.red),
        green: xy(c.green),
        blue: xy(c.blue),
        white: xy(c.white),
    });
    take_others(&mut meta, &shared.other);
    take_others(&mut meta, &layer.other);
    take_standard(&mut meta, layer);
    meta
}

fn take_others(meta: &mut Metadata, others: &HashMap<Text, AttributeValue>) {
    // The map's order does not matter: what it is put into is sorted.
    for (name, value) in others {
        let value = match value {
            AttributeValue::Text(t) => Attribute::Text(t.to_string()),
            AttributeValue::I32(i) => Attribute::Int(*i),
            AttributeValue::F32(f) => Attribute::Float(*f),
            AttributeValue::F64(f) => Attribute::Double(*f),
            AttributeValue::FloatVec2(v) => Attribute::V2f([v.x(), v.y()]),
            AttributeValue::FloatVec3((x, y, z)) => Attribute::V3f([*x, *y, *z]),
            AttributeValue::IntVec2(v) => Attribute::V2i([v.x(), v.y()]),
            AttributeValue::Matrix4x4(m) => Attribute::M44f(*m),
            AttributeValue::TextVector(list) => Attribute::TextList(list.iter().map(Text::to_string).collect()),
            _ => continue,
        };
        meta.attributes.insert(name.to_string(), value);
    }
}

/// The attributes that the library knows by name, back under the names that they have in the file.
fn take_standard(meta: &mut Metadata, layer: &LayerAttributes) {
    let texts = [
        ("owner", &layer.owner),
        ("comments", &layer.comments),
        ("capDate", &layer.capture_date),
        ("software", &layer.software_name),
        ("wrapmodes", &layer.wrap_mode_name),
        ("view", &layer.view_name),
    ];
    for (name, value) in texts {
        if let Some(t) = value {
            meta.set(name, Attribute::Text(t.to_string()));
        }
    }
    let numbers = [
        ("whiteLuminance", layer.white_luminance),
        ("utcOffset", layer.utc_offset),
        ("longitude", layer.longitude),
        ("latitude", layer.latitude),
        ("altitude", layer.altitude),
        ("focus", layer.focus),
        ("expTime", layer.exposure),
        ("aperture", layer.aperture),
        ("isoSpeed", layer.iso_speed),
        ("near", layer.near_clip_plane),
        ("far", layer.far_clip_plane),
        ("fieldOfViewHorizontal", layer.horizontal_field_of_view),
        ("fieldOfViewVertical", layer.vertical_field_of_view),
    ];
    for (name, value) in numbers {
        if let Some(f) = value {
            meta.set(name, Attribute::Float(f));
        }
    }
    for (name, value) in [("worldToCamera", layer.world_to_camera), ("worldToNDC", layer.world_to_normalized_device)] {
        if let Some(m) = value {
            meta.set(name, Attribute::M44f(m));
        }
    }
}
