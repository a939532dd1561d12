//! Shorted turns as loops of their own, each with a current that circulates in it.
//!
//! With `f_j` the current through the fault of phase j and `s_j` the shorted share of its turns,
//! those turns carry `i_j − f_j`. In the currents `z = (x, y, f_A, f_B, f_C)` of the sector's two
//! star loops and of the shorted ones,
//!
//! ```text
//! M·z' = u − R·z − K·ω            J·ω' = K·z + T_ext − c·ω
//! zᵀMz = Σ L_j·i_j² − 2·s_j·L_j·i_j·f_j + fᵀΛf     Λ_jj = s_j²·L_m + s_j·L_σ,  Λ_jk = −½·s_j·s_k·L_m
//! zᵀRz = Σ R_j·i_j² − 2·s_j·R_j·i_j·f_j + (s_j·R_j + R_f)·f_j²
//! K·z  = Σ k_j·(i_j − s_j·f_j)
//! ```
//!
//! A large resistance makes the loops stiff, so that the Radau IIA method of three stages stands in
//! place of the Taylor series. Its collocation polynomial is the segment.
//!
//! # Source
//!
//! Circuit: `docs/models/motor.md`. Method: E. Hairer, G. Wanner, *Solving Ordinary Differential
//! Equations II*, 2nd ed., section IV.5, Table 5.6.

use crate::{
    fault::PhysicalFaults,
    params::Motor,
    phase::PerPhase,
    series::{Series, value},
    shorted_turns::ShortedTurns,
    winding::{LocalCubic, SectorWinding, Segment, SegmentStart, Shaft},
};

/// Most currents: two of the star, one of each phase's shorted turns.
const MOST: usize = 5;
/// Stages of the method.
const STAGES: usize = 3;
const SQRT_6: f64 = 2.449_489_742_783_178;
/// Instants of the stages, over the span.
const NODES: [f64; STAGES] = [(4.0 - SQRT_6) / 10.0, (4.0 + SQRT_6) / 10.0, 1.0];
/// Weights of the stages' rates in their states.
const WEIGHTS: [[f64; STAGES]; STAGES] = [
    [
        (88.0 - 7.0 * SQRT_6) / 360.0,
        (296.0 - 169.0 * SQRT_6) / 1800.0,
        (-2.0 + 3.0 * SQRT_6) / 225.0,
    ],
    [
        (296.0 + 169.0 * SQRT_6) / 1800.0,
        (88.0 + 7.0 * SQRT_6) / 360.0,
        (-2.0 - 3.0 * SQRT_6) / 225.0,
    ],
    [(16.0 - SQRT_6) / 36.0, (16.0 + SQRT_6) / 36.0, 1.0 / 9.0],
];
/// Rounds of winding against shaft, each of which brings some two digits.
const MOST_ROUNDS: usize = 12;
/// Change of the speed, over it or over 1 rad/s, at which the rounds end.
const SETTLED: f64 = 1e-14;
/// Longest segment over the time constant of the fastest loop.
const LONGEST_OVER_LOOP: f64 = 0.25;
/// Shortest such segment over a period of the carrier: a loop faster than that follows at once.
const SHORTEST_OVER_PERIOD: f64 = 1.0 / 512.0;

type Currents = [f64; MOST];
type Matrix = [Currents; MOST];

/// Shorted turns of the three phases, with the currents through their faults.
#[derive(Clone, Debug)]
pub(crate) struct ShortedLoops {
    /// Share of the turns that are shorted, of each phase.
    share: PerPhase,
    fault_ohm: f64,
    phase_ohm: PerPhase,
    phase_henry: PerPhase,
    /// Main inductance of a phase, of which another phase sees the half, and leakage.
    main_henry: f64,
    leakage_henry: f64,
    /// Current through the fault of each phase, now and over the segment solved last.
    fault_a: PerPhase,
    segment_a: [Series; 3],
    /// Coupling of the three phases in that segment.
    coupling: [LocalCubic; 3],
}

