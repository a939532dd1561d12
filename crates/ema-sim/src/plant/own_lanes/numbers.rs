//! Numbers of the lanes, by how long they last: for the whole run, from event to event, or for a
//! segment.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]

use crate::{
    drive_train::FrictionState,
    effect::part::Parts,
    plant::Run,
    wide::{Wide, of_each},
};

/// Numbers of a lane that no tick changes.
#[derive(Clone, Debug)]
pub(super) struct Fixed<const N: usize> {
    /// Longest segment, its longest turn, and the shortest segment.
    pub(super) longest_s: Wide<N>,
    pub(super) longest_rad: Wide<N>,
    pub(super) shortest_s: Wide<N>,
    pub(super) limit_v: Wide<N>,
    pub(super) most_speed: Wide<N>,
    pub(super) viscous_n_m_s_per_rad: Wide<N>,
    pub(super) start_angle_rad: Wide<N>,
    pub(super) start_position_rad: Wide<N>,
    pub(super) per_gear_ratio: Wide<N>,
    pub(super) eccentricity_cos: Wide<N>,
    pub(super) eccentricity_sin: Wide<N>,
    /// Errors of the current sensor in the loop: a set-point less the offset, over the gain, is the
    /// current.
    pub(super) offset_a: Wide<N>,
    pub(super) gain: Wide<N>,
}

/// State that lasts from event to event.
#[derive(Clone, Debug)]
pub(super) struct Lasting<const N: usize> {
    /// `surface = (follows·angle + offset)/i_g`.
    pub(super) follows: Wide<N>,
    pub(super) offset_rad: Wide<N>,
    /// Direction of the motion, 0 at rest.
    pub(super) sign: Wide<N>,
    /// `1/(m·J)`; zero while the shaft rests.
    pub(super) per_inertia: [Wide<N>; 4],
    pub(super) felt_load_n_m: Wide<N>,
    pub(super) carried_load_n_m: Wide<N>,
    /// Motor angles between which nothing changes.
    pub(super) low_rad: Wide<N>,
    pub(super) high_rad: Wide<N>,
    /// Torques that hold a shaft at rest beside its friction, backward and forward.
    pub(super) holding_n_m: [Wide<N>; 2],
    /// `2·k_p·F_sc` and `2·R_p·F_sc` of the sector.
    pub(super) constant: Wide<N>,
    pub(super) resistance_ohm: Wide<N>,
}

/// The state that a segment changes.
#[derive(Clone, Debug)]
pub(super) struct Moving<const N: usize> {
    pub(super) angle_rad: Wide<N>,
    pub(super) speed_rad_per_s: Wide<N>,
    pub(super) sin: Wide<N>,
    pub(super) cos: Wide<N>,
    pub(super) current_a: Wide<N>,
    pub(super) external_n_m: Wide<N>,
    pub(super) time_s: Wide<N>,
    pub(super) since_commutation_s: Wide<N>,
    /// Time for which the set-point is still held.
    pub(super) left_s: Wide<N>,
}

/// Dry friction of the two directions (backward, forward), and the torque against positive motion.
#[derive(Clone, Debug)]
#[expect(clippy::struct_field_names, reason = "the unit belongs to the name")]
pub(super) struct Friction<const N: usize> {
    pub(super) kinetic_n_m: [Wide<N>; 2],
    pub(super) static_n_m: [Wide<N>; 2],
    pub(super) against_n_m: Wide<N>,
}

impl<const N: usize> Fixed<N> {
    pub(super) fn of(runs: &[Run], tick_s: f64) -> Self {
        let of = |number: &dyn Fn(&Run) -> f64| of_each(runs, number);
        let parts = |run: &Run, of: &dyn Fn(&Parts) -> f64, plain: f64| {
            run.extension.as_ref().map_or(plain, |extension| of(extension.parts()))
        };
        let in_loop = |parts: &Parts| parts.current_sensor.filter(|sensor| sensor.in_loop);
        Self {
            longest_s: of(&|run| parts(run, &|p| p.longest_s, tick_s)),
            longest_rad: of(&|run| parts(run, &|p| p.longest_rad, f64::INFINITY)),
            shortest_s: of(&|run| run.extension.as_ref().map_or(0.0, |e| e.shortest_s())),
            limit_v: of(&|run| run.limit_v),
            most_speed: of(&|run| match run.extension {
                Some(_) => run.guard.most(),
                None => f64::INFINITY,
            }),
            viscous_n_m_s_per_rad: of(&|run| run.train.viscous_n_m_s_per_rad),
            start_angle_rad: of(&|run| run.start_angle_rad),
            start_position_rad: of(&|run| run.start_position_rad),
            per_gear_ratio: of(&|run| run.train.surface_line().2),
            eccentricity_cos: of(&|run| run.winding.eccentricity()[0]),
            eccentricity_sin: of(&|run| run.winding.eccentricity()[1]),
            offset_a: of(&|run| {
                parts(run, &|p| in_loop(p).map_or(0.0, |sensor| sensor.offset_a), 0.0)
            }),
            gain: of(&|run| {
                parts(run, &|p| in_loop(p).map_or(1.0, |s| 1.0 + s.gain_error_ratio), 1.0)
            }),
        }
    }
}

