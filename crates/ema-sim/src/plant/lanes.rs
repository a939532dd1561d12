//! Runs of one test on several machines side by side, a lane each.
//!
//! A tick in which nothing happens is the same arithmetic for each lane, written once more for
//! arrays, so that the compiler takes several lanes at a time. A lane in which something happens
//! (commutation, standstill, contact, a stop, the supply's limit) is finished by its own [`Run`].
//! Operations and their order are those of the run, and nothing is fused: both give the same bits
//! at any vector width.
#![expect(
    clippy::inline_always,
    reason = "the loop is compiled once for each instruction set, which inlining makes possible"
)]
#![expect(
    clippy::needless_bitwise_bool,
    reason = "a branch would keep the loop from being taken in vectors"
)]

use crate::{
    controller::{Law, Measured},
    drive_train::Direction,
    lane_sine,
    series::{value, value_from_zero},
    shape_function::{Near, ShapeFunction, Wave, turns_near},
    wide::Wide,
    winding::{LocalQuadratic, RotorAngle, Shaft, gap_of, times},
};

use super::{
    Motion, REFRESH_TICKS, Run,
    quadrature_loop::{Answer, LoopState, QuadratureLoop},
};

/// Most lanes that go together.
pub(crate) const WIDTH: usize = 16;
/// Lanes of a narrow run, for a few states of health.
pub(crate) const NARROW: usize = 4;

/// The state that a tick changes.
#[derive(Clone, Debug)]
struct Moving<const N: usize> {
    angle_rad: Wide<N>,
    speed_rad_per_s: Wide<N>,
    sin: Wide<N>,
    cos: Wide<N>,
    current_a: Wide<N>,
    /// By how much the current loop's integral is behind.
    behind_v: Wide<N>,
    integral_a: Wide<N>,
}

/// State that lasts from event to event.
#[derive(Clone, Debug)]
struct Lasting<const N: usize> {
    /// `surface = (follows·angle + offset)/i_g`.
    follows: Wide<N>,
    offset_rad: Wide<N>,
    /// Direction of the motion, 0 at rest.
    sign: Wide<N>,
    /// `1/J`; zero while the shaft rests.
    per_inertia: Wide<N>,
    external_n_m: Wide<N>,
    /// Motor angles between which nothing changes.
    low_rad: Wide<N>,
    high_rad: Wide<N>,
    /// Motor torques between which a shaft at rest stays; none for a moving one.
    least_n_m: Wide<N>,
    most_n_m: Wide<N>,
    /// `2·k_p·F_sc` and `2·R_p·F_sc` of the sector.
    constant: Wide<N>,
    resistance_ohm: Wide<N>,
    /// `F_sc` of a field-oriented drive: mean, and amplitudes of `cos 2θ_e` and `sin 2θ_e`.
    mean: Wide<N>,
    wave_cos: Wide<N>,
    wave_sin: Wide<N>,
    eccentricity_cos: Wide<N>,
    eccentricity_sin: Wide<N>,
}

/// Outcome of a tick.
#[derive(Clone, Debug)]
struct Outcome<const N: usize> {
    /// Set-points.
    reference_a: Wide<N>,
    current_a: Wide<N>,
    behind_v: Wide<N>,
    speed_rad_per_s: Wide<N>,
    turn_rad: Wide<N>,
    needed_v: Wide<N>,
    torque_n_m: Wide<N>,
    /// Sine and cosine of twice the electrical angle, and whether they are `libm`'s.
    wave_sin: Wide<N>,
    wave_cos: Wide<N>,
    exact: [u64; N],
    /// Lanes in which something happens: 1, else 0.
    event: [u64; N],
}

/// Numbers that all lanes share.
#[derive(Clone, Copy, Debug)]
struct Common {
    law: Law,
    per_inertia: [f64; 4],
    viscous_n_m_s_per_rad: f64,
    per_gear_ratio: f64,
    limit_v: f64,
    tick_s: f64,
    start_angle_rad: f64,
    /// Numbers of a field-oriented drive's shape function, and its loop.
    wave: Option<(Wave, QuadratureLoop)>,
}

