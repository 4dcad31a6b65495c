//! Bytes of a glTF asset: the binary container, data URIs, files beside the asset, and views into them.

use super::json::{Json, Problem, Result};
use crate::files::{FileAccess, describe};
use std::path::{Component, Path, PathBuf};

/// The parts of a `.glb` file: its JSON and its binary chunk.
pub(super) fn split_glb(bytes: &[u8]) -> std::result::Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err("truncated GLB file: its header is not complete".into());
    };
    if version != 2 {
        return Err(format!("GLB version {version}; only version 2 is known"));
    }
    let length = length as usize;
    if length > bytes.len() {
        return Err(format!("truncated GLB file: its header promises {length} bytes, but there are {}", bytes.len()));
    }
    let chunk = |at: usize| -> std::result::Result<Option<(u32, &[u8])>, String> {
        if at >= length {
            return Ok(None);
        }
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return Err(format!("truncated GLB file: the chunk at byte {at} has no header"));
        };
        let body = bytes[..length].get(at + 8..).and_then(|b| b.get(..size as usize)).ok_or_else(|| {
            format!(
                "truncated GLB file: the chunk at byte {at} promises {size} bytes, but {} are left",
                length - at - 8
            )
        })?;
        Ok(Some((kind, body)))
    };
    const JSON: u32 = 0x4e4f_534a;
    const BIN: u32 = 0x004e_4942;
    let Some((JSON, json)) = chunk(12)? else { return Err("damaged GLB file: its first chunk is not JSON".into()) };
    let next = 12 + 8 + json.len().next_multiple_of(4);
    let binary = chunk(next)?.filter(|(kind, _)| *kind == BIN).map(|(_, body)| body);
    Ok((json, binary))
}

/// Where the files of an asset come from.
pub(super) struct Folder<'a> {
    pub files: &'a dyn FileAccess,
    pub base: PathBuf,
    pub allow_outside: bool,
}

impl Folder<'_> {
    /// The bytes that a URI stands for, and the name to show for it.
    pub fn fetch(&self, uri: &Json) -> Result<(Vec<u8>, String)> {
        let text = uri.as_str()?;
        if let Some(data) = text.strip_prefix("data:") {
            return decode_data(data).map(|b| (b, "data URI".to_string())).map_err(|m| uri.problem(m));
        }
        if text.contains("://") {
            let shown: String = text.chars().take(60).collect();
            return Err(Problem {
                hint: Some("download the file and put it beside the scene".into()),
                ..uri.problem(format!("`{shown}` is on the network, where nothing is read from"))
            });
        }
        let name = percent_decode(text);
        let path = self.resolve(&name).map_err(|m| Problem { hint: Some(OUTSIDE.into()), ..uri.problem(m) })?;
        let bytes = self.files.read(&path).map_err(|e| uri.problem(describe(&path, &e)))?;
        Ok((bytes, name))
    }

    fn resolve(&self, name: &str) -> std::result::Result<PathBuf, String> {
        inside(self.files, &self.base, name, self.allow_outside)
    }
}

const OUTSIDE: &str = "--allow-outside permits it";

/// A path below a folder; a name that leads out of it is refused unless that is allowed.
pub(crate) fn inside(
    files: &dyn FileAccess,
    base: &Path,
    name: &str,
    allow_outside: bool,
) -> std::result::Result<PathBuf, String> {
    let path = Path::new(name);
    let mut depth = 0i64;
    let mut least = 0;
    for part in path.components() {
        depth += match part {
            Component::Normal(_) => 1,
            Component::ParentDir => -1,
            Component::CurDir => 0,
            Component::RootDir | Component::Prefix(_) => -1_000_000,
        };
        least = least.min(depth);
    }
    if least < 0 && !allow_outside {
        return Err(format!("`{name}` lies outside the scene's folder"));
    }
    let joined = base.join(path);
    if !allow_outside
        && let (Some(folder), Some(target)) = (files.followed(base), files.followed(&joined))
        && !target.starts_with(folder)
    {
        return Err(format!("`{name}` is a link that leads outside the scene's folder"));
    }
    Ok(joined)
}

fn percent_decode(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let code = (bytes[i] == b'%').then(|| text.get(i + 1..i + 3)).flatten();
        match code.and_then(|c| u8::from_str_radix(c, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                i += 3;
            }
            None => {
                out.push(bytes[i]);
                i += 1;
            }
        }
    }
    String::from_utf8(out).unwrap_or_else(|_| text.to_string())
}

