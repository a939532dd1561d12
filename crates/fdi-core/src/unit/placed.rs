//! A recording that is diagnosed, placed among those of its unit.

use crate::{
    online::run::Run,
    unit::{
        evidence::Evidence,
        joint::{Joint, OfTest, OfUnit, Wear},
        learnt_unit::{Earlier, Learnt, LearntUnit},
        quantities::Quantities,
    },
};

/// A recording with those of its unit.
#[derive(Clone, Debug)]
pub(crate) struct Placed<'a> {
    /// Recordings that the unit was learnt from.
    pub(crate) others: Vec<OfUnit<'a>>,
    /// The recording, in a state of health of its own.
    pub(crate) own: OfUnit<'a>,
    /// Wear of the recording where parts wear alike each session, and its place among those that are
    /// not as new; `None` without a unit.
    pub(crate) worn: Option<(Wear, usize)>,
}

impl Run<'_> {
    /// Evidence of the recording beside that of a unit's.
    pub(crate) fn placed<'a>(
        &'a self,
        unit: Option<&'a LearntUnit>,
        quantities: &'a Quantities,
        evidence: &'a Evidence,
    ) -> Placed<'a> {
        let session = self.observation.session.as_deref();
        let test = OfTest::only(quantities);
        let earlier = unit.map(|unit| Earlier::of(&[Learnt { unit, test }], &[session]));
        let own = OfUnit {
            evidence,
            test,
            session: earlier.as_ref().map_or(0, |earlier| earlier.sessions[0]),
            wear: Wear::AsNew,
            replaced: unit.map(|unit| unit.replaced).unwrap_or_default(),
        };
        let worn = earlier.as_ref().map(|earlier| (earlier.worn, earlier.nth));
        Placed { others: earlier.map(|earlier| earlier.others).unwrap_or_default(), own, worn }
    }
}

impl<'a> Placed<'a> {
    /// The recordings together, the search from a point of the unknowns.
    pub(crate) fn joint(&self, start: &[f64]) -> Option<Joint<'a>> {
        Joint::new(&self.others, &[self.own], start)
    }
}
