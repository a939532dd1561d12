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
//! solves it: with the segments of a 20 kHz carrier the first term left out is below 1e-8 of the
//! current.

use core::f64::consts::{FRAC_PI_3, TAU};

use crate::{
    drive_train::{Direction, DriveTrain},
    fault::PhysicalFaults,
    params::{BackEmfShape, Motor},
    phase::{PerPhase, Sector},
    series::{Series, TERMS},
};

/// A quantity near an angle, `c_0 + c_1·δ + c_2·δ² + c_3·δ³` for a turn by δ of the rotor.
pub(crate) type LocalCubic = [f64; 4];

/// Electrical constants of a motor with its faults.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Winding {
    pub(crate) resistance_ohm: PerPhase,
    pub(crate) inductance_henry: PerPhase,
    per_henry: PerPhase,
    peak_v_s_per_rad: PerPhase,
    shape: BackEmfShape,
    pole_pairs: f64,
    eccentricity_cos: f64,
    eccentricity_sin: f64,
}

/// How the rotor stands: its absolute angle with sine and cosine, and the sector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotorAngle {
    pub(crate) motor_rad: f64,
    pub(crate) sin: f64,
    pub(crate) cos: f64,
    pub(crate) sector: Sector,
}

impl RotorAngle {
    /// The rotor at an absolute angle, in a given sector.
    pub(crate) fn new(motor_rad: f64, sector: Sector) -> Self {
        let (sin, cos) = libm::sincos(motor_rad);
        Self { motor_rad, sin, cos, sector }
    }

    /// Turns by a small angle, below a tenth of a radian.
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

impl Winding {
    /// A winding: with `N_j` of the turns left, `R ∝ N`, `L ∝ N²`, `k ∝ N`.
    pub(crate) fn new(motor: &Motor, faults: &PhysicalFaults) -> Self {
        let turns = faults.healthy_turns_frac;
        let inductance_henry = turns.map(|n| motor.inductance_henry * n * n);
        Self {
            resistance_ohm: turns.map(|n| motor.resistance_ohm * n),
            inductance_henry,
            per_henry: inductance_henry.map(|l| 1.0 / l),
            peak_v_s_per_rad: turns.map(|n| motor.back_emf_v_s_per_rad * n),
            shape: motor.back_emf_shape,
            pole_pairs: f64::from(motor.pole_pairs),
            eccentricity_cos: faults.eccentricity_cos,
            eccentricity_sin: faults.eccentricity_sin,
        }
    }

    /// Pole pairs as a number.
    pub(crate) fn pole_pairs(&self) -> f64 {
        self.pole_pairs
    }

    /// Modulation of the air gap, `1 + ζ·cos(θ_m + φ)`, near an angle.
    #[inline]
    pub(crate) fn gap(&self, rotor: &RotorAngle) -> LocalCubic {
        if self.eccentricity_cos == 0.0 && self.eccentricity_sin == 0.0 {
            return [1.0, 0.0, 0.0, 0.0];
        }
        let along = self.eccentricity_cos * rotor.cos - self.eccentricity_sin * rotor.sin;
        let across = self.eccentricity_cos * rotor.sin + self.eccentricity_sin * rotor.cos;
        [1.0 + along, -across, -0.5 * along, across * (1.0 / 6.0)]
    }

    /// The `k_j` of the three phases near an angle, V·s/rad or N·m/A.
    #[inline]
    pub(crate) fn coupling(&self, rotor: &RotorAngle) -> [LocalCubic; 3] {
        let gap = self.gap(rotor);
        match self.shape {
            BackEmfShape::Trapezoid => self.trapezoid(rotor, &gap),
            BackEmfShape::Sinusoid => self.sinusoid(rotor, &gap),
        }
    }

