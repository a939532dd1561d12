//! The three-phase winding between switching instants, with the shaft it drives.
//!
//! ```text
//! L_j·i_j' = v_j − v_n − R_j·i_j − k_j·ω       v_n from Σ i_j = 0, over the connected phases
//! J·ω'     = Σ k_j·i_j + T_ext − c·ω
//! k_j(θ_m) = k_p·N_j·f(P·θ_m − 120°·j)·(1 + ζ·cos(θ_m + φ))
//! ```
//!
//! Torque and back-EMF share one `k_j`, so that what the winding loses the shaft gains. Between
//! two events every right-hand side is smooth, and a Taylor series to the fourth order in time
//! solves it: with the segments of a 20 kHz carrier the first term left out is below 1e-7 of the
//! change in a segment. Phases are named by their role in the sector: positive, negative, idle.
//!
//! # Source
//!
//! Phase equations and trapezoid: NASA ProgPy, `progpy/models/dcmotor.py`; turns and eccentricity:
//! see `docs/models/motor.md`.

use core::f64::consts::{FRAC_PI_3, TAU};

use crate::{
    back_emf::Spline,
    fault::PhysicalFaults,
    field_oriented::PhaseAngles,
    params::{BackEmfShape, Motor},
    phase::{PerPhase, Sector},
    series::{RECIPROCALS, Series, value},
    waveform::Waveform,
};

/// A quantity near an angle, `c_0 + c_1·δ + c_2·δ²` for a turn by δ of the rotor.
///
/// The rotor turns by milliradians in a segment; the cubic term would change a current by less
/// than 1e-8 A.
pub(crate) type LocalQuadratic = [f64; 3];

/// A [`LocalQuadratic`] with its cubic term.
pub(crate) type LocalCubic = [f64; 4];

/// Shape of the back-EMF, ready to be evaluated.
#[derive(Clone, Debug)]
enum Shape {
    Trapezoid,
    Sinusoid,
    Tabulated(Spline),
    /// A trapezoid that effects have reshaped, near an electrical angle between its corners.
    Waved(Waveform, f64),
}

impl Shape {
    fn new(shape: &BackEmfShape) -> Self {
        match shape {
            BackEmfShape::Trapezoid => Self::Trapezoid,
            BackEmfShape::Sinusoid => Self::Sinusoid,
            BackEmfShape::Tabulated(table) => Self::Tabulated(table.spline()),
        }
    }
}

/// Electrical constants of a motor with its faults.
#[derive(Clone, Debug)]
pub(crate) struct Winding {
    sectors: [SectorWinding; 6],
    shape: Shape,
    pole_pairs: f64,
    /// Sectors a radian of the rotor.
    sectors_per_rad: f64,
    eccentricity_cos: f64,
    eccentricity_sin: f64,
    /// True where the air gap changes with the angle.
    pub(crate) eccentric: bool,
}

/// Numbers that a sector fixes.
///
/// With `x` the current of the positive and `y` that of the idle phase, the negative one carries
/// `−(x + y)`, and two loops through it describe the star:
///
/// ```text
/// C⁻¹·(x', y') = u − R·(x, y) − (a, b)·ω      a = k_pos − k_neg,  b = k_idle − k_neg
/// T_m = a·x + b·y
/// ```
#[derive(Clone, Copy, Debug)]
pub(crate) struct SectorWinding {
    pub(crate) positive: usize,
    pub(crate) negative: usize,
    pub(crate) idle: usize,
    /// Resistance of the pair, of the negative phase (shared by both loops), of the idle loop.
    pair_ohm: f64,
    negative_ohm: f64,
    idle_ohm: f64,
    /// `1/(m·L)` of the conducting pair, for coefficient m = 1 to 4.
    pair_per_henry: [f64; 4],
    /// Inverse of the two loops' inductances, `C`: diagonal of the pair, off it, of the idle.
    per_henry: (f64, f64, f64),
    /// Weight of the positive phase in the star point's potential while the idle one is open.
    star_share: f64,
    /// Peaks of `a` and of the negative and the idle phase's `k`.
    pair_peak: f64,
    negative_peak: f64,
    idle_peak: f64,
    /// +1 when the idle flank falls with the angle, −1 when it rises.
    flank: f64,
}

