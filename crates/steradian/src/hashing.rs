//! The scene's identity: a hash over everything that was read to make it.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use steradian_load::FileAccess;

/// Passes files through and remembers what they held.
pub(crate) struct Hashing<'a> {
    files: &'a dyn FileAccess,
    /// Names without folders, and hashes: a scene that moves to another place stays the same.
    seen: Mutex<BTreeSet<(String, [u8; 32])>>,
}

impl<'a> Hashing<'a> {
    /// Files of this kind.
    pub fn new(files: &'a dyn FileAccess) -> Self {
        Self { files, seen: Mutex::default() }
    }

    /// Notes a text that came another way.
    pub fn note(&self, name: &str, bytes: &[u8]) {
        let entry = (name.to_owned(), *blake3::hash(bytes).as_bytes());
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).insert(entry);
    }

    /// One hash of everything, in hexadecimal digits.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for (name, hash) in self.seen.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            hasher.update(&(name.len() as u64).to_le_bytes());
            hasher.update(name.as_bytes());
            hasher.update(hash);
        }
        hasher.finalize().to_hex()[..32].to_owned()
    }
}

impl FileAccess for Hashing<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.files.read(path)?;
        self.note(&path.file_name().unwrap_or_default().to_string_lossy(), &bytes);
        Ok(bytes)
    }

    fn exists(&self, path: &Path) -> bool {
        self.files.exists(path)
    }

    fn followed(&self, path: &Path) -> Option<PathBuf> {
        self.files.followed(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_load::Memory;

    fn hash(files: &[(&str, &str)], order: &[&str]) -> String {
        let memory = files.iter().fold(Memory::new(), |m, (name, text)| m.with(*name, *text));
        let h = Hashing::new(&memory);
        order.iter().for_each(|name| assert!(h.read(Path::new(name)).is_ok()));
        h.hash()
    }

    #[test]
    fn the_hash_is_of_content_and_names_not_of_places_or_order() {
        let base = hash(&[("a/x.pbrt", "1"), ("a/y.ply", "2")], &["a/x.pbrt", "a/y.ply"]);
        assert_eq!(base, hash(&[("b/x.pbrt", "1"), ("b/y.ply", "2")], &["b/y.ply", "b/x.pbrt", "b/y.ply"]));
        assert_ne!(base, hash(&[("a/x.pbrt", "1"), ("a/y.ply", "3")], &["a/x.pbrt", "a/y.ply"]));
        assert_ne!(base, hash(&[("a/x.pbrt", "1")], &["a/x.pbrt"]));
        assert_eq!(base.len(), 32);
    }
}
