//! All files of a scene in one run of bytes, to be read on another machine without a disk.
//!
//! Little endian: `STERPACK`, format, then names and contents, each with its length before it; at the end the BLAKE3 hash.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use steradian_load::FileAccess;

const MAGIC: &[u8; 8] = b"STERPACK";
const FORMAT: u32 = 1;
const HASH: usize = 32;

/// Files under the names by which a scene asks for them, and nothing else.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pack {
    pub files: BTreeMap<PathBuf, Vec<u8>>,
    /// What is there besides, such as folders.
    pub there: BTreeSet<PathBuf>,
}

impl FileAccess for Pack {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match self.files.get(path) {
            Some(bytes) => Ok(bytes.clone()),
            None if self.there.contains(path) => Err(io::Error::from(ErrorKind::IsADirectory)),
            None => Err(io::Error::from(ErrorKind::NotFound)),
        }
    }

    fn exists(&self, path: &Path) -> bool {
        self.files.contains_key(path) || self.there.contains(path)
    }
}

impl Pack {
    /// As bytes.
    pub fn encode(&self, head: &[u8]) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.extend_from_slice(&FORMAT.to_le_bytes());
        let mut put = |bytes: &[u8]| {
            out.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
            out.extend_from_slice(bytes);
        };
        put(head);
        put(&(self.files.len() as u64).to_le_bytes());
        for (name, bytes) in &self.files {
            put(name.as_os_str().as_encoded_bytes());
            put(bytes);
        }
        for name in &self.there {
            put(name.as_os_str().as_encoded_bytes());
        }
        let hash = blake3::hash(&out);
        out.extend_from_slice(hash.as_bytes());
        out
    }

    /// And back, with the head.
    pub fn decode(bytes: &[u8]) -> Result<(Vec<u8>, Pack), String> {
        let damaged = || "the packed scene is damaged".to_owned();
        let body = bytes.len().checked_sub(HASH).map(|n| &bytes[..n]).ok_or_else(damaged)?;
        let rest = body.strip_prefix(MAGIC).ok_or("this is no packed scene")?;
        if blake3::hash(body).as_bytes() != &bytes[body.len()..] {
            return Err(damaged());
        }
        let (format, mut rest) = rest.split_first_chunk::<4>().ok_or_else(damaged)?;
        if u32::from_le_bytes(*format) != FORMAT {
            return Err("the packed scene is of another version of Steradian".into());
        }
        let mut next = || -> Option<&[u8]> {
            let (length, after) = rest.split_first_chunk::<8>()?;
            let length = usize::try_from(u64::from_le_bytes(*length)).ok().filter(|&n| n <= after.len())?;
            let (found, after) = after.split_at(length);
            rest = after;
            Some(found)
        };
        let name = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).map(PathBuf::from).map_err(|_| damaged());
        let head = next().ok_or_else(damaged)?.to_vec();
        let count = next().and_then(|b| b.try_into().ok()).map(u64::from_le_bytes).ok_or_else(damaged)?;
        let mut pack = Pack::default();
        for _ in 0..count {
            let file = name(next().ok_or_else(damaged)?)?;
            pack.files.insert(file, next().ok_or_else(damaged)?.to_vec());
        }
        while let Some(path) = next() {
            pack.there.insert(name(path)?);
        }
        Ok((head, pack))
    }
}

/// Passes files through and remembers which were asked for.
pub(super) struct Asking<'a> {
    files: &'a dyn FileAccess,
    read: Mutex<BTreeSet<PathBuf>>,
    there: Mutex<BTreeSet<PathBuf>>,
}

impl<'a> Asking<'a> {
    /// Files of this kind.
    pub fn new(files: &'a dyn FileAccess) -> Self {
        Self { files, read: Mutex::default(), there: Mutex::default() }
    }

    /// The files that were read, and what else was found to be there.
    pub fn seen(self) -> (BTreeSet<PathBuf>, BTreeSet<PathBuf>) {
        let inner = |m: Mutex<BTreeSet<PathBuf>>| m.into_inner().unwrap_or_else(PoisonError::into_inner);
        (inner(self.read), inner(self.there))
    }
}

impl FileAccess for Asking<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.files.read(path)?;
        self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_path_buf());
        Ok(bytes)
    }

    fn exists(&self, path: &Path) -> bool {
        let there = self.files.exists(path);
        if there {
            self.there.lock().unwrap_or_else(PoisonError::into_inner).insert(path.to_path_buf());
        }
        there
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pack_survives_the_journey_and_damage_is_noticed() {
        let mut pack = Pack::default();
        pack.files.insert("a/b.pbrt".into(), b"Shape".to_vec());
        pack.files.insert("/c/d.ply".into(), vec![]);
        pack.there.insert("a".into());
        let bytes = pack.encode(b"head");
        assert_eq!(Pack::decode(&bytes).unwrap(), (b"head".to_vec(), pack));
        for i in 0..bytes.len() {
            let mut bad = bytes.clone();
            bad[i] ^= 0x40;
            assert!(Pack::decode(&bad).is_err());
            assert!(Pack::decode(&bytes[..i]).is_err());
        }
    }
}
