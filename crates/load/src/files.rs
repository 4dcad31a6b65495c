//! The one way to files: a trait, so that tests and archives can stand in for the disk, and gunzip with a limit.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Where the loader's bytes come from.
pub trait FileAccess: Sync {
    /// The whole file.
    ///
    /// # Errors
    /// As the operating system says; `IsADirectory` for a directory.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// Whether there is anything under that name.
    fn exists(&self, path: &Path) -> bool;

    /// Where a path leads when all links are followed; `None` if nothing is there, or where there are no links.
    fn followed(&self, _path: &Path) -> Option<PathBuf> {
        None
    }
}

/// The file system of this machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl FileAccess for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        // Opening a directory succeeds on some systems and then fails with a message about something else.
        if std::fs::metadata(path)?.is_dir() {
            return Err(io::Error::from(ErrorKind::IsADirectory));
        }
        std::fs::read(path)
    }

    fn exists(&self, path: &Path) -> bool {
        path.exists()
    }

    fn followed(&self, path: &Path) -> Option<PathBuf> {
        std::fs::canonicalize(if path.as_os_str().is_empty() { Path::new(".") } else { path }).ok()
    }
}

/// Files that are held in memory; a name that only occurs as the folder of another is a directory.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl Memory {
    /// No files.
    pub fn new() -> Memory {
        Memory::default()
    }

    /// With one more file.
    #[must_use]
    pub fn with(mut self, path: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) -> Memory {
        self.files.insert(path.into(), bytes.into());
        self
    }
}

impl FileAccess for Memory {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match self.files.get(path) {
            Some(bytes) => Ok(bytes.clone()),
            None if self.exists(path) => Err(io::Error::from(ErrorKind::IsADirectory)),
            None => Err(io::Error::from(ErrorKind::NotFound)),
        }
    }

    fn exists(&self, path: &Path) -> bool {
        self.files.keys().any(|k| k.starts_with(path))
    }
}

/// Most bytes that one compressed file may grow to: a few kilobytes of gzip can claim terabytes.
pub(crate) const MOST_DECOMPRESSED: u64 = 16 << 30;

/// The bytes of a file, decompressed if they are gzip; the error is a sentence fragment that names the file.
pub(crate) fn read_all(files: &dyn FileAccess, path: &Path) -> Result<Vec<u8>, String> {
    let bytes = files.read(path).map_err(|e| describe(path, &e))?;
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(bytes);
    }
    gunzip(&bytes, MOST_DECOMPRESSED).map_err(|what| format!("{}: {what}", path.display()))
}

fn gunzip(bytes: &[u8], most: u64) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    let mut reader = flate2::read::MultiGzDecoder::new(bytes).take(most + 1);
    match reader.read_to_end(&mut out) {
        Ok(n) if n as u64 > most => Err(format!("unpacks to more than {most} bytes")),
        Ok(_) => Ok(out),
        Err(_) => Err(format!("damaged gzip data after {} unpacked bytes", out.len())),
    }
}

/// An operating system's error in the words that this loader uses.
pub(crate) fn describe(path: &Path, error: &io::Error) -> String {
    let path = path.display();
    match error.kind() {
        ErrorKind::NotFound => format!("{path}: no such file"),
        ErrorKind::IsADirectory => format!("{path}: is a directory, not a file"),
        ErrorKind::PermissionDenied => format!("{path}: permission denied"),
        _ => format!("{path}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn gz(bytes: &[u8]) -> Vec<u8> {
        let mut e = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        e.write_all(bytes).unwrap();
        e.finish().unwrap()
    }

    #[test]
    fn gzip_is_told_by_its_content_and_kept_below_a_limit() {
        let text = b"WorldBegin\n".repeat(1000);
        let packed = gz(&text);
        let cut = packed[..packed.len() / 2].to_vec();
        let files = Memory::new().with("a.pbrt", packed.clone()).with("b.gz", text.clone()).with("dir/cut.gz", cut);
        assert_eq!(read_all(&files, Path::new("a.pbrt")).unwrap(), text);
        assert_eq!(read_all(&files, Path::new("b.gz")).unwrap(), text);
        let e = read_all(&files, Path::new("dir/cut.gz")).unwrap_err();
        assert!(e.starts_with("dir/cut.gz: damaged gzip data after "), "{e}");
        assert_eq!(gunzip(&packed, 100).unwrap_err(), "unpacks to more than 100 bytes");
        assert_eq!(read_all(&files, Path::new("c")).unwrap_err(), "c: no such file");
        assert_eq!(read_all(&files, Path::new("dir")).unwrap_err(), "dir: is a directory, not a file");
    }

    #[test]
    fn the_disk_tells_a_directory_from_a_missing_file() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(Disk.read(dir.path()).unwrap_err().kind(), ErrorKind::IsADirectory);
        assert_eq!(Disk.read(&dir.path().join("x")).unwrap_err().kind(), ErrorKind::NotFound);
        std::fs::write(dir.path().join("x"), b"hi").unwrap();
        assert_eq!(Disk.read(&dir.path().join("x")).unwrap(), b"hi");
    }
}
