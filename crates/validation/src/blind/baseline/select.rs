//! Three rules that choose among the features.

use std::collections::BTreeMap;

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{
    design::{Design, FREQUENCIES, Rows},
    feature::{Feature, Shape},
    gram::Gram,
};

/// Family-wise level of the F test.
const LEVEL: f64 = 0.01;
/// Thresholds on a feature's rms over that of what faults and nuisance parameters leave.
const THRESHOLDS: [f64; 10] = [0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.45, 0.7, f64::INFINITY];
/// Rounds of thresholding at most.
const ROUNDS: usize = 30;
/// A sparser answer wins unless its held-out squares are more by this share.
const CLEARLY: f64 = 0.005;
/// Share of a feature's length beside faults and nuisance parameters below which it says nothing
/// new.
const NOTHING_NEW: f64 = 1e-3;

/// Share of a feature's squares, beside the features before it, below which thresholded least
/// squares leaves it out.
const ALIKE: f64 = 0.02;

/// Rows of the hold-out in a block: a quarter of a second.
const BLOCK: usize = 50;

/// Products of all columns, in training and on the hold-out.
#[derive(Clone, Debug)]
pub(super) struct Problem {
    features: Vec<Feature>,
    /// Columns of faults and nuisance parameters come first.
    nuisance: usize,
    /// Columns of each feature in training and on the hold-out: of vibrations not the same.
    train_of: Vec<Vec<usize>>,
    hold_out_of: Vec<Vec<usize>>,
    train: Gram,
    /// Two halves of the hold-out, in blocks by turns.
    hold_out: [Gram; 2],
    /// Training beside faults and nuisance parameters.
    beside: Gram,
}

impl Problem {
    pub(super) fn of(design: &Design) -> Self {
        let nuisance = design.train.nuisance.len();
        let (train, train_of) = products(&design.train, |_| true);
        let half = |odd: bool| products(&design.hold_out, |n| (n / BLOCK % 2 == 1) == odd);
        let ((even, hold_out_of), (odd, _)) = (half(false), half(true));
        let beside = train.after(nuisance);
        Self {
            features: design.features.clone(),
            nuisance,
            train_of,
            hold_out_of,
            train,
            hold_out: [even, odd],
            beside,
        }
    }

    /// Features of which something is left beside faults and nuisance parameters.
    fn usable(&self) -> Vec<usize> {
        let new = |f: &usize| {
            let columns = &self.train_of[*f];
            let length = |gram: &Gram| -> f64 {
                columns.iter().map(|&c| gram.between(&[c], &[1.0])).sum::<f64>().sqrt()
            };
            length(&self.beside) > NOTHING_NEW * length(&self.train)
        };
        (0..self.features.len()).filter(new).collect()
    }

    /// Sizes of one feature alone beside faults and nuisance parameters, and the squares left,
    /// unless its sign is refused.
    fn alone(&self, f: usize) -> Option<(&'static str, f64)> {
        let sizes = self.beside.solve(&self.train_of[f]);
        let name = self.features[f].name(&sizes)?;
        Some((name, self.beside.left(&self.train_of[f], &sizes)))
    }

    /// The feature with the best F statistic for white noise, if that is significant.
    pub(super) fn white_f(&self) -> Vec<&'static str> {
        let usable = self.usable();
        let looked_at = |f: &usize| match self.features[*f].shape {
            Shape::Vibration(_) => FREQUENCIES / 2,
            _ => 1,
        };
        let tests: usize = usable.iter().map(looked_at).sum();
        let mut best: Option<(f64, &'static str)> = None;
        for f in usable {
            let more = self.train_of[f].len();
            let Some(free) = self.beside.rows.checked_sub(self.nuisance + more + 1) else {
                continue;
            };
            let Some((name, left)) = self.alone(f) else { continue };
            let (more, free) = (more as f64, free as f64 + 1.0);
            let statistic = (self.beside.squares() - left) / more / (left / free);
            let significant = FisherSnedecor::new(more, free)
                .is_ok_and(|law| law.sf(statistic) < LEVEL / tests as f64);
            if significant && best.is_none_or(|(before, _)| statistic > before) {
                best = Some((statistic, name));
            }
        }
        best.into_iter().map(|(_, name)| name).collect()
    }

    /// The feature that leaves least on the hold-out, whatever it leaves.
    pub(super) fn best_rms(&self) -> Vec<&'static str> {
        let mut best: Option<(f64, &'static str)> = None;
        for f in self.usable() {
            let Some((name, _)) = self.alone(f) else { continue };
            let left = self.held_out(&[f]);
            if best.is_none_or(|(before, _)| left < before) {
                best = Some((left, name));
            }
        }
        best.into_iter().map(|(_, name)| name).collect()
    }

