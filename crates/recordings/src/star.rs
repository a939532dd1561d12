//! The third current of a star, of which two are recorded.

use crate::{Channel, ChannelName, Recording};

const PHASES: [ChannelName; 3] =
    [ChannelName::PhaseACurrent, ChannelName::PhaseBCurrent, ChannelName::PhaseCCurrent];

impl Recording {
    /// Computes the current of a phase that is not recorded where the two others are, on the same
    /// times, and no envelope is.
    ///
    /// ```text
    /// i_a + i_b + i_c = 0
    /// ```
    ///
    /// # Valid for
    /// Windings without a neutral conductor: stars, and the line currents of deltas.
    pub(crate) fn complete_star(&mut self) {
        let recorded = PHASES.map(|name| self.channel(name));
        let missing = PHASES.into_iter().zip(&recorded).filter(|(_, channel)| channel.is_none());
        let missing: Vec<ChannelName> = missing.map(|(name, _)| name).collect();
        let mut there = recorded.iter().flatten();
        let (&[missing], Some(one), Some(two)) = (missing.as_slice(), there.next(), there.next())
        else {
            return;
        };
        if self.channel(ChannelName::Current).is_some() || one.times_s() != two.times_s() {
            return;
        }
        let computed = Channel::third_of_star(missing, one, two);
        self.channels.push(computed);
        self.computed_phase = Some(missing);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ColumnMap;

    fn parse(text: &str) -> Recording {
        Recording::parse("r.csv", text.as_bytes(), &ColumnMap::default()).unwrap()
    }

    #[test]
    fn the_currents_of_a_star_sum_to_nothing() {
        let two = parse("time_s,phase_a_current_a,phase_c_current_a\n0,1,2\n1,-3,1\n");
        assert_eq!(two.computed_phase(), Some(ChannelName::PhaseBCurrent));
        let computed = two.channel(ChannelName::PhaseBCurrent).unwrap();
        assert_eq!((computed.values(), computed.times_s()), (&[-3.0, 2.0][..], &[0.0, 1.0][..]));
    }

    #[test]
    fn nothing_is_computed_where_it_is_not_asked_for() {
        for text in [
            "time_s,phase_a_current_a\n0,1\n",
            "time_s,phase_a_current_a,phase_b_current_a,current_a\n0,1,2,3\n",
            "time_s,phase_a_current_a,phase_b_current_a\n0,1,\n1,,2\n",
        ] {
            assert_eq!(parse(text).computed_phase(), None, "{text}");
        }
    }
}