/// How the rotor stands: its absolute angle with sine and cosine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotorAngle {
    pub(crate) motor_rad: f64,
    pub(crate) sin: f64,
    pub(crate) cos: f64,
}

impl RotorAngle {
    /// The rotor at an absolute angle.
    pub(crate) fn new(motor_rad: f64) -> Self {
        let (sin, cos) = libm::sincos(motor_rad);
        Self { motor_rad, sin, cos }
    }

    /// Turns by a small angle, below a tenth of a radian.
    #[inline]
    pub(crate) fn turn(&mut self, by_rad: f64) {
        let q = by_rad * by_rad;
        let s = by_rad * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0)));
        let c = 1.0 - q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0)));
        let (sin, cos) = (self.sin, self.cos);
        self.sin = sin * c + cos * s;
        self.cos = cos * c - sin * s;
        self.motor_rad += by_rad;
    }
}

/// The air gap's modulation about a motor angle, good for a turn of a tenth of a radian.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirGap {
    centre_rad: f64,
    series: Series,
}

impl AirGap {
    /// The modulation near an angle.
    #[inline]
    fn near(&self, motor_rad: f64) -> LocalQuadratic {
        let (d, c) = (motor_rad - self.centre_rad, &self.series);
        [value(c, d), c[1] + d * (2.0 * c[2] + 3.0 * c[3] * d), c[2] + 3.0 * c[3] * d]
    }
}

impl SectorWinding {
    /// The winding of a sector at another temperature.
    pub(crate) fn warmed(mut self, ratio: f64) -> Self {
        self.pair_ohm *= ratio;
        self.negative_ohm *= ratio;
        self.idle_ohm *= ratio;
        self
    }

    /// The next coefficient of the loops' currents, from the last one and what drives it; of an
    /// open idle phase zero.
    pub(crate) fn loop_rates(
        &self,
        driven: LoopVolts,
        [x, y]: [f64; 2],
        m: usize,
        open: bool,
    ) -> (f64, f64) {
        let (u, v) = (driven.pair_v, driven.idle_v);
        let u = u - self.pair_ohm * x - self.negative_ohm * y;
        if open {
            return (u * self.pair_per_henry[m], 0.0);
        }
        let v = v - self.negative_ohm * x - self.idle_ohm * y;
        let (cx, cxy, cy) = self.per_henry;
        ((cx * u + cxy * v) * RECIPROCALS[m], (cxy * u + cy * v) * RECIPROCALS[m])
    }

    /// Heat of the currents of the positive and the idle phase, `Σ R_j·i_j²`.
    pub(crate) fn copper_w(&self, positive_a: f64, idle_a: f64) -> f64 {
        let negative_a = positive_a + idle_a;
        (self.pair_ohm - self.negative_ohm) * positive_a * positive_a
            + self.negative_ohm * negative_a * negative_a
            + (self.idle_ohm - self.negative_ohm) * idle_a * idle_a
    }

    fn new(place: usize, resistance: &PerPhase, inductance: &PerPhase, peak: &PerPhase) -> Self {
        let sector = Sector::from_place(place);
        let (positive, negative, idle) =
            (sector.positive_phase(), sector.negative_phase(), sector.idle_phase());
        let [lp, ln, lx] = [positive, negative, idle].map(|phase| inductance[phase]);
        let determinant = lp * ln + lp * lx + ln * lx;
        Self {
            positive,
            negative,
            idle,
            pair_ohm: resistance[positive] + resistance[negative],
            negative_ohm: resistance[negative],
            idle_ohm: resistance[idle] + resistance[negative],
            pair_per_henry: RECIPROCALS.map(|r| r / (lp + ln)),
            per_henry: ((lx + ln) / determinant, -ln / determinant, (lp + ln) / determinant),
            star_share: ln / (lp + ln),
            pair_peak: peak[positive] + peak[negative],
            negative_peak: -peak[negative],
            idle_peak: peak[idle],
            flank: if place.is_multiple_of(2) { 1.0 } else { -1.0 },
        }
    }
}

