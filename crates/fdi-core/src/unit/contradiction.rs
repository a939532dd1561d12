//! A contradiction between the recordings as new of a unit, and where it is kept.

use std::sync::OnceLock;

use crate::report::{Notice, NoticeCode};

/// Advice on recordings that are all of one session because none says of which it is.
pub(crate) const NO_SESSION: &str = "; none of them states `date` or `session`, so that they count as of \
                                     one day: state where they are of several";

/// Recordings of a unit as new that are not of one machine without damage.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// How many recordings as new there are.
    pub recordings: usize,
    /// Name of the recording without which the others agree; `None` where no one of them is the cause.
    pub odd_one: Option<String>,
    /// True where none of them states a session or a day, so that all count as of one.
    pub states_no_session: bool,
}

impl Contradiction {
    /// The contradiction in words, and what to do.
    pub fn in_words(&self) -> String {
        let odd_one = self.odd_one.as_ref().map_or_else(String::new, |name| {
            format!("; without `{name}` the others agree (is it of this machine, and as new?)")
        });
        let session = if self.states_no_session { NO_SESSION } else { "" };
        let count = self.recordings;
        format!("the {count} recordings as new contradict one another{odd_one}{session}")
    }

    pub(crate) fn notice(&self) -> Notice {
        Notice {
            code: NoticeCode::ReferencesDisagree,
            message: format!(
                "{}. They are not used: levels are damage beside the tolerances, and no changes \
                 since the machine was new",
                self.in_words()
            ),
        }
    }
}

/// Contradiction of a unit's recordings, where there is one, found when it is first asked for.
#[derive(Debug, Default)]
pub(crate) struct Agreement(OnceLock<Option<Contradiction>>);

impl Agreement {
    /// The contradiction, looked for where it was not yet.
    pub(crate) fn or_find(
        &self,
        find: impl FnOnce() -> Option<Contradiction>,
    ) -> Option<&Contradiction> {
        self.0.get_or_init(find).as_ref()
    }
}

impl Clone for Agreement {
    /// A copy may learn on.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Agreement {
    /// Always: a contradiction follows from the recordings, which are compared beside it.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
