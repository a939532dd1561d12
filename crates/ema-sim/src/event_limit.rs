//! A bound on the events of a span, so that every run ends.

/// How many events a span may still have before they are put off.
///
/// An event is handled at its instant. Two causes that undo each other (a contact that closes and
/// opens, a friction that holds and lets go) can follow each other at one instant for ever, or
/// ever faster towards one. After `most` events in a span each further one is handled no sooner
/// than a `most`-th of the span after the one before: the state has then gone a little past it,
/// and the span ends after at most twice as many.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EventLimit {
    events: u32,
    most: u32,
    least_s: f64,
}

impl EventLimit {
    /// For a span, and the events that it may have.
    #[inline]
    pub(crate) fn over(span_s: f64, most: u32) -> Self {
        Self { events: 0, most, least_s: span_s / f64::from(most) }
    }

    /// When to handle an event at `at_s` in a segment that ends at `end_s`.
    #[inline]
    pub(crate) fn put_off(&mut self, at_s: f64, end_s: f64) -> f64 {
        self.events += 1;
        if self.events <= self.most { at_s } else { at_s.max(self.least_s).min(end_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_at_one_instant_come_to_an_end() {
        let (mut event_limit, mut left_s, mut events) = (EventLimit::over(1.0, 64), 1.0, 0);
        while left_s > 0.0 {
            left_s -= event_limit.put_off(0.0, left_s);
            events += 1;
        }
        assert_eq!(events, 128);
    }

    #[test]
    fn what_happens_in_time_is_left_where_it_is() {
        let mut event_limit = EventLimit::over(1.0, 64);
        for n in 0..64 {
            let at_s = 1e-3 * f64::from(n);
            assert_eq!(event_limit.put_off(at_s, 1.0), at_s);
        }
    }
}
