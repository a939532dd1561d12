//! Signals of a recording, smoothed, and what follows from them in the nominal machine.

use core::f64::consts::{FRAC_PI_3, FRAC_PI_6, TAU};

use super::{
    nominal::Nominal,
    recorded::Recorded,
    smooth::{Smoother, bend, slope},
};

/// Corner of the zero-phase filter that all columns go through, Hz.
const CORNER_HZ: f64 = 100.0;
/// Corner of the one that the speed comes from.
const SPEED_CORNER_HZ: f64 = 300.0;
/// Samples of which one is kept: 200 Hz of 2 kHz, twice the corner.
const KEPT_OF: usize = 10;
/// Samples to either side in which the shaft must go the same way: what the speed's filter smears.
const SAME_WAY: usize = 6;
/// Share of the largest speed below which the shaft counts as at rest.
const REST_SHARE: f64 = 0.005;
/// Weight of a smoothed row below which it is left out.
const LEAST_WEIGHT: f64 = 0.3;
/// Samples left out at either end.
const ENDS: usize = 20;

/// A load behind a spring: its share of the inertia, its damping ratio, steps a sample.
const BEHIND_SHARE: f64 = 0.45;
const DAMPING: f64 = 0.05;
const SUBSTEPS: u32 = 16;

/// Signals at the rate of the recording.
#[derive(Clone, Debug)]
pub(super) struct Signals {
    pub(super) nominal: Nominal,
    pub(super) rate_hz: f64,
    pub(super) time_s: Vec<f64>,
    /// Motor angle, absolute, and the position of the surface (of a servo the same).
    pub(super) angle: Vec<f64>,
    pub(super) travel: Vec<f64>,
    pub(super) speed: Vec<f64>,
    /// Second differences of the position.
    pub(super) acceleration: Vec<f64>,
    pub(super) current: Vec<f64>,
    /// Known load at the motor's side of the gear.
    pub(super) load: Vec<f64>,
    /// 1 while the shaft moves one way, else 0.
    moves: Vec<f64>,
    smoother: Smoother,
    kept: Vec<usize>,
}

impl Signals {
    pub(super) fn of(recorded: &Recorded, nominal: Nominal) -> Self {
        let rate_hz = recorded.rate_hz;
        let smooth = Smoother::new(SPEED_CORNER_HZ, rate_hz).smooth(&recorded.angle_rad);
        let speed = slope(&smooth, rate_hz);
        let origin = if nominal.pole_pairs.is_some() { recorded.start_rad } else { 0.0 };
        let moves = moves(&speed);
        let half_tick = 0.5 * rate_hz / nominal.tick_hz;
        let smoother = Smoother::new(CORNER_HZ, rate_hz);
        let weight = smoother.smooth(&moves);
        Self {
            nominal,
            rate_hz,
            time_s: recorded.time_s.clone(),
            travel: recorded.angle_rad.iter().map(|a| (a - origin) / nominal.gear).collect(),
            acceleration: bend(&recorded.angle_rad, rate_hz),
            angle: recorded.angle_rad.clone(),
            speed,
            current: centred(&recorded.current_a, half_tick),
            load: held(&recorded.load_n_m, half_tick).iter().map(|l| l / nominal.gear).collect(),
            kept: (0..weight.len())
                .step_by(KEPT_OF)
                .filter(|&n| weight[n] > LEAST_WEIGHT)
                .collect(),
            moves,
            smoother,
        }
    }

    /// Rows of a column that follows from position and load at a sample: as wide as the second
    /// difference of the position that it is compared with.
    pub(super) fn rows(&self, column: &[f64]) -> Vec<f64> {
        let at = |n: usize| column[n.min(column.len() - 1)];
        let wide =
            self.map(|n| column[n] + (at(n.saturating_sub(1)) - 2.0 * at(n) + at(n + 1)) / 12.0);
        self.rows_of_wide(&wide)
    }

    /// Rows of a column that is as wide already: without standstill, smoothed, one of ten.
    pub(super) fn rows_of_wide(&self, column: &[f64]) -> Vec<f64> {
        // what is left out is zero in all columns before the filter, so that none of it leaks
        let moving = self.map(|n| self.moves[n] * column[n]);
        let smooth = self.smoother.smooth(&moving);
        self.kept.iter().map(|&n| smooth[n]).collect()
    }

    /// Times of the rows.
    pub(super) fn row_times(&self) -> Vec<f64> {
        self.kept.iter().map(|&n| self.time_s[n]).collect()
    }

