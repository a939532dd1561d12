//! Stretches of a signal in which all samples are equal.

use core::ops::Range;

/// Runs of equal samples: every sample is in one of them.
#[derive(Clone, Debug)]
pub struct EqualRuns<'a> {
    signal: &'a [f64],
    /// First sample of each, then the number of samples.
    starts: Vec<usize>,
}

impl<'a> EqualRuns<'a> {
    /// The runs of a signal.
    ///
    /// # Examples
    ///
    /// ```
    /// use inference::EqualRuns;
    ///
    /// let runs = EqualRuns::of(&[1.0, 1.0, 2.0, 1.0]);
    /// assert_eq!(runs.iter().collect::<Vec<_>>(), [(1.0, 0..2), (2.0, 2..3), (1.0, 3..4)]);
    /// ```
    pub fn of(signal: &'a [f64]) -> Self {
        let changes = (1..signal.len()).filter(|&n| signal[n] != signal[n - 1]);
        let first = (!signal.is_empty()).then_some(0);
        Self { signal, starts: first.into_iter().chain(changes).chain([signal.len()]).collect() }
    }

    /// Value and samples of each run, in order.
    pub fn iter(&self) -> impl Iterator<Item = (f64, Range<usize>)> + '_ {
        self.starts.windows(2).map(|w| (self.signal[w[0]], w[0]..w[1]))
    }

    /// Median of their lengths; zero without samples.
    pub fn median_length(&self) -> usize {
        let mut lengths: Vec<usize> = self.iter().map(|(_, run)| run.len()).collect();
        lengths.sort_unstable();
        lengths.get(lengths.len() / 2).copied().unwrap_or(0)
    }

    /// Ends of the signal's range at which it stands, in magnitude below a limit that its source
    /// keeps: there in runs of more samples than `longer_than`, and of at least 3, with at least 8
    /// samples and 0.1 % of all in them together. A level from 98 % of the limit on is that limit.
    pub fn standing_at_ends(&self, limit: f64, longer_than: usize) -> Vec<Standing> {
        let least = LEAST_RUN.max(longer_than + 1);
        let at = |level: f64| {
            let here = self.iter().filter(|(value, run)| *value == level && run.len() >= least);
            let runs: Vec<Range<usize>> = here.map(|(_, run)| run).collect();
            let samples: usize = runs.iter().map(Range::len).sum();
            let share = samples as f64 / self.signal.len() as f64;
            let is_below = level.abs() < LIMIT_SHARE * limit;
            let stands = is_below && samples >= LEAST_SAMPLES && share >= LEAST_SHARE;
            stands.then_some(Standing { level, share, runs })
        };
        ends(self.signal).into_iter().filter_map(at).collect()
    }
}

/// An end of a signal's range at which it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// Value of its samples there.
    pub level: f64,
    /// Share of all samples.
    pub share: f64,
    /// Samples that stand there.
    pub runs: Vec<Range<usize>>,
}

/// Fewest samples of a run that tells, of all such runs together, and their least share.
const LEAST_RUN: usize = 3;
const LEAST_SAMPLES: usize = 8;
const LEAST_SHARE: f64 = 1e-3;
/// Share of a limit from which a level is that limit.
pub const LIMIT_SHARE: f64 = 0.98;

/// Least and largest value of a signal; infinite, least above largest, without samples.
pub fn ends(signal: &[f64]) -> [f64; 2] {
    let wider = |[least, most]: [f64; 2], x: &f64| [least.min(*x), most.max(*x)];
    signal.iter().fold([f64::INFINITY, f64::NEG_INFINITY], wider)
}
