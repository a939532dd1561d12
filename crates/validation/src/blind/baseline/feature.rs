//! Expert features: torques against positive motion that effects of the catalogue would add to
//! the torque balance, linear in a size, from measured signals.

use core::f64::consts::{FRAC_PI_6, PI, TAU};

use super::{
    nominal::Nominal,
    signals::{PAIRS, Signals},
    smooth::{bend, slope},
};

/// A torque of one or two columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// `s·exp(−|ω|/ω_s)`
    Stribeck(f64),
    /// `s·|ω/ω_0|ⁿ`, `ω_0` = 1 rad/s
    Power(f64),
    /// 1: dry friction more in one direction, or an offset of the current sensor.
    Constant,
    /// `|ω|`
    UnequalDrag,
    /// `s·|T_l|`
    LoadRub,
    /// `F·(z − s)`, z the bristle of a deflection.
    Presliding(f64),
    /// `s·exp(−((x − c)/w)²/2)`
    Worn(f64, f64),
    /// `F·s·(1 − exp(−t/τ))`
    Drift(f64),
    /// Motion of a load behind a spring less that of a stiff one; its frequency, Hz.
    Swinging(f64),
    /// Wave of an order over the motor's angle in the position, its acceleration and the load's
    /// work on it.
    GearWave(f64),
    /// `x`
    Spring,
    /// `sin x`, `cos x`
    Pendulum,
    /// `sin n·θ`, `cos n·θ`
    Cogging(f64),
    /// … times the motor's torque.
    Ripple(f64),
    /// `k·I³`
    Cubic,
    /// The load's torque: a torque constant off by a share scales inertia and friction, which
    /// are free, and it.
    LoadScale,
    /// `k·dI/dt`: a current that is shown late.
    CurrentSlope,
    /// `d(k·I − T_l)/dt`: a position that is shown late.
    LatePosition,
    /// Torque that a sine of the back-EMF lacks against flat tops, without its mean: that is a
    /// factor on all torques.
    Rounded,
    /// `k·I·exp(−t_c/τ)`, `t_c` since the last commutation
    Dip(f64),
    /// Torque that Hall marks off by an angle take, without its mean.
    Halls(f64),
    /// `sin 2πft`, `cos 2πft`, with phases of its own in every recording.
    Vibration(f64),
}

/// A shape with the effect that it speaks for, by the sign of its size; none refuses the sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Feature {
    pub(super) shape: Shape,
    pub(super) plus: Option<&'static str>,
    pub(super) minus: Option<&'static str>,
}

impl Feature {
    fn both(shape: Shape, id: &'static str) -> Self {
        Self { shape, plus: Some(id), minus: Some(id) }
    }

    fn plus(shape: Shape, id: &'static str) -> Self {
        Self { shape, plus: Some(id), minus: None }
    }

    fn minus(shape: Shape, id: &'static str) -> Self {
        Self { shape, plus: None, minus: Some(id) }
    }

    /// The effect named by its sizes: of two columns the sign says nothing.
    pub(super) fn name(&self, sizes: &[f64]) -> Option<&'static str> {
        match sizes {
            [size] if *size < 0.0 => self.minus,
            _ => self.plus,
        }
    }
}

/// Orders over the motor's turn that are tried for cogging and ripple: multiples of six.
const ORDERS: [f64; 8] = [6.0, 12.0, 18.0, 24.0, 30.0, 36.0, 42.0, 48.0];
/// Orders of a gear's error behind the gear, and of one that the loop's sensor shows.
const GEAR_ORDERS: [f64; 3] = [1.0, 2.0, 3.0];
const AXIS_ORDERS: [f64; 6] = [2.0, 3.0, 4.0, 5.0, 6.0, 8.0];
/// Frequencies of a load behind a spring, Hz: a sixth apart.
const SWINGS_HZ: [f64; 13] =
    [50.0, 58.0, 68.0, 79.0, 93.0, 108.0, 126.0, 147.0, 172.0, 200.0, 234.0, 273.0, 318.0];
/// Centres of worn regions over the travel.
const CENTRES: usize = 8;