/// Runs side by side.
#[derive(Clone, Debug)]
pub(crate) struct Lanes<const N: usize> {
    common: Common,
    moving: Moving<N>,
    /// The state before the tick, for the lanes in which something happens.
    before: Moving<N>,
    lasting: Lasting<N>,
    outcome: Outcome<N>,
    runs: [Run; N],
}

impl<const N: usize> Lanes<N> {
    /// Runs of one test side by side; `None` where a tick is more than the lanes can do.
    pub(crate) fn of(runs: [Run; N], law: Law, integral_a: f64, tick_s: f64) -> Option<Self> {
        let plain = |run: &Run| {
            run.extension.is_none()
                && run.load.is_none()
                && run.shape.as_ref().is_none_or(|shape| shape.wave().is_some())
                && !run.voltage_driven
        };
        if !runs.iter().all(plain) {
            return None;
        }
        let first = &runs[0];
        let waves = runs.each_ref().map(|run| run.shape.as_ref().and_then(ShapeFunction::wave));
        if first.quadrature_loop.is_some_and(|law| law.longest_s < tick_s) {
            return None;
        }
        let zero = [0.0; N];
        let moving = Moving {
            angle_rad: zero,
            speed_rad_per_s: zero,
            sin: zero,
            cos: zero,
            current_a: zero,
            behind_v: zero,
            integral_a: [integral_a; N],
        };
        let mut lanes = Self {
            common: Common {
                law,
                per_inertia: crate::series::RECIPROCALS.map(|r| r / first.train.inertia_kg_m2),
                viscous_n_m_s_per_rad: first.train.viscous_n_m_s_per_rad,
                per_gear_ratio: first.train.surface_line().2,
                limit_v: first.limit_v,
                tick_s,
                start_angle_rad: first.start_angle_rad,
                wave: waves[0].zip(first.quadrature_loop),
            },
            before: moving.clone(),
            moving,
            lasting: Lasting {
                follows: zero,
                offset_rad: zero,
                sign: zero,
                per_inertia: zero,
                external_n_m: zero,
                low_rad: zero,
                high_rad: zero,
                least_n_m: zero,
                most_n_m: zero,
                constant: zero,
                resistance_ohm: zero,
                mean: waves.map(|wave| wave.map_or(0.0, |wave| wave.mean)),
                wave_cos: waves.map(|wave| wave.map_or(0.0, |wave| wave.amplitude.0)),
                wave_sin: waves.map(|wave| wave.map_or(0.0, |wave| wave.amplitude.1)),
                eccentricity_cos: core::array::from_fn(|lane| runs[lane].winding.eccentricity()[0]),
                eccentricity_sin: core::array::from_fn(|lane| runs[lane].winding.eccentricity()[1]),
            },
            outcome: Outcome {
                reference_a: zero,
                current_a: zero,
                behind_v: zero,
                speed_rad_per_s: zero,
                turn_rad: zero,
                needed_v: zero,
                torque_n_m: zero,
                wave_sin: zero,
                wave_cos: zero,
                exact: [1; N],
                event: [0; N],
            },
            runs,
        };
        for lane in 0..N {
            lanes.take_over(lane);
        }
        Some(lanes)
    }

    /// Currents of the lanes now.
    #[inline(always)]
    pub(crate) fn current_a(&self) -> &Wide<N> {
        &self.moving.current_a
    }

    /// One tick of all lanes.
    #[inline(always)]
    pub(crate) fn tick(&mut self, tick: usize, command: f64) {
        if tick.is_multiple_of(REFRESH_TICKS) {
            self.refresh();
        }
        self.decide(command);
        if let Some((wave, law)) = self.common.wave {
            self.turn_waves(wave.rate);
            self.glide_regulated(&wave, &law);
        } else {
            self.glide();
        }
        self.arrive();
        if self.outcome.event.iter().fold(0, |any, event| any | event) != 0 {
            for lane in 0..N {
                if self.outcome.event[lane] != 0 {
                    self.finish(lane);
                }
            }
        }
    }