    /// A value at every sample.
    pub(super) fn map(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.angle.len()).map(value).collect()
    }

    /// Where the motor pushes the load, with a play of so many times the nominal one: ±1 by the
    /// flank, 0 within the play, and the share of the sample in which a flank is met.
    pub(super) fn contact(&self, play: f64) -> Vec<f64> {
        let half = 0.5 * play * self.nominal.play_rad;
        let (mut shaft, mut off) = (self.angle[0], 0.0_f64);
        let mut all: Vec<f64> = Vec::with_capacity(self.angle.len());
        for &angle in &self.angle {
            let (reached, before) = (angle - shaft, off);
            shaft = shaft.clamp(angle - half, angle + half);
            off = angle - shaft;
            let flank = if off.abs() < half * (1.0 - 1e-9) { 0.0 } else { off.signum() };
            all.push(flank);
            let now = all.len() - 1;
            if flank != 0.0 && now > 0 && all[now - 1] == 0.0 && reached != before {
                // met after this share of the time since the sample before; a sample reaches half
                // a period to either side
                let met = (half - flank * before) / (reached - before).abs();
                all[now] = flank * (1.5 - met).min(1.0);
                all[now - 1] = flank * (0.5 - met).max(0.0);
            }
        }
        all
    }

    fn map_in_turn(&self, mut value: impl FnMut(usize) -> f64) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.angle.len());
        for n in 0..self.angle.len() {
            all.push(value(n));
        }
        all
    }

    /// Torque of the known load on the motor through the gear, where a flank touches.
    pub(super) fn felt(&self, contact: &[f64]) -> Vec<f64> {
        let share = self.nominal.efficiency;
        self.map(|n| {
            let against = contact[n] * self.load[n] > 0.0;
            contact[n].abs() * if against { self.load[n] / share } else { self.load[n] * share }
        })
    }

    /// Deflection of a bristle over its most, after Dahl, for presliding.
    pub(super) fn bristle(&self, most_rad: f64) -> Vec<f64> {
        let (mut state, mut last) = (0.0_f64, self.angle[0]);
        self.map_in_turn(|n| {
            let turn = self.angle[n] - last;
            last = self.angle[n];
            // exact over a turn in one direction
            let end = turn.signum();
            state = end + (state - end) * (-turn.abs() / most_rad).exp();
            state
        })
    }

    /// Torque of a load behind a spring on the motor less that of a stiff one, driven by the
    /// measured position; the load swings at a frequency while the motor is held.
    pub(super) fn swinging(&self, hz: f64) -> Vec<f64> {
        let inertia = BEHIND_SHARE * self.nominal.inertia_kg_m2;
        let turn = TAU * hz;
        let (stiffness, damping) = (inertia * turn * turn, 2.0 * DAMPING * inertia * turn);
        let step_s = 1.0 / (self.rate_hz * f64::from(SUBSTEPS));
        let (mut at, mut speed) = (self.angle[0], 0.0);
        self.map_in_turn(|n| {
            let before = self.angle[n.saturating_sub(1)];
            let rise = self.angle[n] - before;
            let mut passed = 0.0;
            for m in 1..=SUBSTEPS {
                let motor = before + rise * f64::from(m) / f64::from(SUBSTEPS);
                passed = stiffness * (motor - at) + damping * (rise * self.rate_hz - speed);
                speed += step_s * (passed - self.load[n]) / inertia;
                at += step_s * speed;
            }
            passed - inertia * self.acceleration[n] - self.load[n]
        })
    }

    /// Sector of the commutation, with the marks off by so much, and the electrical angle.
    pub(super) fn sector(&self, n: usize, lead: f64) -> Option<(usize, f64)> {
        let electrical = self.angle[n] * self.nominal.pole_pairs?;
        let place = ((electrical + lead - FRAC_PI_6) / FRAC_PI_3).floor();
        Some((place.rem_euclid(6.0) as usize, electrical))
    }
}

/// A current that was held over the tick before its sample, at the sample: later by a share of a
/// sample.
fn centred(current: &[f64], share: f64) -> Vec<f64> {
    let next = |n: usize| current[(n + 1).min(current.len() - 1)];
    (0..current.len()).map(|n| current[n] + share * (next(n) - current[n])).collect()
}

/// A load that is taken at a tick and held over it, at the sample: earlier by a share of a sample.
fn held(load: &[f64], share: f64) -> Vec<f64> {
    (0..load.len()).map(|n| load[n] + share * (load[n.saturating_sub(1)] - load[n])).collect()
}

/// Phases that conduct in a sector.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1)];

/// 1 where the shaft moves one way for as long as the filter of the speed reaches, else 0.
fn moves(speed: &[f64]) -> Vec<f64> {
    let fastest = speed.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
    let least = REST_SHARE * fastest;
    let one_way = |n: usize| {
        if n < ENDS || n + ENDS >= speed.len() {
            return false;
        }
        let near = &speed[n - SAME_WAY..=n + SAME_WAY];
        near.iter().all(|&w| w > least) || near.iter().all(|&w| w < -least)
    };
    (0..speed.len()).map(|n| f64::from(u8::from(one_way(n)))).collect()
}
