//! The torque residual of the nominal machine and what is regressed on it: rows of training and
//! hold-out recordings.

use std::path::Path;

use anyhow::Result;
use core::f64::consts::TAU;
use greybox_blind::{File, Role};

use super::{
    feature::{Feature, Shape, library, vibration},
    gram::Gram,
    nominal::Nominal,
    recorded::Recorded,
    signals::{PAIRS, Signals},
};

/// Levels of the fault of the play that are tried first; it widens by 99 times the level.
const PLAY_LEVELS: [f64; 18] = [
    0.0, 0.003, 0.006, 0.01, 0.015, 0.02, 0.03, 0.04, 0.05, 0.07, 0.1, 0.13, 0.16, 0.2, 0.25, 0.3,
    0.35, 0.4,
];
/// Halvings of the step around the best of them.
const HALVINGS: usize = 7;
/// Frequencies at which a vibration is looked for, Hz, and how far apart the two tried are.
const LOWEST_HZ: f64 = 2.0;
const STEP_HZ: f64 = 0.1;
/// How many frequencies are looked at.
pub(super) const FREQUENCIES: usize = 781;
const APART_HZ: f64 = 1.0;

/// Stacked rows of recordings of a role.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    /// Torque that the nominal machine does not explain, N·m.
    pub(super) residual: Vec<f64>,
    /// Columns of faults and nuisance parameters.
    pub(super) nuisance: Vec<Vec<f64>>,
    /// Columns of each feature.
    pub(super) features: Vec<Vec<Vec<f64>>>,
}

/// Features and their columns.
#[derive(Clone, Debug)]
pub(super) struct Design {
    pub(super) features: Vec<Feature>,
    pub(super) train: Rows,
    pub(super) hold_out: Rows,
}

impl Design {
    /// From the files that are explained.
    pub(super) fn read(folder: &Path, files: &[File]) -> Result<Self> {
        let nominal = Nominal::read(&folder.join("nominal.toml"))?;
        let of_role = |role| -> Result<Vec<Signals>> {
            let files = files.iter().filter(|file| file.role == role);
            files
                .map(|file| Ok(Signals::of(&Recorded::read(&folder.join(&file.name))?, nominal)))
                .collect()
        };
        Ok(Self::of(&nominal, &of_role(Role::Train)?, &of_role(Role::HoldOut)?))
    }

    fn of(nominal: &Nominal, train: &[Signals], hold_out: &[Signals]) -> Self {
        let play = fitted_play(train);
        let all = || train.iter().flat_map(|x| &x.travel).copied();
        let travel = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
        let speeds = train.iter().flat_map(|x| &x.speed);
        let fastest = speeds.fold(0.0_f64, |most, w| most.max(w.abs()));
        let mut features = library(nominal, fastest, travel);
        let bare = Rows::of(train, play, &[]);
        features.extend(loudest(train, &without_nuisance(&bare)).map(vibration));
        Self {
            train: Rows::of(train, play, &features),
            hold_out: Rows::of(hold_out, play, &features),
            features,
        }
    }
}

impl Rows {
    fn of(recordings: &[Signals], play: f64, features: &[Feature]) -> Self {
        let mut all = Self::default();
        let parts: Vec<Self> =
            recordings.iter().map(|x| Self::of_recording(x, play, features)).collect();
        let counts: Vec<usize> = parts.iter().map(|part| part.residual.len()).collect();
        all.features = vec![Vec::new(); features.len()];
        for (n, part) in parts.into_iter().enumerate() {
            all.residual.extend(part.residual);
            stack(&mut all.nuisance, part.nuisance);
            for ((columns, more), feature) in
                all.features.iter_mut().zip(part.features).zip(features)
            {
                if matches!(feature.shape, Shape::Vibration(_)) {
                    let before: usize = counts[..n].iter().sum();
                    let after: usize = counts[n + 1..].iter().sum();
                    columns.extend(
                        more.into_iter()
                            .map(|column| [vec![0.0; before], column, vec![0.0; after]].concat()),
                    );
                } else {
                    stack(columns, more);
                }
            }
        }
        all
    }

    fn of_recording(x: &Signals, play: f64, features: &[Feature]) -> Self {
        let nominal = &x.nominal;
        let contact = x.contact(play);
        let sign = x.map(|n| x.speed[n].signum());
        let inertia = x.rows_of_wide(&x.map(|n| nominal.inertia_kg_m2 * x.acceleration[n]));
        let drag = x.rows(&x.map(|n| nominal.viscous_n_m_s_per_rad * x.speed[n]));
        let dry = x.rows(&x.map(|n| nominal.kinetic_n_m * sign[n]));
        let felt = x.rows(&x.felt(&contact));
        let torque = x.map(|n| nominal.constant_n_m_per_a * x.current[n]);
        // a current held over whole samples and centred is as wide as second differences are
        let held = nominal.tick_hz <= x.rate_hz;
        let made = if held { x.rows_of_wide(&torque) } else { x.rows(&torque) };
        let residual: Vec<f64> = made
            .iter()
            .enumerate()
            .map(|(n, t)| t - inertia[n] - drag[n] - dry[n] - felt[n])
            .collect();
        let mut nuisance = vec![inertia, drag, dry];
        if nominal.pole_pairs.is_some() {
            // equal shorts scale it against the current
            nuisance.push(felt);
            nuisance.extend(motor_faults(x, &torque));
        }
        let features = features
            .iter()
            .map(|feature| {
                let columns = feature.shape.columns(x, &contact);
                columns.iter().map(|column| x.rows(column)).collect()
            })
            .collect();
        Self { residual, nuisance, features }
    }
}