    /// Takes the sines afresh, as [`Run::begin_tick`] does.
    fn refresh(&mut self) {
        let moving = &mut self.moving;
        for (lane, run) in self.runs.iter().enumerate() {
            if run.winding.eccentric {
                let rotor = RotorAngle::new(run.start_angle_rad + moving.angle_rad[lane]);
                (moving.sin[lane], moving.cos[lane]) = (rotor.sin, rotor.cos);
            }
        }
    }

    /// The cascade's set-points.
    #[inline(always)]
    fn decide(&mut self, command: f64) {
        let Common { law, per_gear_ratio, .. } = self.common;
        let (moving, lasting) = (&mut self.moving, &self.lasting);
        for lane in 0..N {
            let angle_rad = moving.angle_rad[lane];
            let speed = moving.speed_rad_per_s[lane];
            let integral_a = moving.integral_a[lane];
            let measured = Measured {
                surface_rad: (angle_rad * lasting.follows[lane] + lasting.offset_rad[lane])
                    * per_gear_ratio,
                motor_rad: angle_rad,
                speed_rad_per_s: speed,
            };
            let error = law.error(command, law.held_rad(&measured), speed);
            let wanted_a = law.wanted_a(error, integral_a);
            let (reference_a, integral_a) = law.limited_a(wanted_a, error, integral_a);
            moving.integral_a[lane] = integral_a;
            self.outcome.reference_a[lane] = reference_a;
        }
    }

    /// Sine and cosine of twice the electrical angle.
    #[inline(always)]
    fn turn_waves(&mut self, rate: f64) {
        let start_rad = self.common.start_angle_rad;
        let (moving, outcome) = (&self.moving, &mut self.outcome);
        for lane in 0..N {
            let angle_rad = rate * (start_rad + moving.angle_rad[lane]);
            let (sin, cos, exact) = lane_sine::sincos(angle_rad);
            (outcome.wave_sin[lane], outcome.wave_cos[lane]) = (sin, cos);
            outcome.exact[lane] = u64::from(exact);
        }
        if outcome.exact.iter().fold(1, |all, exact| all & exact) == 0 {
            for lane in 0..N {
                if outcome.exact[lane] == 0 {
                    let angle_rad = rate * (start_rad + moving.angle_rad[lane]);
                    let (sin, cos) = libm::sincos(angle_rad);
                    (outcome.wave_sin[lane], outcome.wave_cos[lane]) = (sin, cos);
                }
            }
        }
    }

    /// Speed and turn at the end of the tick as if nothing happened in it, at the set-point.
    #[inline(always)]
    fn glide(&mut self) {
        let Common { per_inertia, viscous_n_m_s_per_rad, tick_s, .. } = self.common;
        let (moving, lasting, outcome) = (&self.moving, &self.lasting, &mut self.outcome);
        for lane in 0..N {
            let (reference_a, speed) = (outcome.reference_a[lane], moving.speed_rad_per_s[lane]);
            let gap = gap(moving, lasting, lane);
            let coupling = gap.map(|g| lasting.constant[lane] * g);
            let resistance_ohm = lasting.resistance_ohm[lane];
            // a shaft at rest has no inverse inertia, so that nothing moves
            let first = lasting.per_inertia[lane];
            let shaft = Shaft {
                per_inertia: [first, per_inertia[1], per_inertia[2], per_inertia[3]],
                external_n_m: lasting.external_n_m[lane],
                viscous_n_m_s_per_rad,
            };
            let motion = Motion::at_current(&shaft, &coupling, reference_a, speed);
            outcome.speed_rad_per_s[lane] = value(&motion.speed, tick_s);
            outcome.turn_rad[lane] = value_from_zero(&motion.turn, tick_s);
            outcome.needed_v[lane] = resistance_ohm * reference_a + coupling[0] * speed;
            outcome.torque_n_m[lane] = coupling[0] * reference_a;
            outcome.current_a[lane] = reference_a;
        }
    }

