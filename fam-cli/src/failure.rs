//! What ends a command early.

use std::fmt;

/// Exit code of a command that did what it was asked for.
pub const SUCCESS: u8 = 0;

/// Exit code where the work failed.
pub const FAILED: u8 = 1;

/// Exit code where the input or the call cannot be worked with.
pub const USAGE: u8 = 2;

/// One line for standard error, and an exit code.
#[derive(Debug)]
pub enum Failure {
    /// The input or the call cannot be worked with: exit code 2.
    Input(String),
    /// The work itself failed: exit code 1.
    Work(String),
}

impl Failure {
    /// An input that cannot be worked with.
    pub fn input(reason: impl fmt::Display) -> Self {
        Self::Input(reason.to_string())
    }

    /// Work that failed.
    pub fn work(reason: impl fmt::Display) -> Self {
        Self::Work(reason.to_string())
    }

    /// The failure with the input that it is about, if that is to blame.
    pub fn of(self, input: &str) -> Self {
        match self {
            Self::Input(reason) => Self::Input(format!("{input}: {reason}")),
            work => work,
        }
    }

    /// The exit code that tells a script which of the two it was.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) => USAGE,
            Self::Work(_) => FAILED,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Input(reason) | Self::Work(reason)) = self;
        f.write_str(reason)
    }
}
