//! Cryptomatte (Friedman and Jones 2015, specification 1.2.0): for each pixel the names of what it shows, as hashes, and how much
//! of the pixel each covers, so that compositors can cut out any object with clean edges.

use std::collections::{BTreeMap, BTreeSet};

use steradian_image::{Attribute, Error, Image, Precision};

/// Ranks that are kept: three layers of two.
const RANKS: usize = 6;

/// Adds the layers called `name` to an image. `pixels` gives each pixel's shares by key, largest first, and `name_of` the names.
///
/// # Errors
/// `Error::Shape` if there are not as many pixels as the image has, or the layers are there already.
pub(crate) fn add<K: Copy + Ord>(
    image: &mut Image,
    name: &str,
    pixels: &[&[(K, f32)]],
    name_of: impl Fn(K) -> String,
) -> Result<(), Error> {
    let keys: BTreeSet<K> = pixels.iter().flat_map(|p| p.iter().map(|s| s.0)).collect();
    let names: BTreeMap<K, String> = keys.into_iter().map(|k| (k, name_of(k))).collect();
    let ids: BTreeMap<K, f32> = names.iter().map(|(k, n)| (*k, id(n))).collect();
    for rank in 0..RANKS {
        let layer = format!("{name}{:02}", rank / 2);
        let [of_id, of_share] = if rank % 2 == 0 { ["R", "G"] } else { ["B", "A"] };
        let at = |p: &&[(K, f32)]| p.get(rank).copied();
        let id_plane = pixels.iter().map(|p| at(p).map_or(0.0, |(k, _)| ids[&k])).collect();
        image.add(&format!("{layer}.{of_id}"), id_plane, Precision::Float)?;
        let share_plane = pixels.iter().map(|p| at(p).map_or(0.0, |(_, share)| share)).collect();
        image.add(&format!("{layer}.{of_share}"), share_plane, Precision::Float)?;
    }
    let manifest: serde_json::Map<String, serde_json::Value> =
        names.values().map(|n| (n.clone(), format!("{:08x}", id(n).to_bits()).into())).collect();
    let key = format!("{:08x}", murmur3(name.as_bytes()));
    let mut set = |field: &str, value: String| {
        image.metadata.set(&format!("cryptomatte/{}/{field}", &key[..7]), Attribute::Text(value));
    };
    set("name", name.to_owned());
    set("hash", "MurmurHash3_32".to_owned());
    set("conversion", "uint32_to_float32".to_owned());
    set("manifest", serde_json::Value::Object(manifest).to_string());
    Ok(())
}

/// A name's hash as the bits of a float that is neither zero, subnormal, infinite nor NaN.
fn id(name: &str) -> f32 {
    let hash = murmur3(name.as_bytes());
    let exponent = hash >> 23 & 0xff;
    f32::from_bits(if exponent == 0 || exponent == 0xff { hash ^ 1 << 23 } else { hash })
}

/// MurmurHash3, 32 bits, seed 0 (Appleby, public domain).
fn murmur3(bytes: &[u8]) -> u32 {
    let scramble = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut hash = 0u32;
    let mut chunks = bytes.chunks_exact(4);
    for c in &mut chunks {
        hash ^= scramble(u32::from_le_bytes([c[0], c[1], c[2], c[3]]));
        hash = hash.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let rest = chunks.remainder();
    if !rest.is_empty() {
        hash ^= scramble(rest.iter().rev().fold(0, |k, &b| k << 8 | u32::from(b)));
    }
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that the reference implementation's users publish.
    #[test]
    fn hashes_are_those_of_everybody() {
        assert_eq!(murmur3(b""), 0);
        assert_eq!(murmur3(b"test"), 0xba6b_d213);
        assert_eq!(murmur3(b"Hello, world!"), 0xc036_3e43);
        assert_eq!(murmur3(b"The quick brown fox jumps over the lazy dog"), 0x2e4f_f723);
    }

    #[test]
    fn layers_and_manifest() {
        let mut image = Image::new(2, 1);
        let pixels: [&[(u32, f32)]; 2] = [&[(7, 0.75), (3, 0.25)], &[]];
        add(&mut image, "CryptoObject", &pixels, |k| format!("ball {k}")).unwrap();
        let channel = |name: &str| image.channel(name).unwrap()[0];
        assert_eq!(channel("CryptoObject00.R"), id("ball 7"));
        assert_eq!((channel("CryptoObject00.G"), channel("CryptoObject00.A")), (0.75, 0.25));
        assert_eq!(image.channels().len(), 12);
        let manifests: Vec<_> = image.metadata.attributes.iter().filter(|(k, _)| k.ends_with("/manifest")).collect();
        let [(key, Attribute::Text(json))] = manifests[..] else { panic!("one manifest") };
        assert_eq!(key.len(), "cryptomatte/1234567/manifest".len());
        let parsed: serde_json::Value = serde_json::from_str(json).unwrap();
        assert_eq!(parsed["ball 3"], format!("{:08x}", id("ball 3").to_bits()));
    }
}