impl Winding {
    /// A winding: with `N_j` of the turns left, `R ∝ N`, `L ∝ N²`, `k ∝ N`.
    pub(crate) fn new(motor: &Motor, faults: &PhysicalFaults) -> Self {
        let turns = faults.healthy_turns_frac;
        let resistance = turns.map(|n| motor.resistance_ohm * n);
        let inductance = turns.map(|n| motor.inductance_henry * n * n);
        let peak = turns.map(|n| motor.back_emf_v_s_per_rad * n);
        let pole_pairs = f64::from(motor.pole_pairs);
        let centred = faults.eccentricity_cos == 0.0 && faults.eccentricity_sin == 0.0;
        Self {
            sectors: core::array::from_fn(|place| {
                SectorWinding::new(place, &resistance, &inductance, &peak)
            }),
            shape: Shape::new(&motor.back_emf_shape),
            pole_pairs,
            sectors_per_rad: pole_pairs / FRAC_PI_3,
            eccentricity_cos: faults.eccentricity_cos,
            eccentricity_sin: faults.eccentricity_sin,
            eccentric: !centred,
        }
    }

    /// No winding at all: a coupling that does not change with the angle.
    pub(crate) fn plain() -> Self {
        let one = [1.0; 3];
        Self {
            sectors: core::array::from_fn(|place| SectorWinding::new(place, &one, &one, &one)),
            shape: Shape::Trapezoid,
            pole_pairs: 1.0,
            sectors_per_rad: 1.0 / FRAC_PI_3,
            eccentricity_cos: 0.0,
            eccentricity_sin: 0.0,
            eccentric: false,
        }
    }

    /// True where the back-EMF is a trapezoid as it is built.
    pub(crate) fn is_trapezoidal(&self) -> bool {
        matches!(self.shape, Shape::Trapezoid)
    }

    /// Takes another wave for the back-EMF, on the pieces that hold an electrical angle.
    pub(crate) fn reshape(&mut self, wave: Waveform, between_rad: f64) {
        self.shape = Shape::Waved(wave, between_rad);
    }

    /// Takes the pieces of the wave that hold another electrical angle.
    pub(crate) fn move_wave(&mut self, to_rad: f64) {
        if let Shape::Waved(_, between_rad) = &mut self.shape {
            *between_rad = to_rad;
        }
    }

    /// Pole pairs as a number.
    pub(crate) fn pole_pairs(&self) -> f64 {
        self.pole_pairs
    }

    /// Sectors a radian of the rotor.
    #[inline]
    pub(crate) fn sectors_per_rad(&self) -> f64 {
        self.sectors_per_rad
    }

    /// Numbers that a sector fixes.
    #[inline]
    pub(crate) fn sector(&self, sector: Sector) -> &SectorWinding {
        &self.sectors[sector.place()]
    }

    /// Modulation of the air gap, `1 + ζ·cos(θ_m + φ)`, near an angle.
    #[inline]
    pub(crate) fn gap(&self, rotor: &RotorAngle) -> LocalQuadratic {
        gap_of(self.eccentricity(), rotor)
    }

    /// `ζ·cos φ` and `ζ·sin φ`.
    #[inline]
    pub(crate) fn eccentricity(&self) -> [f64; 2] {
        [self.eccentricity_cos, self.eccentricity_sin]
    }

    /// Modulation of the air gap about a motor angle.
    pub(crate) fn air_gap(&self, rotor: &RotorAngle) -> AirGap {
        let along = self.eccentricity_cos * rotor.cos - self.eccentricity_sin * rotor.sin;
        let across = self.eccentricity_cos * rotor.sin + self.eccentricity_sin * rotor.cos;
        AirGap {
            centre_rad: rotor.motor_rad,
            series: [1.0 + along, -across, -0.5 * along, across / 6.0, along / 24.0],
        }
    }

    /// The coupling of the two loops near a motor angle, at a place in the sector from 0 to 1.
    #[inline]
    pub(crate) fn coupling(
        &self,
        at: &SectorWinding,
        rotor: RotorFrame<'_>,
        motor_rad: f64,
        along: f64,
    ) -> Coupling {
        if !matches!(self.shape, Shape::Trapezoid) {
            return self.smooth_coupling(at, rotor, motor_rad).0;
        }
        let g = rotor.gap.near(motor_rad);
        // within a sector the pair is on its flat tops, the idle phase on a flank
        let flank = at.idle_peak * at.flank;
        let (top, slope) = (1.0 - 2.0 * along, -2.0 * self.sectors_per_rad);
        let (b0, b1) = (flank * top - at.negative_peak, flank * slope);
        Coupling {
            pair: g.map(|g| at.pair_peak * g),
            idle: [b0 * g[0], b0 * g[1] + b1 * g[0], b0 * g[2] + b1 * g[1]],
        }
    }

