//! `--denoise`: the picture without its noise, and the noisy one beside it.

use std::sync::atomic::AtomicBool;

use steradian_image::{Attribute, Error, Image, Precision};
use steradian_render::features;
use steradian_scene::World;

use crate::oidn::{Oidn, Pictures};

/// Looks at a guide's pixel, at least: fewer leave more noise than the filter takes away.
const LEAST_LOOKS: u32 = 8;

/// Bytes for each pixel that the pictures take that go in and out.
pub(crate) const BYTES_A_PIXEL: u64 = 120;

/// Replaces the colours of `picture` by denoised ones; `noisy.R .G .B` keep what was there. Guides are looked at as often
/// as the picture was, which had `spp` samples per pixel, within reason. The library may take about `memory` bytes.
///
/// # Errors
/// The library's words.
pub(crate) fn denoise(
    oidn: &Oidn,
    picture: &mut Image,
    world: &World,
    (threads, spp): (usize, u32),
    memory: u64,
) -> Result<(), String> {
    let size = [picture.width(), picture.height()];
    let planes = picture.planes("").ok_or("there are no colours")?;
    let noisy = planes.map(<[f32]>::to_vec);
    let color: Vec<f32> = (0..size[0] * size[1]).flat_map(|i| [noisy[0][i], noisy[1][i], noisy[2][i]]).collect();
    let seen =
        features(world, spp.max(LEAST_LOOKS), threads, &AtomicBool::new(false)).ok_or("the guides are not complete")?;
    // What guides are left with of lenses and filters is noise as well: they go first.
    let guide = |name, values: Vec<f32>| oidn.denoise(&Pictures { size, color: &values, name, guides: None, memory });
    let albedo = guide("albedo", seen.iter().flat_map(|f| f.albedo).collect())?;
    let normal = guide("normal", seen.iter().flat_map(|f| f.normal).collect())?;
    let clean =
        oidn.denoise(&Pictures { size, color: &color, name: "color", guides: Some([&albedo, &normal]), memory })?;
    let keep = |image: &mut Image| -> Result<(), Error> {
        for (c, (name, old)) in ["R", "G", "B"].into_iter().zip(noisy).enumerate() {
            image.add(&format!("noisy.{name}"), old, Precision::Float)?;
            if let Some(samples) = image.channel_mut(name) {
                samples.iter_mut().enumerate().for_each(|(i, v)| *v = clean[3 * i + c]);
            }
        }
        Ok(())
    };
    keep(picture).map_err(|e| e.to_string())?;
    let library = oidn.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    picture.metadata.set("steradian.denoised", Attribute::Text(library));
    Ok(())
}