/// The bytes of a data URI, after `data:`.
fn decode_data(data: &str) -> std::result::Result<Vec<u8>, String> {
    let Some((kind, body)) = data.split_once(',') else { return Err("a data URI without a comma".into()) };
    if !kind.ends_with(";base64") {
        return Ok(percent_decode(body).into_bytes());
    }
    let mut out = Vec::with_capacity(body.len() / 4 * 3);
    let (mut bits, mut count) = (0u32, 0);
    for (at, c) in body.bytes().enumerate() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b'\n' | b'\r' | b' ' => continue,
            _ => return Err(format!("character {at} of the base64 data is none of base64")),
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
        }
    }
    Ok(out)
}

/// A run of bytes with the distance from one element to the next, if that is stated.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'b> {
    pub bytes: &'b [u8],
    pub stride: Option<usize>,
}

/// The view that `view` describes, in the buffers.
pub(super) fn view<'b>(view: &Json, buffers: &'b [Option<Vec<u8>>], key: &str) -> Result<View<'b>> {
    let index = view.need(key)?.as_count()?;
    let buffer = buffers.get(index).ok_or_else(|| missing(view, key, "buffer", index, buffers.len()))?;
    // What is wrong with it was said when it was read.
    let buffer = buffer.as_ref().ok_or_else(|| view.problem(format!("buffer {index} could not be read")))?;
    let offset = view.count("byteOffset")?.unwrap_or(0);
    let length = view.need("byteLength")?.as_count()?;
    let end = offset.checked_add(length).filter(|&end| end <= buffer.len());
    let Some(end) = end else {
        let have = buffer.len();
        return Err(view.problem(format!("reaches to byte {offset} + {length} of buffer {index}, which has {have}")));
    };
    let stride = view.count("byteStride")?;
    if stride.is_some_and(|s| !(1..=255).contains(&s)) {
        return Err(view.problem("`byteStride` must be between 1 and 255"));
    }
    Ok(View { bytes: &buffer[offset..end], stride })
}

/// A reference to something that is not there.
pub(super) fn missing(at: &Json, key: &str, what: &str, index: usize, count: usize) -> Problem {
    let place = at.get(key).unwrap_or_else(|| at.clone());
    place.problem(match count {
        0 => format!("refers to {what} {index}, but there are none"),
        _ => format!("refers to {what} {index}, but there are only {count}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_are_decoded() {
        assert_eq!(decode_data("application/octet-stream;base64,AAEC/w==").unwrap(), [0, 1, 2, 255]);
        assert_eq!(decode_data("text/plain,a%20b").unwrap(), b"a b");
        assert!(decode_data("x;base64,A*").is_err());
        assert_eq!(percent_decode("a%20b%zz%4"), "a b%zz%4");
    }

    #[test]
    fn nothing_is_read_from_outside_the_folder() {
        let (files, base) = (crate::files::Memory::new(), Path::new("scenes/a"));
        assert_eq!(inside(&files, base, "b/../c.bin", false).unwrap(), Path::new("scenes/a/b/../c.bin"));
        assert!(inside(&files, base, "../c.bin", false).is_err());
        assert!(inside(&files, base, "b/../../c.bin", false).is_err());
        assert!(inside(&files, base, "/etc/passwd", false).is_err());
        assert!(inside(&files, base, "../c.bin", true).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_out_of_the_folder_is_outside() {
        let dir = tempfile::tempdir().unwrap();
        let (base, secret) = (dir.path().join("scene"), dir.path().join("secret"));
        std::fs::create_dir(&base).unwrap();
        std::fs::create_dir(&secret).unwrap();
        std::fs::write(secret.join("key"), b"k").unwrap();
        std::fs::write(base.join("own"), b"o").unwrap();
        std::os::unix::fs::symlink(secret.join("key"), base.join("link")).unwrap();
        std::os::unix::fs::symlink(&secret, base.join("folder")).unwrap();
        std::os::unix::fs::symlink(base.join("own"), base.join("near")).unwrap();
        let disk = crate::files::Disk;
        for name in ["link", "folder/key", "folder/../secret/key"] {
            assert!(inside(&disk, &base, name, false).is_err(), "{name}");
            assert!(inside(&disk, &base, name, true).is_ok(), "{name}");
        }
        assert!(inside(&disk, &base, "own", false).is_ok() && inside(&disk, &base, "near", false).is_ok());
        assert!(inside(&disk, &base, "absent", false).is_ok(), "what is missing is told by who reads it");
    }
}