    /// Speed, turn and current at the end of the tick as if nothing happened in it, the current
    /// led by its loop.
    #[inline(always)]
    fn glide_regulated(&mut self, wave: &Wave, law: &QuadratureLoop) {
        let Common { per_inertia, viscous_n_m_s_per_rad, tick_s, .. } = self.common;
        let (moving, lasting, outcome) = (&self.moving, &self.lasting, &mut self.outcome);
        for lane in 0..N {
            let (reference_a, speed) = (outcome.reference_a[lane], moving.speed_rad_per_s[lane]);
            let shape = [lasting.mean[lane], lasting.wave_cos[lane], lasting.wave_sin[lane]];
            let (sin, cos) = (outcome.wave_sin[lane], outcome.wave_cos[lane]);
            let turns = turns_near(shape, wave.rate, sin, cos);
            let shape = turns.map(|f| wave.back_emf_v_s_per_rad * f);
            let near = Near { coupling: times(&shape, &gap(moving, lasting, lane)), turns };
            let rests = lasting.per_inertia[lane] == 0.0;
            let shaft = Shaft {
                per_inertia: per_inertia.map(|per| if rests { 0.0 } else { per }),
                external_n_m: lasting.external_n_m[lane],
                viscous_n_m_s_per_rad,
            };
            let now =
                LoopState { current_a: moving.current_a[lane], behind_v: moving.behind_v[lane] };
            let answer = law.answer(now, reference_a, &near, &shaft, speed);
            let Answer { current, .. } = &answer;
            let motion = Motion::at_series(&shaft, &near.coupling, current, speed, &law.fifth);
            outcome.speed_rad_per_s[lane] = value(&motion.speed, tick_s);
            outcome.turn_rad[lane] = value_from_zero(&motion.turn, tick_s);
            outcome.needed_v[lane] =
                wave.resistance_ohm * turns[0] * reference_a + near.coupling[0] * speed;
            // the torque at the end of the tick, unless that at its start is already too much
            let start_n_m = near.coupling[0] * now.current_a;
            let end_n_m = value(&answer.current.map(|a| near.coupling[0] * a), tick_s);
            let beyond =
                (start_n_m > lasting.most_n_m[lane]) | (start_n_m < lasting.least_n_m[lane]);
            outcome.torque_n_m[lane] = if beyond { start_n_m } else { end_n_m };
            let end = answer.at(tick_s);
            (outcome.current_a[lane], outcome.behind_v[lane]) = (end.current_a, end.behind_v);
        }
    }

