//! The one error type of this crate, sorted by whose fault it is.

use std::path::PathBuf;

/// Why an image could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Neither the first bytes nor the extension name a format that this crate reads or writes.
    #[error("{name}: not an image format that is known here (EXR, PNG, JPEG, HDR, PFM, TGA, BMP, QOI)")]
    UnknownFormat {
        /// File name as the caller gave it.
        name: String,
    },
    /// The format is known, but this file uses, or the caller asked for, something that it or this crate cannot do.
    #[error("{name}: {what}")]
    Unsupported {
        /// File name as the caller gave it.
        name: String,
        /// The feature, as a sentence fragment.
        what: String,
    },
    /// The bytes break the rules of their format, or end too early.
    #[error("{name}: damaged {format} file: {what}")]
    Malformed {
        /// File name as the caller gave it.
        name: String,
        /// Format in capitals.
        format: &'static str,
        /// What is wrong.
        what: String,
    },
    /// The header asks for more memory than the limit, or for more than so short a file can hold. Nothing was allocated.
    #[error("{name}: {width} x {height} pixels would take {bytes} bytes, and the limit for this file is {limit}")]
    TooLarge {
        /// File name as the caller gave it.
        name: String,
        /// Width in the header, in pixels.
        width: u64,
        /// Height in the header, in pixels.
        height: u64,
        /// Memory that the decoded image would take.
        bytes: u64,
        /// Memory that was allowed.
        limit: u64,
    },
    /// The channels of an image do not fit what was asked of it.
    #[error("{what}")]
    Shape {
        /// What does not fit.
        what: String,
    },
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file that was being written.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

impl Error {
    pub(crate) fn malformed(name: &str, format: &'static str, what: impl ToString) -> Error {
        Error::Malformed { name: name.to_owned(), format, what: what.to_string() }
    }

    pub(crate) fn unsupported(name: &str, what: impl ToString) -> Error {
        Error::Unsupported { name: name.to_owned(), what: what.to_string() }
    }

    pub(crate) fn shape(what: impl ToString) -> Error {
        Error::Shape { what: what.to_string() }
    }
}
