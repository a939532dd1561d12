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
}

/// Least and largest value of a signal; infinite, least above largest, without samples.
pub fn ends(signal: &[f64]) -> [f64; 2] {
    let wider = |[least, most]: [f64; 2], x: &f64| [least.min(*x), most.max(*x)];
    signal.iter().fold([f64::INFINITY, f64::NEG_INFINITY], wider)
}