/// Columns of unequal shorted turns and an air gap off centre, with their products. Equal shorts
/// are a factor on all torques, and those are free.
fn motor_faults(x: &Signals, torque: &[f64]) -> Vec<Vec<f64>> {
    let share = |n: usize, phase: usize| {
        let conducts = |(at, _): (usize, f64)| PAIRS[at].0 == phase || PAIRS[at].1 == phase;
        if x.sector(n, 0.0).is_some_and(conducts) { 0.5 * torque[n] } else { 0.0 }
    };
    let mut all = vec![
        x.rows(&x.map(|n| torque[n] * x.angle[n].cos())),
        x.rows(&x.map(|n| torque[n] * x.angle[n].sin())),
    ];
    for phase in [1, 2] {
        let unequal = x.map(|n| share(n, phase) - share(n, 0));
        all.push(x.rows(&unequal));
        all.push(x.rows(&x.map(|n| unequal[n] * x.angle[n].cos())));
        all.push(x.rows(&x.map(|n| unequal[n] * x.angle[n].sin())));
    }
    all
}

/// Play over the nominal one that leaves least in training.
fn fitted_play(train: &[Signals]) -> f64 {
    let widen = |level: f64| 1.0 + 99.0 * level;
    let rigid = Rows::of(train, 0.0, &[]);
    let left = |level: f64| -> f64 {
        // with another play all is the same but what the load does
        let mut rows = rigid.clone();
        let felt = |play: f64| -> Vec<f64> {
            train.iter().flat_map(|x| x.rows(&x.felt(&x.contact(play)))).collect()
        };
        let (stiff, now) = (felt(0.0), felt(widen(level)));
        for (n, residual) in rows.residual.iter_mut().enumerate() {
            *residual += stiff[n] - now[n];
        }
        if train.iter().any(|x| x.nominal.pole_pairs.is_some()) {
            rows.nuisance[FELT] = now;
        }
        without_nuisance(&rows).iter().map(|r| r * r).sum()
    };
    let all = PLAY_LEVELS.map(|level| (left(level), level));
    let best = |all: &[(f64, f64)]| {
        all.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
    };
    let (mut least, mut level) = best(&all);
    let place = PLAY_LEVELS.iter().position(|l| *l == level).unwrap_or(0);
    let mut step =
        PLAY_LEVELS[(place + 1).min(PLAY_LEVELS.len() - 1)] - PLAY_LEVELS[place.max(1) - 1];
    for _ in 0..HALVINGS {
        step *= 0.5;
        let near = [level - step, level + step].map(|l| l.max(0.0)).map(|l| (left(l), l));
        (least, level) = best(&[(least, level), near[0], near[1]]);
    }
    widen(level)
}

/// Place of the load's column among those of faults and nuisance parameters.
const FELT: usize = 3;

fn stack(columns: &mut Vec<Vec<f64>>, more: Vec<Vec<f64>>) {
    if columns.is_empty() {
        *columns = more;
        return;
    }
    for (column, more) in columns.iter_mut().zip(more) {
        column.extend(more);
    }
}

/// Remainder after faults and nuisance parameters are projected out.
fn without_nuisance(rows: &Rows) -> Vec<f64> {
    let columns: Vec<&[f64]> = rows.nuisance.iter().map(Vec::as_slice).collect();
    let gram = Gram::of(&columns, &rows.residual);
    let active: Vec<usize> = (0..columns.len()).collect();
    let sizes = gram.solve(&active);
    let explained =
        |n: usize| -> f64 { columns.iter().zip(&sizes).map(|(c, size)| c[n] * size).sum() };
    rows.residual.iter().enumerate().map(|(n, r)| r - explained(n)).collect()
}

/// The two frequencies with most power, phases of each recording its own.
fn loudest(recordings: &[Signals], residual: &[f64]) -> impl Iterator<Item = f64> + use<> {
    let times: Vec<Vec<f64>> = recordings.iter().map(Signals::row_times).collect();
    let power = |hz: f64| -> f64 {
        let mut first = 0;
        let mut all = 0.0;
        for times in &times {
            let (mut sine, mut cosine) = (0.0, 0.0);
            for (n, time_s) in times.iter().enumerate() {
                let (s, c) = (TAU * hz * time_s).sin_cos();
                sine += s * residual[first + n];
                cosine += c * residual[first + n];
            }
            all += (sine * sine + cosine * cosine) / times.len().max(1) as f64;
            first += times.len();
        }
        all
    };
    let hz = |n: usize| LOWEST_HZ + STEP_HZ * n as f64;
    let mut spectrum: Vec<(f64, f64)> = (0..FREQUENCIES).map(|n| (hz(n), power(hz(n)))).collect();
    spectrum.sort_by(|a, b| b.1.total_cmp(&a.1));
    let first = spectrum[0].0;
    let second = spectrum.iter().map(|s| s.0).find(|hz| (hz - first).abs() >= APART_HZ);
    [Some(first), second].into_iter().flatten()
}