    /// The coupling of a shape without corners near a motor angle, with its cubic terms.
    #[inline(never)]
    pub(crate) fn smooth_coupling(
        &self,
        at: &SectorWinding,
        rotor: RotorFrame<'_>,
        motor_rad: f64,
    ) -> (Coupling, CubicTerms) {
        let g = rotor.gap.near(motor_rad);
        let electrical_rad = self.pole_pairs * motor_rad;
        if let Shape::Tabulated(spline) = &self.shape {
            return self
                .smooth(at, &g, |phase| spline.near(electrical_rad - TAU / 3.0 * phase as f64));
        }
        if let Shape::Waved(wave, between_rad) = &self.shape {
            return self.smooth(at, &g, |phase| {
                let shift_rad = TAU / 3.0 * phase as f64;
                wave.near(electrical_rad - shift_rad, between_rad - shift_rad)
            });
        }
        let angles = PhaseAngles::near(rotor.electrical, electrical_rad);
        self.smooth(at, &g, |phase| {
            let (s, c) = (angles.sin[phase], angles.cos[phase]);
            [s, c, -0.5 * s, -c / 6.0]
        })
    }

    /// The coupling of a shape whose value and coefficients over the electrical angle are given
    /// for each phase.
    #[inline]
    fn smooth(
        &self,
        at: &SectorWinding,
        gap: &LocalQuadratic,
        shape: impl Fn(usize) -> [f64; 4],
    ) -> (Coupling, CubicTerms) {
        let one = |phase: usize, peak: f64| self.of_phase(peak, shape(phase), gap);
        let positive = one(at.positive, at.pair_peak + at.negative_peak);
        let negative = one(at.negative, -at.negative_peak);
        let idle = one(at.idle, at.idle_peak);
        let coupling = Coupling {
            pair: core::array::from_fn(|m| positive[m] - negative[m]),
            idle: core::array::from_fn(|m| idle[m] - negative[m]),
        };
        (coupling, CubicTerms(positive[3] - negative[3], idle[3] - negative[3]))
    }

    /// The coupling of a phase with a peak, from the shape's coefficients over the electrical
    /// angle.
    #[inline]
    fn of_phase(&self, peak: f64, [f0, f1, f2, f3]: [f64; 4], gap: &LocalQuadratic) -> LocalCubic {
        let p = self.pole_pairs;
        let [k0, k1, k2] = times(&[f0, p * f1, p * p * f2].map(|f| peak * f), gap);
        // of the cubic term the shape's own part, which is the largest
        [k0, k1, k2, peak * p * p * p * f3 * gap[0]]
    }

    /// The coupling of each of the phases A, B, C near a motor angle, at a place in the sector.
    #[cold]
    pub(crate) fn phase_couplings(
        &self,
        at: &SectorWinding,
        rotor: RotorFrame<'_>,
        motor_rad: f64,
        along: f64,
    ) -> [LocalCubic; 3] {
        let gap = rotor.gap.near(motor_rad);
        let electrical_rad = self.pole_pairs * motor_rad;
        let angles = PhaseAngles::near(rotor.electrical, electrical_rad);
        let shape = |phase: usize| {
            let shift_rad = TAU / 3.0 * phase as f64;
            match &self.shape {
                Shape::Trapezoid if phase == at.positive => [1.0, 0.0, 0.0, 0.0],
                Shape::Trapezoid if phase == at.negative => [-1.0, 0.0, 0.0, 0.0],
                // the flank's slope over the electrical angle
                Shape::Trapezoid => {
                    [at.flank * (1.0 - 2.0 * along), -2.0 * at.flank / FRAC_PI_3, 0.0, 0.0]
                }
                Shape::Sinusoid => {
                    let (s, c) = (angles.sin[phase], angles.cos[phase]);
                    [s, c, -0.5 * s, -c / 6.0]
                }
                Shape::Tabulated(spline) => spline.near(electrical_rad - shift_rad),
                Shape::Waved(wave, between_rad) => {
                    wave.near(electrical_rad - shift_rad, between_rad - shift_rad)
                }
            }
        };
        let mut couplings = [[0.0; 4]; 3];
        for (phase, peak) in [
            (at.positive, at.pair_peak + at.negative_peak),
            (at.negative, -at.negative_peak),
            (at.idle, at.idle_peak),
        ] {
            couplings[phase] = self.of_phase(peak, shape(phase), &gap);
        }
        couplings
    }
}