/// The star's currents and the shorted loops in one sector.
struct Circuit {
    /// Number of currents.
    order: usize,
    /// Phase of each shorted loop, after those of the star.
    stars: usize,
    phases: [usize; 3],
    inductance_henry: Matrix,
    resistance_ohm: Matrix,
    /// Current of each phase for one of each current, and share of it that makes torque.
    in_phase: [PerPhase; MOST],
}

/// Machine and drive over a segment.
pub(crate) struct LoopDrive<'a> {
    pub(crate) at: &'a SectorWinding,
    pub(crate) shaft: &'a Shaft,
    pub(crate) start: SegmentStart,
    /// Voltages of the positive and the idle leg against the negative one; none where the idle
    /// phase is open.
    pub(crate) pair_v: f64,
    pub(crate) idle_v: Option<f64>,
    /// Flux change a radian of each phase, near the rotor's angle.
    pub(crate) coupling: [LocalCubic; 3],
    /// Resistance of the winding over that of the cold one.
    pub(crate) warmth_ratio: f64,
}

impl LoopDrive<'_> {
    /// Coupling of each current at a turn of the rotor.
    fn coupling_at(&self, circuit: &Circuit, turn_rad: f64) -> Currents {
        let phases = self.coupling.map(|k| near(&k, turn_rad));
        let of = |column: PerPhase| (0..3).map(|j| column[j] * phases[j]).sum();
        circuit.in_phase.map(of)
    }

    /// Voltages that drive the currents.
    fn volts(&self) -> Currents {
        [self.pair_v, self.idle_v.unwrap_or(0.0), 0.0, 0.0, 0.0]
    }
}

/// A coupling at a turn of the rotor.
fn near(k: &LocalCubic, turn_rad: f64) -> f64 {
    k[0] + turn_rad * (k[1] + turn_rad * (k[2] + turn_rad * k[3]))
}

impl ShortedLoops {
    /// The loops of a machine whose shorted turns stay in it; none where there are none.
    pub(crate) fn of(motor: &Motor, faults: &PhysicalFaults) -> Option<Self> {
        let ShortedTurns::Closed { resistance_ohm, leakage_ratio } = motor.shorted_turns else {
            return None;
        };
        let share = faults.healthy_turns_frac.map(|turns| (1.0 - turns).max(0.0));
        let turns = motor.shorted_turns.left_in_phases(faults).healthy_turns_frac;
        let any = share.iter().any(|share| *share > 0.0);
        any.then(|| Self {
            share,
            fault_ohm: resistance_ohm,
            phase_ohm: turns.map(|n| motor.resistance_ohm * n),
            phase_henry: turns.map(|n| motor.inductance_henry * n * n),
            main_henry: (1.0 - leakage_ratio) * motor.inductance_henry * (2.0 / 3.0),
            leakage_henry: leakage_ratio * motor.inductance_henry,
            fault_a: [0.0; 3],
            segment_a: [[0.0; 5]; 3],
            coupling: [[0.0; 4]; 3],
        })
    }

    /// Longest segment, with a carrier's period.
    pub(crate) fn longest_s(&self, period_s: f64) -> f64 {
        let fastest_s = (0..3).filter(|&j| self.share[j] > 0.0).map(|j| {
            // with the rest of the phase as its return, a loop is as fast as its leakage lets it
            let both = self.share[j] * (1.0 - self.share[j]);
            both * self.leakage_henry / (both * self.phase_ohm[j] + self.fault_ohm)
        });
        let fastest_s = fastest_s.fold(f64::INFINITY, f64::min);
        (LONGEST_OVER_LOOP * fastest_s).max(SHORTEST_OVER_PERIOD * period_s)
    }

    /// Mutual inductances of the shorted turns, `Λ`.
    fn loop_henry(&self, j: usize, k: usize) -> f64 {
        let main_henry = self.share[j] * self.share[k] * self.main_henry;
        if j == k { main_henry + self.share[j] * self.leakage_henry } else { -0.5 * main_henry }
    }

