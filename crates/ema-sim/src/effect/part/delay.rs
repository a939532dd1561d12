//! Set-points on their way from the controller to the drive.

use std::collections::VecDeque;

use libm::floor;

/// A set-point, and the share of a tick for which it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldReference {
    pub(crate) value: f64,
    pub(crate) share: f64,
}

impl HeldReference {
    /// Set-points of a tick without delay: one for all of it.
    #[inline]
    pub(crate) fn undelayed(value: f64) -> [Self; 2] {
        [Self { value, share: 1.0 }, Self { value, share: 0.0 }]
    }
}

/// Set-points on their way.
#[derive(Clone, Debug)]
pub(crate) struct Delay {
    ticks: usize,
    /// Part of a tick for which the older of two acts.
    share: f64,
    queue: VecDeque<f64>,
}

impl Delay {
    /// A delay, in a controller with a tick; set-points before the start are zero.
    pub(crate) fn new(delay_s: f64, tick_s: f64) -> Self {
        let ticks = delay_s / tick_s;
        let whole = floor(ticks);
        let queue = VecDeque::from(vec![0.0; whole as usize + 1]);
        Self { ticks: whole as usize, share: ticks - whole, queue }
    }

    /// Set-points to hold in the tick in which another is asked for.
    pub(crate) fn pass(&mut self, reference: f64) -> [HeldReference; 2] {
        self.queue.push_back(reference);
        let older = self.queue[self.queue.len() - 2 - self.ticks];
        let newer = self.queue[self.queue.len() - 1 - self.ticks];
        while self.queue.len() > self.ticks + 1 {
            self.queue.pop_front();
        }
        [
            HeldReference { value: older, share: self.share },
            HeldReference { value: newer, share: 1.0 - self.share },
        ]
    }
}
