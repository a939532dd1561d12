//! The cases: a problem, a view of its scalar, methods and seeds.

use experiments::{Contender, Protocol, SearchSpace, SearchView, SearchedScalar};

/// Largest level of an incipient fault.
const INCIPIENT: f64 = 0.05;

/// Seeds of the paired comparison.
pub(super) const SEEDS: usize = 200;
/// Seeds of what explains it.
pub(super) const FEW_SEEDS: usize = 60;
/// Level below which the logarithmic axis is linear: the least of the test conditions.
const SCALE: f64 = 0.002;

/// A view of the scalar with its name on the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum View {
    Whole,
    Incipient,
    Cubic,
    Logarithmic,
    /// The whole domain, `ln δ` minimised.
    LogOfWhole,
}

impl View {
    /// Name in the file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Incipient => "incipient",
            Self::Cubic => "cubic",
            Self::Logarithmic => "logarithmic",
            Self::LogOfWhole => "log-of-whole",
        }
    }

    /// Name on the page.
    pub(super) fn label(self) -> &'static str {
        match self {
            Self::Whole => "[0, 1]",
            Self::Incipient => "[0, 0.05]",
            Self::Cubic => "[0, 1], k = u³",
            Self::Logarithmic => "[0, 1], u logarithmic in k",
            Self::LogOfWhole => "[0, 1], ln δ minimised",
        }
    }

    pub(super) fn view(self) -> SearchView {
        SearchView::of(match self {
            Self::Whole => SearchSpace::Linear { largest: 1.0 },
            Self::Incipient => SearchSpace::Linear { largest: INCIPIENT },
            Self::Cubic => SearchSpace::Cubic,
            Self::Logarithmic => SearchSpace::Logarithmic { scale: SCALE },
            Self::LogOfWhole => {
                let space = SearchSpace::Linear { largest: 1.0 };
                return SearchView { space, scalar: SearchedScalar::Logarithm };
            }
        })
    }
}

/// Searches of one kind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Case {
    pub(super) problem: Protocol,
    pub(super) view: View,
    pub(super) contenders: &'static [Contender],
    pub(super) seeds: usize,
}

/// The pair that is compared.
pub(super) const PAIR: [Contender; 2] = [Contender::Ei, Contender::TwoStepEi];
const UCB: [Contender; 1] = [Contender::Ucb];
const CHEAP: [Contender; 2] = [Contender::Ei, Contender::Ucb];

const fn paired(problem: Protocol, view: View) -> Case {
    Case { problem, view, contenders: &PAIR, seeds: SEEDS }
}

const fn case(problem: Protocol, view: View, contenders: &'static [Contender]) -> Case {
    Case { problem, view, contenders, seeds: FEW_SEEDS }
}

/// The six of the test.
pub(super) const COMPARED: [Case; 6] = [
    paired(Protocol::High, View::Whole),
    paired(Protocol::High, View::Incipient),
    paired(Protocol::Low, View::Whole),
    paired(Protocol::Low, View::Incipient),
    paired(Protocol::Bench, View::Whole),
    paired(Protocol::Bench, View::Incipient),
];

/// Cases that explain the comparison.
pub(super) const EXPLAINING: [Case; 5] = [
    case(Protocol::Low, View::Whole, &UCB),
    case(Protocol::Low, View::Incipient, &UCB),
    case(Protocol::Low, View::Cubic, &CHEAP),
    case(Protocol::Low, View::Logarithmic, &CHEAP),
    case(Protocol::Low, View::LogOfWhole, &CHEAP),
];

/// Every case, those that take long last.
pub(super) fn all() -> impl Iterator<Item = Case> {
    EXPLAINING.into_iter().chain(COMPARED.into_iter().rev())
}

/// Name of the monitor on the page.
pub(super) fn monitor(problem: Protocol) -> &'static str {
    match problem {
        Protocol::High => "high fidelity",
        Protocol::Low => "low fidelity",
        _ => "bench, two faults",
    }
}

/// Evaluations after which a search is noted.
pub(super) fn marks(problem: Protocol) -> &'static [usize] {
    match problem {
        Protocol::Bench => &[10, 15, 20, 30, 40],
        _ => &[20, 30, 50, 75, 100, 125],
    }
}