    /// Takes the state at the end of the tick, and finds the lanes in which something happens.
    #[inline(always)]
    fn arrive(&mut self) {
        let Common { limit_v, tick_s, wave, .. } = self.common;
        // beyond this speed, less its rounding, the shape function's series wants segments shorter
        // than a tick: `ShapeFunction::longest_s`
        let most =
            wave.map_or(f64::INFINITY, |(wave, _)| 0.1 / (wave.rate * tick_s) * (1.0 - 1e-12));
        let (moving, lasting, outcome) = (&mut self.moving, &self.lasting, &mut self.outcome);
        let before = &mut self.before;
        for lane in 0..N {
            let (speed, turn_rad) = (outcome.speed_rad_per_s[lane], outcome.turn_rad[lane]);
            let angle_rad = moving.angle_rad[lane];
            let to_rad = angle_rad + turn_rad;
            let torque_n_m = outcome.torque_n_m[lane];
            let goes = (speed * lasting.sign[lane] > 0.0)
                & (to_rad <= lasting.high_rad[lane])
                & (to_rad >= lasting.low_rad[lane]);
            let rests =
                (torque_n_m <= lasting.most_n_m[lane]) & (torque_n_m >= lasting.least_n_m[lane]);
            let whole = moving.speed_rad_per_s[lane].abs() < most;
            let passes = whole & (outcome.needed_v[lane].abs() <= limit_v) & (goes | rests);
            outcome.event[lane] = u64::from(!passes);
            let (sin, cos) = (moving.sin[lane], moving.cos[lane]);
            let mut rotor = RotorAngle { motor_rad: 0.0, sin, cos };
            rotor.turn(turn_rad);
            before.angle_rad[lane] = angle_rad;
            before.speed_rad_per_s[lane] = moving.speed_rad_per_s[lane];
            (before.sin[lane], before.cos[lane]) = (sin, cos);
            before.current_a[lane] = moving.current_a[lane];
            before.behind_v[lane] = moving.behind_v[lane];
            moving.angle_rad[lane] = to_rad;
            moving.speed_rad_per_s[lane] = speed;
            (moving.sin[lane], moving.cos[lane]) = (rotor.sin, rotor.cos);
            moving.current_a[lane] = outcome.current_a[lane];
            moving.behind_v[lane] = outcome.behind_v[lane];
        }
    }

    /// Takes the tick in a lane in which something happens.
    #[inline(never)]
    fn finish(&mut self, lane: usize) {
        let (run, moving) = (&mut self.runs[lane], &self.before);
        run.train.angle_rad = moving.angle_rad[lane];
        run.train.speed_rad_per_s = moving.speed_rad_per_s[lane];
        (run.rotor.sin, run.rotor.cos) = (moving.sin[lane], moving.cos[lane]);
        let (reference_a, tick_s) = (self.outcome.reference_a[lane], self.common.tick_s);
        if run.shape.is_some() {
            (run.current_a, run.behind_v) = (moving.current_a[lane], moving.behind_v[lane]);
            run.advance_regulated(reference_a, tick_s);
        } else {
            run.advance_plain(reference_a, tick_s);
        }
        self.take_over(lane);
    }

    /// Takes over the state of a lane's run.
    fn take_over(&mut self, lane: usize) {
        let (run, lasting) = (&self.runs[lane], &mut self.lasting);
        let moving = &mut self.moving;
        let train = &run.train;
        moving.angle_rad[lane] = train.angle_rad;
        moving.speed_rad_per_s[lane] = train.speed_rad_per_s;
        (moving.sin[lane], moving.cos[lane]) = (run.rotor.sin, run.rotor.cos);
        moving.current_a[lane] = run.current_a;
        moving.behind_v[lane] = run.behind_v;
        (lasting.follows[lane], lasting.offset_rad[lane], _) = train.surface_line();
        lasting.sign[lane] = train.direction.sign();
        lasting.per_inertia[lane] = run.shaft.per_inertia[0];
        lasting.external_n_m[lane] = run.shaft.external_n_m;
        (lasting.low_rad[lane], lasting.high_rad[lane]) = run.window_rad;
        (lasting.least_n_m[lane], lasting.most_n_m[lane]) = if train.direction == Direction::Stuck {
            train.breakaway_n_m()
        } else {
            (f64::INFINITY, f64::NEG_INFINITY)
        };
        let sector = run.sectors[run.sector.place()];
        (lasting.constant[lane], lasting.resistance_ohm[lane]) = sector;
    }
}

/// The air gap near a lane's rotor.
#[inline(always)]
fn gap<const N: usize>(moving: &Moving<N>, lasting: &Lasting<N>, lane: usize) -> LocalQuadratic {
    let rotor = RotorAngle { motor_rad: 0.0, sin: moving.sin[lane], cos: moving.cos[lane] };
    gap_of([lasting.eccentricity_cos[lane], lasting.eccentricity_sin[lane]], &rotor)
}