/// The rotor near which a coupling is taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotorFrame<'a> {
    pub(crate) gap: &'a AirGap,
    /// The rotor in electrical angle, near it.
    pub(crate) electrical: &'a RotorAngle,
}

/// Potentials of the legs of the positive and the negative phase.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LegVolts {
    pub(crate) positive_v: f64,
    pub(crate) negative_v: f64,
}

impl LegVolts {
    /// Both legs at one potential.
    pub(crate) fn both(v: f64) -> Self {
        Self { positive_v: v, negative_v: v }
    }

    /// Voltage over the two phases in series.
    #[inline]
    pub(crate) fn pair_v(self) -> f64 {
        self.positive_v - self.negative_v
    }
}

/// Voltages of the positive and the idle leg against the negative one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopVolts {
    pub(crate) pair_v: f64,
    pub(crate) idle_v: f64,
}

/// Currents of the positive and the idle phase and the motor's speed at the start of a segment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SegmentStart {
    pub(crate) positive_a: f64,
    pub(crate) idle_a: f64,
    pub(crate) speed_rad_per_s: f64,
}

/// Modulation of the air gap by an eccentricity `(ζ·cos φ, ζ·sin φ)` near an angle.
#[inline(always)]
#[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
pub(crate) fn gap_of([cos, sin]: [f64; 2], rotor: &RotorAngle) -> LocalQuadratic {
    let along = cos * rotor.cos - sin * rotor.sin;
    let across = cos * rotor.sin + sin * rotor.cos;
    [1.0 + along, -across, -0.5 * along]
}

/// Flux change a radian, near an angle, of the two loops: `a` of the conducting pair, `b` of the
/// idle phase against the negative one; V·s/rad or N·m/A.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coupling {
    pair: LocalQuadratic,
    idle: LocalQuadratic,
}

/// The cubic terms that a [`Coupling`] leaves out, of its pair and its idle phase.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CubicTerms(f64, f64);

impl CubicTerms {
    /// The terms with torque and back-EMF at a share of themselves.
    pub(crate) fn scaled(&self, ratio: f64) -> Self {
        Self(ratio * self.0, ratio * self.1)
    }

    /// Terms of the pair and of the idle phase.
    pub(crate) fn loops(&self) -> (f64, f64) {
        (self.0, self.1)
    }
}

impl Coupling {
    /// Motor torque of the currents of the positive and the idle phase.
    pub(crate) fn torque_now_n_m(&self, positive_a: f64, idle_a: f64) -> f64 {
        self.pair[0] * positive_a + self.idle[0] * idle_a
    }

    /// Coefficients of the conducting pair, and of the idle phase.
    pub(crate) fn loops(&self) -> [&LocalQuadratic; 2] {
        [&self.pair, &self.idle]
    }

    /// The coupling with torque and back-EMF at a share of themselves.
    pub(crate) fn scaled(&self, ratio: f64) -> Self {
        Self { pair: self.pair.map(|k| ratio * k), idle: self.idle.map(|k| ratio * k) }
    }

    /// Motor torque at a time of a segment.
    pub(crate) fn torque_n_m(&self, segment: &Segment, at_s: f64) -> f64 {
        let turn = value(&segment.turn, at_s);
        let near = |k: &LocalQuadratic| k[0] + turn * (k[1] + turn * k[2]);
        near(&self.pair) * value(&segment.positive, at_s)
            + near(&self.idle) * value(&segment.idle, at_s)
    }

    /// Motor torque over a segment of a rotor at rest.
    pub(crate) fn torque_at_rest(&self, segment: &Segment) -> Series {
        let (a, b) = (self.pair[0], self.idle[0]);
        core::array::from_fn(|m| a * segment.positive[m] + b * segment.idle[m])
    }

    /// Back-EMF of the pair at the angle that the coupling is taken about.
    pub(crate) fn pair_emf_v(&self, speed_rad_per_s: f64) -> f64 {
        self.pair[0] * speed_rad_per_s
    }

