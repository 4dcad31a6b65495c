//! What goes over the socket: binary frames with pictures, in little-endian numbers. Texts are JSON.

use crate::canvas::{CHANNELS, Canvas, Coarse};
use half::f16;

/// The version of the protocol.
pub(crate) const PROTOCOL: u32 = 1;

const COARSE: u32 = 1;
const TILES: u32 = 2;
const PLANE: u32 = 3;
const SCAN: u32 = 4;

/// So many bytes of tiles go into one frame; the rest follows, newer by then.
const MOST_BYTES: usize = 1 << 20;

fn words(out: &mut Vec<u8>, words: &[u32]) {
    words.iter().for_each(|w| out.extend(w.to_le_bytes()));
}

fn texels(out: &mut Vec<u8>, texels: &[u16]) {
    texels.iter().for_each(|t| out.extend(t.to_le_bytes()));
}

/// How far a tab's copy of a pane is.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sent {
    generation: u32,
    stamp: u64,
}

/// What is new in a pane since `sent`, as one frame; `None` if nothing is.
pub(crate) fn next_frame(pane: u32, frame: u32, canvas: &Canvas, sent: &mut Sent) -> Option<Vec<u8>> {
    if canvas.generation == 0 {
        return None;
    }
    if sent.generation != canvas.generation {
        // A picture that has not begun leaves the last one standing.
        if canvas.coarse.is_none() && canvas.tiles.iter().all(|t| t.texels.is_empty()) {
            return None;
        }
        *sent = Sent { generation: canvas.generation, stamp: 0 };
    }
    let mut new: Vec<usize> = (0..canvas.tiles.len()).filter(|&i| canvas.tiles[i].stamp > sent.stamp).collect();
    if let Some(coarse) = canvas.coarse.as_ref().filter(|c| c.stamp > sent.stamp)
        && new.iter().all(|&i| canvas.tiles[i].stamp > coarse.stamp)
    {
        sent.stamp = coarse.stamp;
        return Some(coarse_frame(pane, frame, canvas, coarse));
    }
    if new.is_empty() {
        return None;
    }
    new.sort_by_key(|&i| canvas.tiles[i].stamp);
    let mut size = 0;
    let fitting = new.iter().take_while(|&&i| {
        size += canvas.tiles[i].texels.len() * 2 + 8;
        size <= MOST_BYTES
    });
    let count = fitting.count().max(1);
    new.truncate(count);
    sent.stamp = canvas.tiles[new[count - 1]].stamp;
    let [w, h] = canvas.size;
    let mut out = Vec::with_capacity(size + 64);
    words(&mut out, &[TILES, frame, pane, canvas.generation, w, h, count as u32, steradian_render::TILE_SIZE]);
    let columns = canvas.grid()[0];
    for i in new {
        let tile = &canvas.tiles[i];
        let at = [i as u32 % columns, i as u32 / columns];
        words(&mut out, &[at[0] | at[1] << 16, tile.samples]);
        texels(&mut out, &tile.texels);
    }
    Some(out)
}

fn coarse_frame(pane: u32, frame: u32, canvas: &Canvas, coarse: &Coarse) -> Vec<u8> {
    let ([w, h], [cw, ch]) = (canvas.size, coarse.size);
    let mut out = Vec::with_capacity(coarse.texels.len() * 2 + 64);
    words(&mut out, &[COARSE, frame, pane, canvas.generation, w, h, coarse.stride, cw, ch]);
    texels(&mut out, &coarse.texels);
    out
}

/// The answer to question `id`: a picture.
pub(crate) fn plane(id: u32, size: [u32; 2], pixels: impl Iterator<Item = [f32; CHANNELS]>) -> Vec<u8> {
    let mut out = Vec::with_capacity((size[0] * size[1]) as usize * CHANNELS * 2 + 16);
    words(&mut out, &[PLANE, id, size[0], size[1]]);
    for pixel in pixels {
        texels(&mut out, &pixel.map(|v| f16::from_f32(v.clamp(-65504.0, 65504.0)).to_bits()));
    }
    out
}

/// The answer to question `id`: points on a grid of `size`, then others; six numbers each, place and colour.
pub(crate) fn scan(id: u32, size: [u32; 2], points: &[[f32; 6]]) -> Vec<u8> {
    let mut out = Vec::with_capacity(points.len() * 24 + 20);
    words(&mut out, &[SCAN, id, size[0], size[1], points.len() as u32]);
    points.iter().flatten().for_each(|v| out.extend(v.to_le_bytes()));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::encode;

    fn fill(canvas: &mut Canvas, i: usize, v: f32) {
        let [w, h] = canvas.tile_size(i);
        canvas.put(i, 1, (0..w * h).flat_map(|_| encode([v; 3], 0.0)).collect());
    }

    #[test]
    fn a_slow_tab_gets_the_newest_of_each_tile_once() {
        let mut canvas = Canvas::default();
        canvas.reset(3, [0, 32, 0, 16]);
        let mut sent = Sent::default();
        assert!(next_frame(0, 0, &canvas, &mut sent).is_none(), "nothing to see yet");
        canvas.put_coarse(8, [4, 2], vec![0; 32]);
        fill(&mut canvas, 0, 1.0);
        let first = next_frame(0, 0, &canvas, &mut sent).unwrap();
        assert_eq!((first[0], first.len()), (COARSE as u8, 36 + 64));
        for round in 0..100 {
            fill(&mut canvas, 0, round as f32);
            fill(&mut canvas, 1, round as f32);
        }
        let second = next_frame(0, 1, &canvas, &mut sent).unwrap();
        assert_eq!((second[0], second[24], second.len()), (TILES as u8, 2, 32 + 2 * (8 + 2048)));
        let last = f16::from_bits(u16::from_le_bytes([second[40], second[41]])).to_f32();
        assert_eq!(last, 99.0);
        assert!(next_frame(0, 2, &canvas, &mut sent).is_none());
        canvas.reset(4, [0, 32, 0, 16]);
        assert!(next_frame(0, 2, &canvas, &mut sent).is_none(), "the last picture stands until there is a new one");
    }

    #[test]
    fn large_pictures_come_in_parts_and_all_of_them_comes() {
        let mut canvas = Canvas::default();
        canvas.reset(1, [0, 1600, 0, 160]);
        (0..1000).for_each(|i| fill(&mut canvas, i, 1.0));
        let (mut sent, mut tiles) = (Sent::default(), 0);
        while let Some(frame) = next_frame(0, 0, &canvas, &mut sent) {
            assert!(frame.len() <= MOST_BYTES + 64);
            tiles += u32::from_le_bytes(frame[24..28].try_into().unwrap());
        }
        assert_eq!(tiles, 1000);
    }
}
