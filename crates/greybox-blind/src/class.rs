//! Classes of cases.

/// Class of a case by what it tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Class {
    /// Nothing hidden, Gaussian noise, perhaps incipient faults.
    Null,
    /// Nothing hidden, with unusual noise.
    UnusualNull,
    /// One effect of the catalogue; half of the machines are healthy.
    Single,
    /// Two, both visible.
    Double,
    /// An effect that no catalogue has.
    Outside,
    /// Strong faults and nothing hidden.
    FaultOnly,
    /// One effect that the recordings cannot tell from another.
    Tied,
}

impl Class {
    /// All classes.
    pub const ALL: [Self; 7] = [
        Self::Null,
        Self::UnusualNull,
        Self::Single,
        Self::Double,
        Self::Outside,
        Self::FaultOnly,
        Self::Tied,
    ];

    /// Name in truths and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::UnusualNull => "unusual-null",
            Self::Single => "single",
            Self::Double => "double",
            Self::Outside => "outside",
            Self::FaultOnly => "fault-only",
            Self::Tied => "tied",
        }
    }

    /// The class of that name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|class| class.name() == name)
    }

    /// Tells whether something is hidden.
    pub fn hides(self) -> bool {
        !matches!(self, Self::Null | Self::UnusualNull | Self::FaultOnly)
    }
}