    /// Within a sector the conducting phases are on their flat tops, the idle one on a flank.
    #[inline]
    fn trapezoid(&self, rotor: &RotorAngle, gap: &LocalCubic) -> [LocalCubic; 3] {
        let sector = rotor.sector;
        let idle = sector.idle_phase();
        let flank = if sector.place().is_multiple_of(2) { 1.0 } else { -1.0 };
        let along = (rotor.motor_rad * self.pole_pairs - sector.begin_rad()) / FRAC_PI_3;
        let top = flank * (1.0 - 2.0 * along);
        let slope = -2.0 * flank * self.pole_pairs / FRAC_PI_3;
        let mut k = [[0.0; 4]; 3];
        for (phase, sign) in [(sector.positive_phase(), 1.0), (sector.negative_phase(), -1.0)] {
            let peak = sign * self.peak_v_s_per_rad[phase];
            k[phase] = gap.map(|g| peak * g);
        }
        let peak = self.peak_v_s_per_rad[idle];
        k[idle] = [
            peak * top * gap[0],
            peak * (top * gap[1] + slope * gap[0]),
            peak * (top * gap[2] + slope * gap[1]),
            peak * (top * gap[3] + slope * gap[2]),
        ];
        k
    }

    /// The sine and its derivatives.
    fn sinusoid(&self, rotor: &RotorAngle, gap: &LocalCubic) -> [LocalCubic; 3] {
        let p = self.pole_pairs;
        core::array::from_fn(|phase| {
            let (s, c) = libm::sincos(p * rotor.motor_rad - TAU / 3.0 * phase as f64);
            let f = [s, p * c, -0.5 * p * p * s, -p * p * p * c / 6.0];
            let peak = self.peak_v_s_per_rad[phase];
            [
                peak * f[0] * gap[0],
                peak * (f[0] * gap[1] + f[1] * gap[0]),
                peak * (f[0] * gap[2] + f[1] * gap[1] + f[2] * gap[0]),
                peak * (f[0] * gap[3] + f[1] * gap[2] + f[2] * gap[1] + f[3] * gap[0]),
            ]
        })
    }

    /// Potential of the star point with two phases connected.
    #[inline]
    pub(crate) fn star_point_v(
        &self,
        (p, n): (usize, usize),
        legs_v: &PerPhase,
        currents_a: &PerPhase,
        emf_v: &PerPhase,
    ) -> f64 {
        let drive = |j: usize| legs_v[j] - self.resistance_ohm[j] * currents_a[j] - emf_v[j];
        (drive(p) * self.per_henry[p] + drive(n) * self.per_henry[n])
            / (self.per_henry[p] + self.per_henry[n])
    }
}

/// The solution from now to the next event.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// Phase currents, A.
    pub(crate) currents: [Series; 3],
    /// Motor speed, rad/s.
    pub(crate) speed: Series,
    /// Turn of the rotor from now, rad.
    pub(crate) turn: Series,
    /// Motor torque, N·m, to the third order.
    pub(crate) torque: Series,
}

/// Taylor coefficients of `k(δ(t))` up to the third.
#[inline]
pub(crate) fn along_time(k: &LocalCubic, d: &Series) -> [f64; 4] {
    [
        k[0],
        k[1] * d[1],
        k[1] * d[2] + k[2] * d[1] * d[1],
        k[1] * d[3] + 2.0 * k[2] * d[1] * d[2] + k[3] * d[1] * d[1] * d[1],
    ]
}

/// Coefficient `m` of a product of two series.
#[inline]
pub(crate) fn product(a: &[f64; 4], b: &Series, m: usize) -> f64 {
    let mut sum = a[0] * b[m];
    for k in 1..=m {
        sum += a[k] * b[m - k];
    }
    sum
}

/// Which phases carry current, and with what leg voltages.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Connection {
    /// Two phases in series, the third open.
    Pair(usize, usize),
    /// All three.
    Three,
}

impl Segment {
    /// Solves the winding and the shaft from a state.
    #[inline]
    pub(crate) fn solve(
        winding: &Winding,
        train: &DriveTrain,
        coupling: &[LocalCubic; 3],
        (connection, legs_v): (Connection, &PerPhase),
        currents_a: &PerPhase,
    ) -> Self {
        let moving = train.direction != Direction::Stuck;
        let shaft = Shaft {
            per_inertia: if moving { 1.0 / train.inertia_kg_m2 } else { 0.0 },
            external_n_m: train.external_n_m(),
            viscous: train.viscous_n_m_s_per_rad,
            speed: if moving { train.speed_rad_per_s } else { 0.0 },
        };
        match connection {
            Connection::Pair(p, n) => {
                pair(winding, &shaft, coupling, (p, n, legs_v), currents_a[p])
            }
            Connection::Three => three(winding, &shaft, coupling, legs_v, currents_a),
        }
    }
}