/// All features of a machine but vibrations; shapes are spread over what the recordings visit.
pub(super) fn library(nominal: &Nominal, fastest: f64, travel: (f64, f64)) -> Vec<Feature> {
    let servo = nominal.pole_pairs.is_none();
    let mut all = Vec::new();
    for share in [0.01, 0.03, 0.1] {
        all.push(Feature::plus(Shape::Stribeck(share * fastest), "E01"));
    }
    for exponent in [0.5, 2.0] {
        all.push(Feature::both(Shape::Power(exponent), "E02"));
    }
    all.push(Feature::both(Shape::Constant, "E03"));
    all.push(Feature::both(Shape::UnequalDrag, "E03"));
    all.push(Feature::plus(Shape::LoadRub, "E04"));
    for most_rad in [0.005, 0.0125, 0.03, 0.08] {
        all.push(Feature::plus(Shape::Presliding(most_rad), "E05"));
    }
    let (low, high) = travel;
    for n in 0..CENTRES {
        let centre = low + (high - low) * (n as f64 + 0.5) / CENTRES as f64;
        for share in [0.06, 0.15] {
            all.push(Feature::both(Shape::Worn(centre, share * (high - low)), "E06"));
        }
    }
    for tau_s in [0.7, 2.0, 6.0] {
        all.push(Feature::minus(Shape::Drift(tau_s), "E07"));
    }
    all.push(Feature::both(Shape::Spring, "E10"));
    all.push(Feature::both(Shape::Pendulum, "E10"));
    for order in ORDERS {
        all.push(Feature::both(Shape::Cogging(order), "E11"));
        all.push(Feature::both(Shape::Ripple(order), "E12"));
    }
    all.push(Feature::plus(Shape::Cubic, "E13"));
    all.push(Feature::minus(Shape::CurrentSlope, "E19"));
    if servo {
        all.push(Feature { shape: Shape::LoadScale, plus: Some("E14"), minus: Some("E19") });
        all.extend(SWINGS_HZ.map(|hz| Feature::plus(Shape::Swinging(hz), "E08")));
        all.push(Feature::plus(Shape::LatePosition, "E20"));
        all.push(Feature::both(Shape::GearWave(1.0), "E20"));
        all.extend(AXIS_ORDERS.map(|order| Feature::both(Shape::GearWave(order), "E09")));
    } else {
        all.extend(GEAR_ORDERS.map(|order| Feature::both(Shape::GearWave(order), "E09")));
        all.push(Feature::plus(Shape::Rounded, "E23"));
        all.extend([3e-4, 1e-3].map(|tau_s| Feature::plus(Shape::Dip(tau_s), "E24")));
        for lead in [-0.3, -0.2, -0.1, 0.1, 0.2, 0.3] {
            all.push(Feature::plus(Shape::Halls(lead), "E25"));
        }
    }
    all
}

/// The feature of a vibration.
pub(super) fn vibration(hz: f64) -> Feature {
    Feature::both(Shape::Vibration(hz), "E22")
}

