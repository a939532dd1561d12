//! Values of a channel at the places of its clock, from samples beside them, with their error.

/// Gaps of up to so many places are bridged with a cubic, longer ones with a straight line.
const CUBIC_GAP: f64 = 2.5;
/// Least distance of two samples for a cubic through them, in places: nearer ones blow noise up.
const CUBIC_SPACING: f64 = 0.5;
/// Gaps that are opened and bridged again, to see by how much bridges miss.
const TRIAL_GAPS: usize = 200;

/// Values at the places of a clock.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OnClock {
    pub(crate) values: Vec<f64>,
    /// Root mean square error of the values that the kernel has made of others, over all values.
    pub(crate) error: f64,
}

/// How values between samples follow from them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Between {
    /// By the kernel.
    Kernel,
    /// As the last sample: states that do not lie between one another.
    Held,
}

/// Samples by their distance from place 0, in places.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes<'a> {
    /// Where the samples stand; strictly increasing.
    pub(crate) at: &'a [f64],
    /// Values of the samples.
    pub(crate) values: &'a [f64],
}

impl Nodes<'_> {
    /// Brings samples onto the places from 0 to `last`.
    ///
    /// ```text
    /// y(n) = Σ_j y_j·Π_{k≠j} (n − u_k)/(u_j − u_k)
    /// ```
    ///
    /// over the two samples on either side of `n` (cubic Lagrange), or the one on either side in
    /// gaps of three places and more and beside samples that stand closer than half a place.
    /// A sample on the place itself is taken as it is.
    ///
    /// # Error
    ///
    /// Jitter: samples predicted from their neighbours miss by `m`; the value at `n` by
    /// `m·Π|n − u_j|/Π|u_i − u_j|`, the ratio of the remainders of the two polynomials. Gaps: gaps
    /// of the same length are opened elsewhere and bridged. The misses of one bridge are of one
    /// sign, and a filter far below the sample rate adds them up, so that a bridge counts with the
    /// square of the sum of its misses, as one white error would.
    ///
    /// # Source
    ///
    /// Lagrange interpolation and its remainder: any textbook of numerical analysis.
    pub(crate) fn on_places(self, last: usize, between: Between) -> OnClock {
        let count = last + 1;
        if between == Between::Held {
            let held = |place: usize| {
                let after = self.at.partition_point(|&at| at <= place as f64 + 0.5);
                self.values[after.saturating_sub(1)]
            };
            return OnClock { values: (0..count).map(held).collect(), error: 0.0 };
        }
        self.by_kernel(last, &Misses::of(self))
    }

    /// The values alone, without what they miss.
    pub(crate) fn values_on_places(self, last: usize) -> Vec<f64> {
        self.by_kernel(last, &Misses::default()).values
    }

    fn by_kernel(self, last: usize, misses: &Misses) -> OnClock {
        let count = last + 1;
        let (mut values, mut squares) = (Vec::with_capacity(count), 0.0);
        let mut after = 0;
        for place in 0..count {
            let at = place as f64;
            while after < self.at.len() && self.at[after] <= at {
                after += 1;
            }
            let on = after.checked_sub(1).filter(|&before| self.at[before] == at);
            if let Some(on) = on {
                values.push(self.values[on]);
                continue;
            }
            let stencil = self.stencil(after);
            values.push(self.lagrange(stencil, at));
            squares += misses.square(self, stencil, after, at);
        }
        OnClock { values, error: (squares / count as f64).sqrt() }
    }

    /// Samples that a value before the sample `after` is made of: first and number.
    fn stencil(self, after: usize) -> (usize, usize) {
        let count = self.at.len();
        let wide = (after.saturating_sub(2).min(count.saturating_sub(4)), count.min(4));
        let nodes = &self.at[wide.0..wide.0 + wide.1];
        let is_spaced = nodes.windows(2).all(|pair| pair[1] - pair[0] >= CUBIC_SPACING);
        if wide.1 == 4 && is_spaced && self.gap(after) < 1.0 + CUBIC_GAP {
            return wide;
        }
        (after.saturating_sub(1).min(count.saturating_sub(2)), count.min(2))
    }

    /// Distance of the samples on either side, in places.
    fn gap(self, after: usize) -> f64 {
        let before = after.checked_sub(1).and_then(|before| self.at.get(before));
        match (before, self.at.get(after)) {
            (Some(before), Some(after)) => after - before,
            _ => 1.0,
        }
    }

    /// Places between the samples on either side, both left out.
    fn lacking(self, after: usize) -> usize {
        (self.gap(after).round() as usize).saturating_sub(1)
    }

    fn lagrange(self, (first, count): (usize, usize), at: f64) -> f64 {
        let nodes = &self.at[first..first + count];
        let weight = |j: usize| -> f64 {
            let factor = |(k, node): (usize, &f64)| {
                if k == j { 1.0 } else { (at - node) / (nodes[j] - node) }
            };
            nodes.iter().enumerate().map(factor).product()
        };
        (0..count).map(|j| weight(j) * self.values[first + j]).sum()
    }

    /// The product in the remainder of a polynomial through these samples.
    fn remainder(self, (first, count): (usize, usize), at: f64) -> f64 {
        self.at[first..first + count].iter().map(|node| (at - node).abs()).product()
    }

    /// Mean square of the misses of samples that are predicted from so many on either side, over that
    /// of the remainder's product, where none of those are nearer than half a place.
    fn left_out(self, reach: usize) -> f64 {
        let (mut squares, mut remainders) = (0.0, 0.0);
        for middle in reach..self.at.len().saturating_sub(reach) {
            let outside = |all: &[f64]| {
                [&all[middle - reach..middle], &all[middle + 1..=middle + reach]].concat()
            };
            let (at, values) = (outside(self.at), outside(self.values));
            let (others, all) = (Nodes { at: &at, values: &values }, (0, 2 * reach));
            if at.windows(2).any(|pair| pair[1] - pair[0] < CUBIC_SPACING) {
                continue;
            }
            let miss = others.lagrange(all, self.at[middle]) - self.values[middle];
            squares += miss.powi(2);
            remainders += others.remainder(all, self.at[middle]).powi(2);
        }
        if remainders == 0.0 { 0.0 } else { squares / remainders }
    }

    /// Mean square of the summed misses of bridges over gaps of so many places, opened in steps
    /// through the samples, for each place.
    fn opened(self, lacking: usize) -> f64 {
        let count = self.at.len();
        let needed = lacking + 4;
        if count < needed {
            return 0.0;
        }
        let step = ((count - needed) / TRIAL_GAPS).max(1);
        let (mut squares, mut tried) = (0.0, 0);
        for first in (0..=count - needed).step_by(step) {
            let nodes = &self.at[first..first + needed];
            if nodes[needed - 1] - nodes[0] > needed as f64 {
                continue;
            }
            let outside = |all: &[f64]| [&all[..2], &all[2 + lacking..]].concat();
            let (at, values) = (outside(nodes), outside(&self.values[first..first + needed]));
            let opened = Nodes { at: &at, values: &values };
            let miss = |index: usize| {
                opened.lagrange(opened.stencil(2), self.at[index]) - self.values[index]
            };
            squares += (first + 2..first + 2 + lacking).map(miss).sum::<f64>().powi(2);
            tried += 1;
        }
        if tried == 0 { 0.0 } else { squares / (f64::from(tried) * lacking as f64) }
    }
}