    /// Squares left on the hold-out by features fitted to the training; a vibration's phases are
    /// the recording's own: they are fitted to each half of it for the other.
    fn held_out(&self, features: &[usize]) -> f64 {
        let vibrates = |f: &usize| matches!(self.features[*f].shape, Shape::Vibration(_));
        let mut train: Vec<usize> = (0..self.nuisance).collect();
        let mut hold_out: Vec<Option<usize>> = train.iter().map(|&n| Some(n)).collect();
        let mut own = Vec::new();
        for f in features {
            train.extend(&self.train_of[*f]);
            if vibrates(f) {
                hold_out.extend(self.train_of[*f].iter().map(|_| None));
                own.extend(&self.hold_out_of[*f]);
            } else {
                hold_out.extend(self.hold_out_of[*f].iter().map(|&c| Some(c)));
            }
        }
        let sizes = self.train.solve(&train);
        let (active, sizes): (Vec<usize>, Vec<f64>) =
            hold_out.into_iter().zip(sizes).filter_map(|(c, size)| Some((c?, size))).unzip();
        let [even, odd] = &self.hold_out;
        let crossed = |here: &Gram, there: &Gram| {
            let more = there.solve_beside(&active, &sizes, &own);
            here.left(&[active.as_slice(), &own].concat(), &[sizes.as_slice(), &more].concat())
        };
        crossed(even, odd) + crossed(odd, even)
    }

    /// Thresholded least squares over all features at once; the threshold that the hold-out likes
    /// best, effects by how much they contribute.
    pub(super) fn thresholded(&self) -> Vec<&'static str> {
        let mut best: Option<(f64, Vec<usize>)> = None;
        for threshold in THRESHOLDS {
            let kept = self.sparse(threshold);
            let left = self.held_out(&kept);
            // thresholds rise, so that a later answer is the sparser one
            let before = best.as_ref().map_or(f64::INFINITY, |(before, _)| *before);
            if left <= before * (1.0 + CLEARLY) {
                best = Some((left.min(before), kept));
            }
        }
        let kept = best.map(|(_, kept)| kept).unwrap_or_default();
        self.by_contribution(&kept)
    }

    /// Usable features without those that the ones before make almost up for.
    fn unlike(&self) -> Vec<usize> {
        let mut kept: Vec<usize> = Vec::new();
        for f in self.usable() {
            let before: Vec<usize> =
                kept.iter().flat_map(|k| self.train_of[*k].iter().copied()).collect();
            let unlike = self.train_of[f].iter().all(|&c| {
                self.beside.apart(c, &before) > ALIKE * self.beside.between(&[c], &[1.0])
            });
            if unlike {
                kept.push(f);
            }
        }
        kept
    }

    /// Features that stay when those below a threshold are dropped and the rest fitted again.
    fn sparse(&self, threshold: f64) -> Vec<usize> {
        let least = threshold * self.beside.squares().sqrt();
        let mut kept = self.unlike();
        for _ in 0..ROUNDS {
            let before = kept.len();
            let sizes = self.sizes(&kept);
            let stays = |(f, sizes): (usize, Vec<f64>)| {
                let strength = self.beside.between(&self.train_of[f], &sizes).sqrt();
                (strength >= least && self.features[f].name(&sizes).is_some()).then_some(f)
            };
            kept = kept.into_iter().zip(sizes).filter_map(stays).collect();
            if kept.len() == before {
                break;
            }
        }
        kept
    }

    /// Sizes of features fitted together.
    fn sizes(&self, features: &[usize]) -> Vec<Vec<f64>> {
        let columns: Vec<usize> =
            features.iter().flat_map(|f| self.train_of[*f].iter().copied()).collect();
        let mut sizes = self.beside.solve(&columns).into_iter();
        let part = |f: &usize| sizes.by_ref().take(self.train_of[*f].len()).collect();
        features.iter().map(part).collect()
    }

    /// Effects of features by what they make together, the largest first.
    fn by_contribution(&self, features: &[usize]) -> Vec<&'static str> {
        let mut parts: BTreeMap<&'static str, (Vec<usize>, Vec<f64>)> = BTreeMap::new();
        for (f, sizes) in features.iter().zip(self.sizes(features)) {
            let Some(name) = self.features[*f].name(&sizes) else { continue };
            let part = parts.entry(name).or_default();
            part.0.extend(&self.train_of[*f]);
            part.1.extend(sizes);
        }
        let mut all: Vec<(f64, &'static str)> = parts
            .into_iter()
            .map(|(name, (columns, sizes))| (self.beside.between(&columns, &sizes), name))
            .collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.into_iter().map(|(_, name)| name).collect()
    }
}

/// Products of all columns over some of the rows, and which columns each feature has.
fn products(rows: &Rows, which: impl Fn(usize) -> bool) -> (Gram, Vec<Vec<usize>>) {
    let some = |column: &Vec<f64>| -> Vec<f64> {
        column.iter().enumerate().filter(|(n, _)| which(*n)).map(|(_, value)| *value).collect()
    };
    let mut columns: Vec<Vec<f64>> = rows.nuisance.iter().map(some).collect();
    let mut of = Vec::new();
    for feature in &rows.features {
        let first = columns.len();
        columns.extend(feature.iter().map(some));
        of.push((first..columns.len()).collect());
    }
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    (Gram::of(&columns, &some(&rows.residual)), of)
}