impl Shape {
    /// Columns of the shape at the rate of the recording, not smoothed.
    pub(super) fn columns(self, x: &Signals, contact: &[f64]) -> Vec<Vec<f64>> {
        let s = |n: usize| x.speed[n].signum();
        let (k, dry) = (x.nominal.constant_n_m_per_a, x.nominal.kinetic_n_m);
        let wave = |order: f64, of: &dyn Fn(usize) -> f64| {
            vec![
                x.map(|n| of(n) * (order * x.angle[n]).sin()),
                x.map(|n| of(n) * (order * x.angle[n]).cos()),
            ]
        };
        let one = |value: &dyn Fn(usize) -> f64| vec![x.map(value)];
        match self {
            Self::Stribeck(speed) => one(&|n| s(n) * (-x.speed[n].abs() / speed).exp()),
            Self::Power(exponent) => one(&|n| s(n) * x.speed[n].abs().powf(exponent)),
            Self::Constant => one(&|_| 1.0),
            Self::UnequalDrag => one(&|n| x.speed[n].abs()),
            Self::LoadRub => one(&|n| s(n) * (x.load[n] * contact[n]).abs()),
            Self::Presliding(most_rad) => {
                let bristle = x.bristle(most_rad);
                one(&|n| dry * (bristle[n] - s(n)))
            }
            Self::Worn(centre, width) => one(&|n| {
                let off = (x.travel[n] - centre) / width;
                s(n) * (-0.5 * off * off).exp()
            }),
            Self::Drift(tau_s) => one(&|n| dry * s(n) * (1.0 - (-x.time_s[n] / tau_s).exp())),
            Self::Swinging(hz) => vec![x.swinging(hz)],
            Self::GearWave(order) => gear_wave(x, contact, order),
            Self::Spring => one(&|n| x.travel[n]),
            Self::Pendulum => vec![x.map(|n| x.travel[n].sin()), x.map(|n| x.travel[n].cos())],
            Self::Cogging(order) => wave(order, &|_| 1.0),
            Self::Ripple(order) => wave(order, &|n| k * x.current[n]),
            Self::Cubic => one(&|n| k * x.current[n].powi(3)),
            Self::LoadScale => vec![x.felt(contact)],
            Self::CurrentSlope => vec![slope(&x.map(|n| k * x.current[n]), x.rate_hz)],
            Self::LatePosition => {
                let felt = x.felt(contact);
                vec![slope(&x.map(|n| k * x.current[n] - felt[n]), x.rate_hz)]
            }
            Self::Rounded => {
                let mean = 1.0 - 1.5 * 3.0_f64.sqrt() / PI;
                one(&|n| k * x.current[n] * (lack(x, n, 0.0, f64::sin) - mean))
            }
            Self::Halls(lead) => {
                let mean = 4.5 * lead * lead / (PI * PI);
                one(&|n| k * x.current[n] * (lack(x, n, lead, trapezoid) - mean))
            }
            Self::Dip(tau_s) => {
                one(&|n| k * x.current[n] * (-since_commutation(x, n) / tau_s).exp())
            }
            Self::Vibration(hz) => vec![
                x.map(|n| (TAU * hz * x.time_s[n]).sin()),
                x.map(|n| (TAU * hz * x.time_s[n]).cos()),
            ],
        }
    }
}

/// Part of a wave in the position: where the position is shown, minus the inertia of its
/// acceleration, and everywhere the load's work.
fn gear_wave(x: &Signals, contact: &[f64], order: f64) -> Vec<Vec<f64>> {
    let shown = x.nominal.pole_pairs.is_none();
    [0.0, 0.5 * PI]
        .map(|phase| {
            let wave = x.map(|n| (order * x.angle[n] + phase).sin());
            let bent = if shown { bend(&wave, x.rate_hz) } else { x.map(|_| 0.0) };
            x.map(|n| {
                let pushed = contact[n].abs() * x.load[n];
                order * (order * x.angle[n] + phase).cos() * pushed
                    - x.nominal.inertia_kg_m2 * bent[n]
            })
        })
        .into()
}

/// Share of the torque that a form of the back-EMF lacks, commutated early by an angle.
fn lack(x: &Signals, n: usize, lead: f64, form: fn(f64) -> f64) -> f64 {
    let Some((sector, electrical)) = x.sector(n, lead) else { return 0.0 };
    let (plus, minus) = PAIRS[sector];
    let of = |phase: usize| form(electrical - TAU / 3.0 * phase as f64);
    1.0 - 0.5 * (of(plus) - of(minus))
}

/// A wave with flat tops of 120°.
fn trapezoid(angle: f64) -> f64 {
    (angle.sin().asin() / FRAC_PI_6).clamp(-1.0, 1.0)
}

/// Time since the last commutation at the present speed.
fn since_commutation(x: &Signals, n: usize) -> f64 {
    let Some(pairs) = x.nominal.pole_pairs else { return f64::INFINITY };
    let place = (x.angle[n] * pairs - FRAC_PI_6) / (PI / 3.0);
    let within = place - place.floor();
    let way = if x.speed[n] > 0.0 { within } else { 1.0 - within };
    way * (PI / 3.0) / (pairs * x.speed[n].abs()).max(1e-9)
}
