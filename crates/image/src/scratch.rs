//! Samples in a scratch file that is mapped into memory: the operating system reads what is looked at, and takes the memory back
//! when it is short of it. What has been written never changes, so that whoever reads needs no lock.

#![allow(unsafe_code)]

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::ops::Deref;
use std::sync::{Arc, Mutex, PoisonError};

use memmap2::{Mmap, MmapOptions};

/// A file for samples. It must be this program's alone: a file without a name, or one that nobody else opens.
#[derive(Debug)]
pub struct Scratch {
    file: Mutex<File>,
}

/// Bytes of a scratch file.
#[derive(Clone, Debug)]
pub struct MappedBytes(Arc<Mmap>);

/// Less than this stays in memory: a system allows some tens of thousands of mappings only.
pub(crate) const LEAST: usize = 1 << 18;

impl Scratch {
    /// Takes a file over, which nobody else may write to or shorten as long as anything of it is in use.
    pub fn new(file: File) -> Self {
        Self { file: Mutex::new(file) }
    }

    /// Writes bytes to the end of the file.
    ///
    /// # Errors
    /// Those of the file: a full disk, above all.
    pub fn store(&self, bytes: &[u8]) -> std::io::Result<MappedBytes> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let start = file.seek(SeekFrom::End(0))?;
        file.write_all(bytes)?;
        // SAFETY: the file belongs to this value, which only ever adds to its end, and by the contract of `new` to nobody else: the
        // bytes of this range are never written again, nor is the file cut.
        let map = unsafe { MmapOptions::new().offset(start).len(bytes.len()).map(&*file)? };
        Ok(MappedBytes(Arc::new(map)))
    }
}

impl Deref for MappedBytes {
    type Target = [u8];
    #[inline]
    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl PartialEq for MappedBytes {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}