impl<const N: usize> Lasting<N> {
    pub(super) fn none() -> Self {
        let zero = [0.0; N];
        Self {
            follows: zero,
            offset_rad: zero,
            sign: zero,
            per_inertia: [zero; 4],
            felt_load_n_m: zero,
            carried_load_n_m: zero,
            low_rad: zero,
            high_rad: zero,
            holding_n_m: [zero; 2],
            constant: zero,
            resistance_ohm: zero,
        }
    }

    /// Takes over what lasts of a lane's run.
    pub(super) fn take_over(&mut self, lane: usize, run: &Run) {
        (self.follows[lane], self.offset_rad[lane], _) = run.train.surface_line();
        self.sign[lane] = run.train.direction.sign();
        for (wide, per_inertia) in self.per_inertia.iter_mut().zip(run.shaft.per_inertia) {
            wide[lane] = per_inertia;
        }
        (self.low_rad[lane], self.high_rad[lane]) = run.window_rad;
        let sector = run.sectors[run.sector.place()];
        (self.constant[lane], self.resistance_ohm[lane]) = sector;
        self.feel(lane, run);
    }

    /// Takes over the load that a lane's shaft feels.
    pub(super) fn feel(&mut self, lane: usize, run: &Run) {
        self.felt_load_n_m[lane] = run.train.felt_load_n_m();
        self.carried_load_n_m[lane] = run.train.carried_load_n_m();
        (self.holding_n_m[0][lane], self.holding_n_m[1][lane]) = run.train.holding_n_m();
    }
}

impl<const N: usize> Moving<N> {
    pub(super) fn none() -> Self {
        let zero = [0.0; N];
        Self {
            angle_rad: zero,
            speed_rad_per_s: zero,
            sin: zero,
            cos: zero,
            current_a: zero,
            external_n_m: zero,
            time_s: zero,
            since_commutation_s: zero,
            left_s: zero,
        }
    }

    /// Takes over what moves of a lane's run, at the end of a tick.
    pub(super) fn take_over(&mut self, lane: usize, run: &Run) {
        self.angle_rad[lane] = run.train.angle_rad;
        self.speed_rad_per_s[lane] = run.train.speed_rad_per_s;
        (self.sin[lane], self.cos[lane]) = (run.rotor.sin, run.rotor.cos);
        self.current_a[lane] = run.current_a;
        self.external_n_m[lane] = run.shaft.external_n_m;
        if let Some(extension) = &run.extension {
            self.time_s[lane] = extension.time_s();
            self.since_commutation_s[lane] = extension.since_commutation_s();
        }
        self.left_s[lane] = 0.0;
    }

    /// Gives a lane's run back what moves of it.
    pub(super) fn give_back(&self, lane: usize, run: &mut Run) {
        run.train.angle_rad = self.angle_rad[lane];
        run.train.speed_rad_per_s = self.speed_rad_per_s[lane];
        (run.rotor.sin, run.rotor.cos) = (self.sin[lane], self.cos[lane]);
        run.current_a = self.current_a[lane];
        run.shaft.external_n_m = self.external_n_m[lane];
        if let Some(extension) = &mut run.extension {
            extension.put_time(self.time_s[lane], self.since_commutation_s[lane]);
        }
    }
}

impl<const N: usize> Friction<N> {
    pub(super) fn none() -> Self {
        let zero = [0.0; N];
        Self { kinetic_n_m: [zero; 2], static_n_m: [zero; 2], against_n_m: zero }
    }

    /// Torque on a lane's moving shaft besides the motor's and the viscous one.
    #[inline(always)]
    pub(super) fn external_n_m(&self, lane: usize, lasting: &Lasting<N>) -> f64 {
        let sign = lasting.sign[lane];
        let [backward, forward] = [0, 1].map(|side: usize| self.kinetic_n_m[side][lane]);
        let kinetic_n_m = if sign >= 0.0 { forward } else { backward };
        -sign * kinetic_n_m - lasting.felt_load_n_m[lane] - self.against_n_m[lane]
    }

    /// The friction of a lane.
    #[inline(always)]
    pub(super) fn of(&self, lane: usize) -> FrictionState {
        let of = |sides: &[Wide<N>; 2]| [sides[0][lane], sides[1][lane]];
        FrictionState {
            kinetic_n_m: of(&self.kinetic_n_m),
            static_n_m: of(&self.static_n_m),
            against_n_m: self.against_n_m[lane],
        }
    }

    /// Takes over the friction of a lane.
    #[inline(always)]
    pub(super) fn put(&mut self, lane: usize, of: &FrictionState) {
        for side in 0..2 {
            self.kinetic_n_m[side][lane] = of.kinetic_n_m[side];
            self.static_n_m[side][lane] = of.static_n_m[side];
        }
        self.against_n_m[lane] = of.against_n_m;
    }
}