    /// Potential of the idle terminal while it is open.
    #[inline]
    pub(crate) fn open_terminal_v(
        &self,
        at: &SectorWinding,
        legs: LegVolts,
        current_a: f64,
        speed_rad_per_s: f64,
    ) -> f64 {
        let LegVolts { positive_v, negative_v } = legs;
        let drop_v = at.pair_ohm * current_a + self.pair[0] * speed_rad_per_s;
        let negative_drop_v = at.negative_ohm * current_a + self.idle[0] * speed_rad_per_s;
        negative_v + negative_drop_v + at.star_share * (positive_v - negative_v - drop_v)
    }
}

/// Product of two local quadratics, to the second power.
#[inline(always)]
#[expect(clippy::inline_always, reason = "inlined into the lanes' loop, which must not call")]
pub(crate) fn times(a: &LocalQuadratic, b: &LocalQuadratic) -> LocalQuadratic {
    [a[0] * b[0], a[0] * b[1] + a[1] * b[0], a[0] * b[2] + a[1] * b[1] + a[2] * b[0]]
}

/// The shaft's equation in a state of the drive train.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shaft {
    /// `1/(m·J)` for coefficient m = 1 to 4; zero while the shaft sticks.
    pub(crate) per_inertia: [f64; 4],
    /// Torque besides the motor's and the viscous one.
    pub(crate) external_n_m: f64,
    pub(crate) viscous_n_m_s_per_rad: f64,
}

/// The solution from now to the next event.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// Current of the positive phase, A.
    pub(crate) positive: Series,
    /// Current of the idle phase, A; zero while it is open.
    pub(crate) idle: Series,
    /// Motor speed, rad/s.
    pub(crate) speed: Series,
    /// Turn of the rotor from now, rad.
    pub(crate) turn: Series,
}

/// Coefficient of `t³` in `k(δ(t))`.
#[inline]
pub(crate) fn third(k: &LocalQuadratic, cubic: f64, turn: &Series) -> f64 {
    let d1 = turn[1];
    k[1] * turn[3] + 2.0 * k[2] * d1 * turn[2] + cubic * d1 * d1 * d1
}

/// Coefficient of `t` in `k(δ(t))`.
#[inline]
pub(crate) fn first(k: &LocalQuadratic, d1: f64) -> f64 {
    k[1] * d1
}

/// Coefficient of `t²` in `k(δ(t))`.
#[inline]
pub(crate) fn second(k: &LocalQuadratic, d1: f64, d2: f64) -> f64 {
    k[1] * d2 + k[2] * d1 * d1
}

impl Segment {
    /// Adds the cubic term of the coupling to the highest order: legs that are held for a whole
    /// period see a sinusoidal back-EMF bend.
    pub(crate) fn bend(
        &mut self,
        at: &SectorWinding,
        shaft: &Shaft,
        coupling: &Coupling,
        cubic: CubicTerms,
    ) {
        let a3 = third(&coupling.pair, cubic.0, &self.turn);
        let b3 = third(&coupling.idle, cubic.1, &self.turn);
        let (cx, cxy, cy) = at.per_henry;
        let (u, v) = (-0.25 * a3 * self.speed[0], -0.25 * b3 * self.speed[0]);
        self.positive[4] += cx * u + cxy * v;
        self.idle[4] += cxy * u + cy * v;
        self.speed[4] += (a3 * self.positive[0] + b3 * self.idle[0]) * shaft.per_inertia[3];
    }