    /// The circuit of a sector.
    fn circuit(&self, at: &SectorWinding, open: bool, warmth_ratio: f64) -> Circuit {
        let stars = if open { 1 } else { 2 };
        let (mut order, mut phases) = (stars, [0; 3]);
        // terminal current and fault current of each phase for one of each current
        let (mut terminal, mut fault) = ([[0.0; 3]; MOST], [[0.0; 3]; MOST]);
        for (star, phase) in [at.positive, at.idle].into_iter().enumerate().take(stars) {
            (terminal[star][phase], terminal[star][at.negative]) = (1.0, -1.0);
        }
        for phase in (0..3).filter(|&j| self.share[j] > 0.0) {
            fault[order][phase] = 1.0;
            phases[order - stars] = phase;
            order += 1;
        }
        let (mut inductance_henry, mut resistance_ohm) = ([[0.0; MOST]; MOST], [[0.0; MOST]; MOST]);
        for q in 0..order {
            for r in 0..order {
                for j in 0..3 {
                    let s = self.share[j];
                    let own = terminal[q][j] * terminal[r][j]
                        - s * (terminal[q][j] * fault[r][j] + fault[q][j] * terminal[r][j]);
                    let both = fault[q][j] * fault[r][j];
                    inductance_henry[q][r] += self.phase_henry[j] * own;
                    resistance_ohm[q][r] +=
                        warmth_ratio * self.phase_ohm[j] * (own + s * both) + self.fault_ohm * both;
                    for k in 0..3 {
                        inductance_henry[q][r] += fault[q][j] * fault[r][k] * self.loop_henry(j, k);
                    }
                }
            }
        }
        let in_phase = core::array::from_fn(|q| {
            core::array::from_fn(|j| terminal[q][j] - self.share[j] * fault[q][j])
        });
        Circuit { order, stars, phases, inductance_henry, resistance_ohm, in_phase }
    }

    /// The currents at the start of a segment.
    fn start(&self, circuit: &Circuit, start: SegmentStart) -> Currents {
        let mut currents_a = [0.0; MOST];
        currents_a[0] = start.positive_a;
        if circuit.stars == 2 {
            currents_a[1] = start.idle_a;
        }
        for (place, &phase) in circuit.loops() {
            currents_a[place] = self.fault_a[phase];
        }
        currents_a
    }

    /// Winding and shaft from now on, over a span.
    pub(crate) fn solve(&mut self, drive: &LoopDrive<'_>, span_s: f64) -> Segment {
        let circuit = self.circuit(drive.at, drive.idle_v.is_none(), drive.warmth_ratio);
        let start_a = self.start(&circuit, drive.start);
        let stages = Stages::solve(&circuit, drive, &start_a, span_s);
        let of = |q: usize| integrated(start_a[q], &stages.rates.map(|rate| rate[q]), span_s);
        self.segment_a = [[0.0; 5]; 3];
        for (place, &phase) in circuit.loops() {
            self.segment_a[phase] = of(place);
        }
        self.coupling = drive.coupling;
        let speed = integrated(drive.start.speed_rad_per_s, &stages.accelerations, span_s);
        Segment {
            positive: of(0),
            idle: if circuit.stars == 2 { of(1) } else { [0.0; 5] },
            turn: turned(&speed),
            speed,
        }
    }

