//! A file that appears whole: written under another name in the same folder, flushed to disk, then renamed.

use std::{
    ffi::OsString,
    fs::{self, File, OpenOptions},
    io::{ErrorKind, Write},
    path::{Path, PathBuf},
};

use crate::Error;

/// How often somebody else may take away a file that is being written before that is an error.
const ATTEMPTS: u32 = 3;

/// Writes `bytes` to `path`, replacing what is there. On an error, what was there stays, and no temporary file is left. What a process that
/// was killed has left, [`remove_leftovers`] takes away.
///
/// # Errors
/// `Error::Io` with the system's reason.
pub fn write_bytes_atomically(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut written = write_and_rename(path, bytes);
    for _ in 1..ATTEMPTS {
        match &written {
            // Taken for a leftover in the moment before it was locked.
            Err(e) if e.kind() == ErrorKind::NotFound => written = write_and_rename(path, bytes),
            _ => break,
        }
    }
    written.map_err(|source| Error::Io { path: path.to_owned(), source })?;
    sync_folder(path);
    Ok(())
}

fn write_and_rename(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let (mut file, temporary) = create_temporary(path)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all()).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        drop(file);
        // The first error is the one to report.
        let _ = fs::remove_file(&temporary);
    }
    written
}

/// Creates a file next to `path` under a name that nobody else has, and locks it for as long as it is open.
fn create_temporary(path: &Path) -> std::io::Result<(File, PathBuf)> {
    let stem = path.file_name().ok_or(ErrorKind::InvalidInput)?;
    for attempt in 0..1000_u32 {
        let mut name = OsString::from(".");
        name.push(stem);
        name.push(format!(".{}-{attempt}.part", std::process::id()));
        let temporary = path.with_file_name(name);
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Ok(file) => {
                // Where files cannot be locked, nobody can tell that one is left over, and nobody takes it away.
                let _ = file.lock();
                return Ok((file, temporary));
            }
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
    Err(ErrorKind::AlreadyExists.into())
}

/// Removes what processes that were killed while they wrote `path` have left next to it. A file that is being written is locked, on this
/// machine or another, and stays. What cannot be removed stays as well: it does no harm.
pub fn remove_leftovers(path: &Path) {
    let (Some(stem), Some(parent)) = (path.file_name().and_then(|n| n.to_str()), path.parent()) else { return };
    let folder = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if !entry.file_name().to_str().is_some_and(|name| is_temporary_of(name, stem)) {
            continue;
        }
        let abandoned = OpenOptions::new().write(true).open(entry.path()).is_ok_and(|f| f.try_lock().is_ok());
        if abandoned {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether [`create_temporary`] could have given this name to a file that was to become `stem`.
fn is_temporary_of(name: &str, stem: &str) -> bool {
    let number = |s: &str| !s.is_empty() && s.bytes().all(|b| b.is_ascii_digit());
    let rest = name.strip_prefix('.').and_then(|n| n.strip_prefix(stem)?.strip_prefix('.')?.strip_suffix(".part"));
    rest.and_then(|r| r.split_once('-')).is_some_and(|(process, attempt)| number(process) && number(attempt))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let others =
            [".a.exr", ".a.exr.part", ".a.exr.1-x.part", ".b.exr.1-0.part", ".a.exr.1-0.partial", "a.exr.1-0.part"];
        for name in others.iter().chain(&[".a.exr.1-0.part", ".a.exr.4294967295-12.part"]) {
            fs::write(dir.path().join(name), b"half").unwrap();
        }
        // One that is being written, by this very process.
        let (busy, temporary) = create_temporary(&path).unwrap();
        remove_leftovers(&path);
        assert!(temporary.exists());
        assert!(others.iter().all(|name| dir.path().join(name).exists()));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), others.len() + 1);
        drop(busy);
        remove_leftovers(&path);
        assert!(!temporary.exists());
    }

    #[test]
    fn a_file_that_is_taken_away_is_written_again() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        std::thread::scope(|s| {
            let cleaner = s.spawn(|| (0..2000).for_each(|_| remove_leftovers(&path)));
            for _ in 0..20 {
                write_bytes_atomically(&path, b"whole").unwrap();
            }
            cleaner.join().unwrap();
        });
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
