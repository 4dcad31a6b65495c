//! Why a command ends without having done what was asked, and the exit code that says so.

use std::fmt;

/// The exit codes that scripts rely on.
pub(crate) const DONE: u8 = 0;
pub(crate) const DIFFERS: u8 = 1;
pub(crate) const INPUT: u8 = 2;
pub(crate) const ENVIRONMENT: u8 = 3;
pub(crate) const INTERRUPTED: u8 = 130;

/// A command's failure.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The input is at fault; everything has been said already.
    Reported,
    /// The input is at fault.
    Input(String),
    /// The machine is at fault: no such folder, disk full, permission denied.
    Environment(String),
}

impl Failure {
    /// The exit code.
    pub fn code(&self) -> u8 {
        match self {
            Failure::Reported | Failure::Input(_) => INPUT,
            Failure::Environment(_) => ENVIRONMENT,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Reported => Ok(()),
            Failure::Input(what) | Failure::Environment(what) => f.write_str(what),
        }
    }
}

/// The system's reason in a person's words.
pub(crate) fn reason(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound => "no such file or folder".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::IsADirectory => "it is a folder".into(),
        ErrorKind::NotADirectory => "a part of the path is not a folder".into(),
        ErrorKind::StorageFull => "the disk is full".into(),
        ErrorKind::QuotaExceeded => "the disk quota is used up".into(),
        ErrorKind::ReadOnlyFilesystem => "the disk is read-only".into(),
        ErrorKind::FileTooLarge => "the file would be larger than is allowed here".into(),
        _ => error.to_string(),
    }
}