    /// Voltages over phases in which no current starts, as `R·(i − s·f) + L·(i' − s·f') + k·ω`
    /// with the idle leg open; of all three, and the rate of the pair's current.
    pub(crate) fn phases_v(&self, drive: &LoopDrive<'_>) -> PerPhase {
        let circuit = self.circuit(drive.at, true, drive.warmth_ratio);
        let now_a = self.start(&circuit, drive.start);
        let coupling = drive.coupling_at(&circuit, 0.0);
        let mut rates = driving(&circuit, drive, &now_a, &coupling, drive.start.speed_rad_per_s);
        Factors::of(&circuit.inductance_henry, circuit.order).solve(&mut rates);
        core::array::from_fn(|j| {
            let sum = |of: &Currents| -> f64 {
                (0..circuit.order).map(|q| circuit.in_phase[q][j] * of[q]).sum()
            };
            drive.warmth_ratio * self.phase_ohm[j] * sum(&now_a)
                + self.phase_henry[j] * sum(&rates)
                + drive.coupling[j][0] * drive.start.speed_rad_per_s
        })
    }

    /// Voltage that would keep the pair without current as it is.
    pub(crate) fn open_pair_v(&self, drive: &LoopDrive<'_>) -> f64 {
        // currents of the loops alone, whose terminals are open
        let circuit = self.circuit(drive.at, true, drive.warmth_ratio);
        let now_a = self.start(&circuit, drive.start);
        let coupling = drive.coupling_at(&circuit, 0.0);
        let mut rates = driving(&circuit, drive, &now_a, &coupling, drive.start.speed_rad_per_s);
        let mut inductance_henry = circuit.inductance_henry;
        // the pair's own rate is zero: its row tells the voltage
        inductance_henry[0] = [1.0, 0.0, 0.0, 0.0, 0.0];
        rates[0] = 0.0;
        Factors::of(&inductance_henry, circuit.order).solve(&mut rates);
        let row = |matrix: &Matrix, of: &Currents| -> f64 {
            (0..circuit.order).map(|q| matrix[0][q] * of[q]).sum()
        };
        row(&circuit.inductance_henry, &rates)
            + row(&circuit.resistance_ohm, &now_a)
            + coupling[0] * drive.start.speed_rad_per_s
    }

    /// Moves the currents to the end of a segment.
    pub(crate) fn go_on(&mut self, span_s: f64) {
        self.fault_a = self.segment_a.map(|series| value(&series, span_s));
    }

    /// Torque of the circulating currents at a time of the segment, `−Σ s_j·k_j·f_j`.
    pub(crate) fn torque_n_m(&self, segment: &Segment, at_s: f64) -> f64 {
        let turn_rad = value(&segment.turn, at_s);
        let of = |j: usize| {
            -self.share[j] * near(&self.coupling[j], turn_rad) * value(&self.segment_a[j], at_s)
        };
        (0..3).map(of).sum()
    }

    /// Torque of the circulating currents over a segment of a rotor at rest, N·m.
    pub(crate) fn torque_at_rest(&self) -> Series {
        core::array::from_fn(|m| {
            (0..3).map(|j| -self.share[j] * self.coupling[j][0] * self.segment_a[j][m]).sum()
        })
    }

    /// Torque of the circulating currents now, with a coupling of the phases.
    pub(crate) fn torque_now_n_m(&self, coupling: &[LocalCubic; 3]) -> f64 {
        (0..3).map(|j| -self.share[j] * coupling[j][0] * self.fault_a[j]).sum()
    }

    /// Heat that the loops add to that of the phases' currents, cold: of each phase in its
    /// winding, and in the faults.
    fn heat_w(&self, phases_a: &PerPhase, fault_a: &PerPhase) -> (PerPhase, f64) {
        let in_winding = core::array::from_fn(|j| {
            let (s, f) = (self.share[j], fault_a[j]);
            s * self.phase_ohm[j] * f * (f - 2.0 * phases_a[j])
        });
        (in_winding, self.fault_ohm * fault_a.iter().map(|f| f * f).sum::<f64>())
    }

    /// Heat that the loops add now, faults and all, were the winding cold.
    pub(crate) fn heat_now_w(&self, phases_a: &PerPhase) -> f64 {
        let (in_winding, in_faults) = self.heat_w(phases_a, &self.fault_a);
        in_winding.iter().sum::<f64>() + in_faults
    }

