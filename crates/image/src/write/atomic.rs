//! A file that appears whole: written under another name in the same folder, flushed to disk, then renamed.

use std::{
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
};

use crate::Error;

/// Writes `bytes` to `path`, replacing what is there. On an error, what was there stays, and no temporary file is left.
///
/// # Errors
/// `Error::Io` with the system's reason.
pub fn write_bytes_atomically(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let failed = |source| Error::Io { path: path.to_owned(), source };
    let (mut file, temporary) = create_temporary(path).map_err(failed)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    drop(file);
    if let Err(source) = written.and_then(|()| fs::rename(&temporary, path)) {
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
        return Err(failed(source));
    }
    sync_folder(path);
    Ok(())
}

/// Creates a file next to `path` under a name that nobody else has.
fn create_temporary(path: &Path) -> std::io::Result<(File, PathBuf)> {
    let stem = path.file_name().ok_or(std::io::ErrorKind::InvalidInput)?;
    for attempt in 0..1000_u32 {
        let mut name = std::ffi::OsString::from(".");
        name.push(stem);
        name.push(format!(".{}-{attempt}.part", std::process::id()));
        let temporary = path.with_file_name(name);
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Ok(file) => return Ok((file, temporary)),
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
    Err(std::io::ErrorKind::AlreadyExists.into())
}

/// Makes the rename itself durable where folders can be opened. The file is complete either way, so a refusal is no failure.
fn sync_folder(path: &Path) {
    if let Some(parent) = path.parent() {
        let folder = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
        if let Ok(f) = File::open(folder) {
            let _ = f.sync_all();
        }
    }
}