/// What the shaft equation needs.
struct Shaft {
    per_inertia: f64,
    external_n_m: f64,
    viscous: f64,
    speed: f64,
}

impl Shaft {
    /// Next coefficients of speed and turn from coefficient `m` of the torque.
    #[inline]
    fn advance(&self, m: usize, torque: f64, speed: &mut Series, turn: &mut Series) {
        let external = if m == 0 { self.external_n_m } else { 0.0 };
        let next = m + 1;
        speed[next] =
            (torque + external - self.viscous * speed[m]) * self.per_inertia / next as f64;
        if next + 1 < TERMS {
            turn[next + 1] = speed[next] / (next + 1) as f64;
        }
    }
}

/// Two phases in series: one current.
#[inline]
fn pair(
    winding: &Winding,
    shaft: &Shaft,
    coupling: &[LocalCubic; 3],
    (p, n, legs_v): (usize, usize, &PerPhase),
    current_a: f64,
) -> Segment {
    let loop_k: LocalCubic = core::array::from_fn(|m| coupling[p][m] - coupling[n][m]);
    let resistance = winding.resistance_ohm[p] + winding.resistance_ohm[n];
    let per_henry = 1.0 / (winding.inductance_henry[p] + winding.inductance_henry[n]);
    let mut i = [0.0; TERMS];
    let mut w = [0.0; TERMS];
    let mut d = [0.0; TERMS];
    let mut torque = [0.0; TERMS];
    i[0] = current_a;
    w[0] = shaft.speed;
    d[1] = shaft.speed;
    let mut source = legs_v[p] - legs_v[n];
    for m in 0..TERMS - 1 {
        let k = along_time(&loop_k, &d);
        i[m + 1] = (source - resistance * i[m] - product(&k, &w, m)) * per_henry / (m + 1) as f64;
        torque[m] = product(&k, &i, m);
        shaft.advance(m, torque[m], &mut w, &mut d);
        source = 0.0;
    }
    let mut currents = [[0.0; TERMS]; 3];
    currents[p] = i;
    currents[n] = i.map(|c| -c);
    Segment { currents, speed: w, turn: d, torque }
}

/// All three phases connected.
#[inline]
fn three(
    winding: &Winding,
    shaft: &Shaft,
    coupling: &[LocalCubic; 3],
    legs_v: &PerPhase,
    currents_a: &PerPhase,
) -> Segment {
    let per_henry = &winding.per_henry;
    let whole = 1.0 / (per_henry[0] + per_henry[1] + per_henry[2]);
    let mut i = currents_a.map(|a| [a, 0.0, 0.0, 0.0, 0.0]);
    let mut w = [0.0; TERMS];
    let mut d = [0.0; TERMS];
    let mut torque = [0.0; TERMS];
    w[0] = shaft.speed;
    d[1] = shaft.speed;
    let mut source = *legs_v;
    for m in 0..TERMS - 1 {
        let k = [
            along_time(&coupling[0], &d),
            along_time(&coupling[1], &d),
            along_time(&coupling[2], &d),
        ];
        let drive: PerPhase = core::array::from_fn(|j| {
            source[j] - winding.resistance_ohm[j] * i[j][m] - product(&k[j], &w, m)
        });
        let star =
            (drive[0] * per_henry[0] + drive[1] * per_henry[1] + drive[2] * per_henry[2]) * whole;
        for j in 0..3 {
            i[j][m + 1] = (drive[j] - star) * per_henry[j] / (m + 1) as f64;
            torque[m] += product(&k[j], &i[j], m);
        }
        shaft.advance(m, torque[m], &mut w, &mut d);
        source = [0.0; 3];
    }
    Segment { currents: i, speed: w, turn: d, torque }
}