    /// Heat of the circulating currents at a time of the segment solved last, W.
    pub(crate) fn heat_in_segment_w(&self, phases_a: &PerPhase, at_s: f64) -> (PerPhase, f64) {
        self.heat_w(phases_a, &self.segment_a.map(|series| value(&series, at_s)))
    }

    /// Magnetic energy that the loops add to that of the phases' currents, at a time of the
    /// segment solved last.
    pub(crate) fn magnetic_j(&self, phases_a: &PerPhase, at_s: f64) -> f64 {
        let f = self.segment_a.map(|series| value(&series, at_s));
        let mut energy_j = 0.0;
        for j in 0..3 {
            energy_j -= self.share[j] * self.phase_henry[j] * phases_a[j] * f[j];
            for k in 0..3 {
                energy_j += 0.5 * f[j] * self.loop_henry(j, k) * f[k];
            }
        }
        energy_j
    }
}

impl Circuit {
    /// Places of the shorted loops among the currents, with their phases.
    fn loops(&self) -> impl Iterator<Item = (usize, &usize)> {
        (self.stars..self.order).zip(&self.phases)
    }
}

/// Voltages less those of resistances and speed, `u − R·z − K·ω`.
fn driving(
    circuit: &Circuit,
    drive: &LoopDrive<'_>,
    currents_a: &Currents,
    coupling: &Currents,
    speed_rad_per_s: f64,
) -> Currents {
    let volts = drive.volts();
    let mut driving_v = [0.0; MOST];
    for q in 0..circuit.order {
        let drop_v: f64 =
            circuit.resistance_ohm[q].iter().zip(currents_a).map(|(r, i)| r * i).sum();
        let given_v = if q < circuit.stars { volts[q] } else { 0.0 };
        driving_v[q] = given_v - drop_v - coupling[q] * speed_rad_per_s;
    }
    driving_v
}

/// Rates of currents and speed at the stages.
struct Stages {
    rates: [Currents; STAGES],
    accelerations: [f64; STAGES],
}

impl Stages {
    fn solve(circuit: &Circuit, drive: &LoopDrive<'_>, start_a: &Currents, span_s: f64) -> Self {
        let n = circuit.order;
        let mut matrix = [[0.0; STAGES * MOST]; STAGES * MOST];
        for (i, weights) in WEIGHTS.iter().enumerate() {
            for (k, weight) in weights.iter().enumerate() {
                for q in 0..n {
                    for r in 0..n {
                        let own = if i == k { circuit.inductance_henry[q][r] } else { 0.0 };
                        matrix[i * n + q][k * n + r] =
                            own + span_s * weight * circuit.resistance_ohm[q][r];
                    }
                }
            }
        }
        let factors = Factors::of(&matrix, STAGES * n);
        let w0 = drive.start.speed_rad_per_s;
        let (mut speeds, mut turns) = ([w0; STAGES], NODES.map(|c| c * span_s * w0));
        let mut stages = Self { rates: [[0.0; MOST]; STAGES], accelerations: [0.0; STAGES] };
        for _ in 0..MOST_ROUNDS {
            let couplings = turns.map(|turn| drive.coupling_at(circuit, turn));
            let mut right = [0.0; STAGES * MOST];
            for i in 0..STAGES {
                let of = driving(circuit, drive, start_a, &couplings[i], speeds[i]);
                right[i * n..(i + 1) * n].copy_from_slice(&of[..n]);
            }
            factors.solve(&mut right);
            for (i, rates) in stages.rates.iter_mut().enumerate() {
                rates[..n].copy_from_slice(&right[i * n..(i + 1) * n]);
            }
            let gap =
                stages.turn_shaft(drive, start_a, &couplings, (&mut speeds, &mut turns), span_s);
            if gap <= SETTLED * w0.abs().max(1.0) {
                break;
            }
        }
        stages
    }

