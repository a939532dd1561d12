//! Exit codes.

use std::process::ExitCode;

/// How the command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitStatus {
    /// 0: the work was done; with `--exit-code`, and everything is healthy.
    Done,
    /// 1: with `--exit-code`, a fault or a model error was found.
    Found,
    /// 2: it could not be done, or some recordings of a batch could not be.
    Failed,
    /// 3: with `--exit-code`, nothing was found and of some recordings nothing concluded.
    Open,
}

impl ExitStatus {
    /// The number.
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Found => 1,
            Self::Failed => 2,
            Self::Open => 3,
        }
    }
}

impl From<ExitStatus> for ExitCode {
    fn from(status: ExitStatus) -> Self {
        status.code().into()
    }
}