    /// Two phases in series, one current: the idle phase is open.
    #[inline]
    pub(crate) fn pair(
        at: &SectorWinding,
        shaft: &Shaft,
        coupling: &Coupling,
        loop_v: f64,
        start: SegmentStart,
    ) -> Self {
        let (i0, w0) = (start.positive_a, start.speed_rad_per_s);
        let (k, r) = (&coupling.pair, at.pair_ohm);
        let (l, j, c) = (&at.pair_per_henry, &shaft.per_inertia, shaft.viscous_n_m_s_per_rad);
        // Coefficient m + 1 of current and speed follows from coefficient m of the right-hand sides:
        // (m + 1)·L·i_{m+1} = [m = 0]·v − R·i_m − (k·ω)_m, (m + 1)·J·ω_{m+1} = (k·i)_m − c·ω_m.
        // k depends on the turn, so that its own coefficients follow from those of the speed.
        let (k0, k1) = (k[0], first(k, w0));
        let t0 = k0 * i0;
        let i1 = (loop_v - r * i0 - k0 * w0) * l[0];
        let w1 = (t0 + shaft.external_n_m - c * w0) * j[0];
        let d2 = 0.5 * w1;
        let t1 = k0 * i1 + k1 * i0;
        let i2 = -(r * i1 + k0 * w1 + k1 * w0) * l[1];
        let w2 = (t1 - c * w1) * j[1];
        let (d3, k2) = (w2 * (1.0 / 3.0), second(k, w0, d2));
        let t2 = k0 * i2 + k1 * i1 + k2 * i0;
        let i3 = -(r * i2 + k0 * w2 + k1 * w1 + k2 * w0) * l[2];
        let w3 = (t2 - c * w2) * j[2];
        let i4 = -(r * i3 + k0 * w3 + k1 * w2 + k2 * w1) * l[3];
        let w4 = (k0 * i3 + k1 * i2 + k2 * i1 - c * w3) * j[3];
        Self {
            positive: [i0, i1, i2, i3, i4],
            idle: [0.0; 5],
            speed: [w0, w1, w2, w3, w4],
            turn: [0.0, w0, d2, d3, 0.25 * w3],
        }
    }

    /// All three phases connected; voltages of the positive and the idle leg against the
    /// negative one.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "the segment is large and would be copied")]
    pub(crate) fn three(
        at: &SectorWinding,
        shaft: &Shaft,
        coupling: &Coupling,
        loops: LoopVolts,
        start: SegmentStart,
    ) -> Self {
        let LoopVolts { pair_v, idle_v } = loops;
        let (x0, y0, w0) = (start.positive_a, start.idle_a, start.speed_rad_per_s);
        let (a, b) = (&coupling.pair, &coupling.idle);
        let (j, c) = (&shaft.per_inertia, shaft.viscous_n_m_s_per_rad);
        let (cx, cxy, cy) = at.per_henry;
        // As for a pair, with two loops: their inductances couple, so that the rates are those of
        // the inverse of a symmetric matrix of two rows.
        let rates = |u: f64, v: f64, x: f64, y: f64, share: f64| {
            let u = u - at.pair_ohm * x - at.negative_ohm * y;
            let v = v - at.negative_ohm * x - at.idle_ohm * y;
            ((cx * u + cxy * v) * share, (cxy * u + cy * v) * share)
        };
        let (a0, b0, a1, b1) = (a[0], b[0], first(a, w0), first(b, w0));
        let t0 = a0 * x0 + b0 * y0;
        let (x1, y1) = rates(pair_v - a0 * w0, idle_v - b0 * w0, x0, y0, 1.0);
        let w1 = (t0 + shaft.external_n_m - c * w0) * j[0];
        let d2 = 0.5 * w1;
        let t1 = a0 * x1 + a1 * x0 + b0 * y1 + b1 * y0;
        let (x2, y2) = rates(-(a0 * w1 + a1 * w0), -(b0 * w1 + b1 * w0), x1, y1, 0.5);
        let w2 = (t1 - c * w1) * j[1];
        let d3 = w2 * (1.0 / 3.0);
        let (a2, b2) = (second(a, w0, d2), second(b, w0, d2));
        let t2 = a0 * x2 + a1 * x1 + a2 * x0 + b0 * y2 + b1 * y1 + b2 * y0;
        let (x3, y3) = rates(
            -(a0 * w2 + a1 * w1 + a2 * w0),
            -(b0 * w2 + b1 * w1 + b2 * w0),
            x2,
            y2,
            1.0 / 3.0,
        );
        let w3 = (t2 - c * w2) * j[2];
        let t3 = (a0 * x3 + a1 * x2 + a2 * x1) + (b0 * y3 + b1 * y2 + b2 * y1);
        let (x4, y4) =
            rates(-(a0 * w3 + a1 * w2 + a2 * w1), -(b0 * w3 + b1 * w2 + b2 * w1), x3, y3, 0.25);
        let w4 = (t3 - c * w3) * j[3];
        Self {
            positive: [x0, x1, x2, x3, x4],
            idle: [y0, y1, y2, y3, y4],
            speed: [w0, w1, w2, w3, w4],
            turn: [0.0, w0, d2, d3, 0.25 * w3],
        }
    }
}