    /// The shaft under the torque of the stages' currents; returns the largest change of a speed.
    fn turn_shaft(
        &mut self,
        drive: &LoopDrive<'_>,
        start_a: &Currents,
        couplings: &[Currents; STAGES],
        (speeds, turns): (&mut [f64; STAGES], &mut [f64; STAGES]),
        span_s: f64,
    ) -> f64 {
        let (shaft, w0) = (drive.shaft, drive.start.speed_rad_per_s);
        for i in 0..STAGES {
            let motor_n_m: f64 = (0..MOST)
                .map(|q| {
                    let gained: f64 = (0..STAGES).map(|k| WEIGHTS[i][k] * self.rates[k][q]).sum();
                    couplings[i][q] * (start_a[q] + span_s * gained)
                })
                .sum();
            let drag_n_m = shaft.viscous_n_m_s_per_rad * speeds[i];
            self.accelerations[i] =
                (motor_n_m + shaft.external_n_m - drag_n_m) * shaft.per_inertia[0];
        }
        let mut gap: f64 = 0.0;
        for i in 0..STAGES {
            let gained: f64 = (0..STAGES).map(|k| WEIGHTS[i][k] * self.accelerations[k]).sum();
            let speed = w0 + span_s * gained;
            gap = gap.max((speed - speeds[i]).abs());
            speeds[i] = speed;
        }
        let series = turned(&integrated(w0, &self.accelerations, span_s));
        *turns = NODES.map(|c| value(&series, c * span_s));
        gap
    }
}

/// The cubic that starts at a value and has given rates at the stages.
fn integrated(start: f64, rates: &[f64; STAGES], span_s: f64) -> Series {
    let mut coefficients = [0.0; STAGES];
    for i in 0..STAGES {
        let (a, b) = (NODES[(i + 1) % STAGES], NODES[(i + 2) % STAGES]);
        let share = rates[i] / ((NODES[i] - a) * (NODES[i] - b));
        coefficients[0] += share * a * b;
        coefficients[1] -= share * (a + b);
        coefficients[2] += share;
    }
    let [c0, c1, c2] = coefficients;
    let per_s = 1.0 / span_s;
    [start, c0, 0.5 * c1 * per_s, c2 * per_s * per_s / 3.0, 0.0]
}

/// The turn of a speed.
fn turned(speed: &Series) -> Series {
    [0.0, speed[0], 0.5 * speed[1], speed[2] / 3.0, 0.25 * speed[3]]
}

/// Triangular factors of a matrix of up to `N` rows, with its rows exchanged.
struct Factors<const N: usize> {
    rows: [[f64; N]; N],
    exchanged: [usize; N],
    order: usize,
}

impl<const N: usize> Factors<N> {
    /// Gaussian elimination with partial pivoting.
    fn of(matrix: &[[f64; N]; N], order: usize) -> Self {
        let (mut rows, mut exchanged) = (*matrix, [0; N]);
        for column in 0..order {
            let mut pivot = column;
            for row in column + 1..order {
                if rows[row][column].abs() > rows[pivot][column].abs() {
                    pivot = row;
                }
            }
            rows.swap(column, pivot);
            exchanged[column] = pivot;
            let of_pivot = rows[column];
            for row in &mut rows[column + 1..order] {
                let factor = row[column] / of_pivot[column];
                row[column] = factor;
                for (entry, above) in row[column + 1..order].iter_mut().zip(&of_pivot[column + 1..])
                {
                    *entry -= factor * above;
                }
            }
        }
        Self { rows, exchanged, order }
    }

    /// Puts the solution in place of the right-hand side.
    fn solve(&self, right: &mut [f64; N]) {
        for column in 0..self.order {
            right.swap(column, self.exchanged[column]);
        }
        for row in 0..self.order {
            let known: f64 = (0..row).map(|k| self.rows[row][k] * right[k]).sum();
            right[row] -= known;
        }
        for row in (0..self.order).rev() {
            let known: f64 = (row + 1..self.order).map(|k| self.rows[row][k] * right[k]).sum();
            right[row] = (right[row] - known) / self.rows[row][row];
        }
    }
}