/// By how much samples miss what their neighbours predict; nothing, where it was not looked at.
#[derive(Default)]
struct Misses {
    /// Mean squares over that of the remainder's product, of a cubic and of a straight line.
    per_remainder2: [f64; 2],
    /// Mean squares in gaps of each length that there is, by the number of lacking places.
    gaps: Vec<(usize, f64)>,
}

impl Misses {
    fn of(nodes: Nodes<'_>) -> Self {
        // only jittered samples stand beside their places
        let is_jittered = nodes.at.iter().any(|at| at.fract() != 0.0);
        let reach = |reach: usize| if is_jittered { nodes.left_out(reach) } else { 0.0 };
        let mut lengths: Vec<usize> =
            (1..nodes.at.len()).map(|after| nodes.lacking(after)).collect();
        lengths.sort_unstable();
        lengths.dedup();
        let lengths = lengths.into_iter().filter(|length| *length > 0);
        Self {
            per_remainder2: [reach(2), reach(1)],
            gaps: lengths.map(|length| (length, nodes.opened(length))).collect(),
        }
    }

    /// Mean square error of a value that was made of others.
    fn square(&self, nodes: Nodes<'_>, stencil: (usize, usize), after: usize, at: f64) -> f64 {
        let lacking = nodes.lacking(after);
        if lacking == 0 {
            let per_remainder2 = self.per_remainder2[usize::from(stencil.1 < 4)];
            return per_remainder2 * nodes.remainder(stencil, at).powi(2);
        }
        let of_length = self.gaps.iter().find(|(length, _)| *length == lacking);
        of_length.map_or(0.0, |(_, square)| *square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubic(at: f64) -> f64 {
        1.0 + at - 0.2 * at * at + 0.01 * at * at * at
    }

    #[test]
    fn a_cubic_is_met_on_and_beside_its_places() {
        let at: Vec<f64> = (0..20).map(|n| f64::from(n) + 0.1 * f64::from(n % 3 - 1)).collect();
        let values: Vec<f64> = at.iter().map(|&at| cubic(at)).collect();
        let on = Nodes { at: &at, values: &values }.on_places(19, Between::Kernel);
        for (place, value) in on.values.iter().enumerate() {
            approx::assert_abs_diff_eq!(*value, cubic(place as f64), epsilon = 1e-9);
        }
        assert!(on.error < 1e-9, "{}", on.error);
    }

    #[test]
    fn samples_on_their_places_are_taken_as_they_are() {
        let at = [0.0, 1.0, 2.0, 4.0, 5.0, 6.0];
        let values: Vec<f64> = at.iter().map(|&at| cubic(at)).collect();
        let on = Nodes { at: &at, values: &values }.on_places(6, Between::Kernel);
        assert_eq!([on.values[2], on.values[4]], [cubic(2.0), cubic(4.0)]);
        approx::assert_abs_diff_eq!(on.values[3], cubic(3.0), epsilon = 1e-12);
    }

    #[test]
    fn states_are_held() {
        let nodes = Nodes { at: &[0.0, 1.0, 4.0], values: &[1.0, 2.0, 5.0] };
        assert_eq!(nodes.on_places(4, Between::Held).values, [1.0, 2.0, 2.0, 2.0, 5.0]);
    }

    /// The error that is told of a bridge in noise of one unit: what is lost is missed by noise and
    /// by that of the four that the bridge stands on, whose weights are -1/6, 2/3, 2/3 and -1/6.
    #[test]
    fn the_error_of_a_bridge_is_that_of_noise() {
        let noise = |n: usize| {
            let uniform = |k: usize| ((n * 12 + k) as f64 * 12.9898).sin() * 43_758.545_3;
            (0..12).map(|k| uniform(k).rem_euclid(1.0)).sum::<f64>() - 6.0
        };
        let at: Vec<f64> = (0..4000).filter(|n| n % 100 != 50).map(f64::from).collect();
        let values: Vec<f64> = at.iter().map(|&at| noise(at as usize)).collect();
        let on = Nodes { at: &at, values: &values }.on_places(3999, Between::Kernel);
        let per_bridge = on.error * 10.0;
        let expected = (1.0 + 34.0 / 36.0f64).sqrt();
        // 200 trials: 5 % standard deviation
        assert!((per_bridge / expected - 1.0).abs() < 0.2, "{per_bridge} {expected}");
    }
}
