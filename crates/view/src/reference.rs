//! The picture to compare with: kept from a pane, or brought by somebody.

use crate::hub::{Hub, lock};
use crate::message;
use std::sync::Arc;
use steradian_image::{FlipSettings, Image, Limits, flip_hdr, read_limited};

/// A picture to compare with.
#[derive(Debug)]
pub(crate) struct Reference {
    /// Where it is from.
    pub name: String,
    /// Counts references.
    pub stamp: u64,
    /// Width and height.
    pub size: [u32; 2],
    image: Image,
}

/// Files with more bytes of pixels are refused.
const MOST_BYTES: u64 = 1 << 30;
/// Marks a message with a file.
const FILE: u32 = 16;

/// Keeps the picture of a pane, or none.
pub(crate) fn keep(hub: &Hub, pane: Option<usize>) -> Result<(), String> {
    let Some(pane) = pane else {
        lock(&hub.board).reference = None;
        hub.ask_for_state();
        return Ok(());
    };
    let canvas = lock(&hub.panes.get(pane).ok_or("there is no such pane")?.canvas);
    let size = canvas.size;
    let pixels = canvas.colors().ok_or("the picture has not all of its first samples yet")?;
    drop(canvas);
    let image = Image::from_rgb(size[0] as usize, size[1] as usize, &pixels).ok_or("the picture has no pixels")?;
    put(hub, "kept picture".into(), image);
    Ok(())
}

fn put(hub: &Hub, name: String, image: Image) {
    let size = [image.width() as u32, image.height() as u32];
    let mut board = lock(&hub.board);
    board.references += 1;
    board.reference = Some(Arc::new(Reference { name, stamp: board.references, size, image }));
    drop(board);
    hub.ask_for_state();
}

/// Takes a message with a picture's file: a mark, the number of the question, the length of the name, the name, the file.
///
/// # Errors
/// The number of the question, where there is one, and what is wrong.
pub(crate) fn receive(hub: &Hub, bytes: &[u8]) -> Result<u32, (Option<u32>, String)> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let garbage = || (None, "this is not understood".to_owned());
    let (Some(FILE), Some(id), Some(length)) = (word(0), word(4), word(8)) else { return Err(garbage()) };
    let refuse = |why: String| (Some(id), why);
    let end = 12usize.saturating_add(length as usize);
    let name = bytes.get(12..end).and_then(|n| std::str::from_utf8(n).ok()).ok_or_else(garbage)?;
    let limits = Limits { max_bytes: MOST_BYTES, ..Limits::default() };
    let image = read_limited(&bytes[end..], name, limits).map_err(|e| refuse(format!("{name}: {e}")))?;
    let rgb = image.rgb().or_else(|| {
        let grey = image.channels().first()?;
        Some(grey.samples.iter().map(|&v| [v; 3]).collect())
    });
    let rgb = rgb.ok_or_else(|| refuse(format!("{name}: there are no colours in it")))?;
    let image =
        Image::from_rgb(image.width(), image.height(), &rgb).ok_or_else(|| refuse(format!("{name}: no pixels")))?;
    put(hub, name.to_owned(), image);
    Ok(id)
}

fn current(hub: &Hub) -> Result<Arc<Reference>, String> {
    lock(&hub.board).reference.clone().ok_or_else(|| "there is no picture to compare with".into())
}

/// It, as the answer to a question.
pub(crate) fn plane(hub: &Hub, id: u32) -> Result<Vec<u8>, String> {
    let reference = current(hub)?;
    let pixels = reference.image.rgb().unwrap_or_default();
    Ok(message::plane(id, reference.size, pixels.iter().map(|&[r, g, b]| [r, g, b, 0.0])))
}

/// Where and how visibly a pane differs from it, from 0 to 1: FLIP for high dynamic range. The mean is in the last channel.
pub(crate) fn flip(hub: &Hub, id: u32, pane: usize) -> Result<Vec<u8>, String> {
    let reference = current(hub)?;
    let canvas = lock(&hub.panes.get(pane).ok_or("there is no such pane")?.canvas);
    let size = canvas.size;
    let pixels = canvas.colors().ok_or("the picture has not all of its first samples yet")?;
    drop(canvas);
    if size != reference.size {
        let [[w, h], [rw, rh]] = [size, reference.size];
        return Err(format!("the picture has {w} x {h} pixels, and the one to compare with {rw} x {rh}"));
    }
    let test = Image::from_rgb(size[0] as usize, size[1] as usize, &pixels).ok_or("the picture has no pixels")?;
    let map = flip_hdr(&reference.image, &test, &FlipSettings::default()).map_err(|e| e.to_string())?;
    let mean = map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len().max(1) as f64;
    Ok(message::plane(id, size, map.iter().map(|&v| [v, v, v, mean as f32])))
}
