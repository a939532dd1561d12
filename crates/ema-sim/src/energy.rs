//! Where the energy of a run goes: each flow integrated on its own, none by difference.

use crate::{
    drive_train::DriveTrain,
    fault::PhysicalFaults,
    params::Actuator,
    phase::PerPhase,
    probe::{Circuit, Probe, SurfaceSegment},
    series::value,
    winding::{SectorWinding, Segment},
};

/// Energies of a run, J.
///
/// ```text
/// Σ supply = Σ copper + short circuit + friction + viscous + gear + damping + load + impact
///          + magnetic + kinetic + elastic
/// ```
///
/// Every term is integrated from its own power; [`residual_j`](Self::residual_j) is what the
/// equation lacks, a measure of the simulation's error.
///
/// # Source
///
/// First law of thermodynamics for the equations of `docs/models/motor.md` and
/// `docs/models/transmission.md`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyLedger {
    /// Given by the legs of the phases A, B, C while they switch, `∫v_j·i_j`.
    pub supply_j: PerPhase,
    /// Given through the diodes of the idle phase; negative when it feeds the supply.
    pub diode_supply_j: f64,
    /// Heat of the windings of the phases A, B, C, `∫R_j·i_j²`; of turns that are closed over a
    /// resistance with the current in them.
    pub copper_j: PerPhase,
    /// Heat in the resistances that turns are closed over, `∫R_f·f_j²`; zero where the model has
    /// shorted turns removed.
    pub short_circuit_j: f64,
    /// Heat of dry friction, `∫F_d·|ω|`.
    pub friction_j: f64,
    /// Heat of viscous drag, `∫c·ω²`.
    pub viscous_j: f64,
    /// Heat of the gear's teeth: what the load costs at the motor beyond its own work.
    pub gear_j: f64,
    /// Heat in an elastic shaft: of its damping, and of what is left in it when it lets go.
    pub damping_j: f64,
    /// Work done on the load.
    pub load_j: f64,
    /// Kinetic energy lost at the end stops.
    pub impact_j: f64,
    /// Gain of the windings, `Σ½·L_j·i_j²`, with that of shorted turns that are closed.
    pub magnetic_j: f64,
    /// Gain of the moving masses, `½·J·ω²`.
    pub kinetic_j: f64,
    /// Gain of an elastic shaft, `½·K·d²`.
    pub elastic_j: f64,
}

impl EnergyLedger {
    /// All that came in less all that went somewhere.
    pub fn residual_j(&self) -> f64 {
        let supplied = self.supply_j.iter().sum::<f64>() + self.diode_supply_j;
        let stored = self.magnetic_j + self.kinetic_j + self.elastic_j;
        supplied - self.dissipated_j() - self.load_j - stored
    }

    /// All that became heat.
    pub fn dissipated_j(&self) -> f64 {
        self.copper_j.iter().sum::<f64>()
            + self.short_circuit_j
            + self.friction_j
            + self.viscous_j
            + self.gear_j
            + self.damping_j
            + self.impact_j
    }
}

/// Gauss and Legendre's five points on `[0, 1]` with their weights: exact to the ninth order.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_004, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_45),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// Keeps the ledger of a run.
#[derive(Clone, Debug)]
pub(crate) struct EnergyProbe {
    pub(crate) ledger: EnergyLedger,
    resistance_ohm: PerPhase,
    inductance_henry: PerPhase,
    longest_segment_ratio: f64,
}

impl EnergyProbe {
    pub(crate) fn new(
        actuator: &Actuator,
        faults: &PhysicalFaults,
        longest_segment_ratio: f64,
    ) -> Self {
        let turns = actuator.motor.shorted_turns.left_in_phases(faults).healthy_turns_frac;
        Self {
            ledger: EnergyLedger::default(),
            resistance_ohm: turns.map(|n| actuator.motor.resistance_ohm * n),
            inductance_henry: turns.map(|n| actuator.motor.inductance_henry * n * n),
            longest_segment_ratio,
        }
    }

    /// Adds the flows of an instant that stands for a time.
    fn add(&mut self, flow: &Instant, circuit: &Circuit<'_>, train: &DriveTrain, for_s: f64) {
        let (at, w) = (circuit.at, flow.speed_rad_per_s);
        let [positive_a, negative_a, idle_a] = flow.currents_a;
        let roles = [(at.positive, positive_a), (at.negative, negative_a), (at.idle, idle_a)];
        let ledger = &mut self.ledger;
        for (phase, current_a) in roles {
            let resistance_ohm = self.resistance_ohm[phase] * circuit.warmth_ratio;
            ledger.copper_j[phase] += for_s * resistance_ohm * current_a * current_a;
        }
        if let Some(loops) = circuit.shorted {
            let (copper_w, faults_w) = loops.heat_in_segment_w(&flow.phases_a(at), flow.at_s);
            for (energy_j, power_w) in ledger.copper_j.iter_mut().zip(copper_w) {
                *energy_j += for_s * circuit.warmth_ratio * power_w;
            }
            ledger.short_circuit_j += for_s * faults_w;
        }
        ledger.supply_j[at.positive] += for_s * circuit.legs.positive_v * positive_a;
        ledger.supply_j[at.negative] += for_s * circuit.legs.negative_v * negative_a;
        if circuit.connected {
            ledger.supply_j[at.idle] += for_s * circuit.idle_v * idle_a;
        } else {
            ledger.diode_supply_j += for_s * circuit.idle_v * idle_a;
        }
        let torques = train.torques();
        ledger.friction_j += for_s * torques.friction_n_m * w;
        ledger.viscous_j += for_s * train.viscous_n_m_s_per_rad * w * w;
        ledger.gear_j += for_s * torques.gear_n_m * w;
        ledger.load_j += for_s * torques.load_n_m * w;
    }
}

/// Currents of the positive, the negative and the idle phase, and the speed, at an instant.
struct Instant {
    at_s: f64,
    currents_a: [f64; 3],
    speed_rad_per_s: f64,
}

impl Instant {
    fn of(segment: &Segment, at_s: f64) -> Self {
        let (positive, idle) = (value(&segment.positive, at_s), value(&segment.idle, at_s));
        Self {
            at_s,
            currents_a: [positive, -(positive + idle), idle],
            speed_rad_per_s: value(&segment.speed, at_s),
        }
    }

    /// Currents of the phases A, B, C.
    fn phases_a(&self, at: &SectorWinding) -> PerPhase {
        let mut phases_a = [0.0; 3];
        for (phase, current_a) in
            [at.positive, at.negative, at.idle].into_iter().zip(self.currents_a)
        {
            phases_a[phase] = current_a;
        }
        phases_a
    }
}

impl Probe for EnergyProbe {
    fn segment(
        &mut self,
        segment: &Segment,
        span_s: f64,
        circuit: &Circuit<'_>,
        train: &DriveTrain,
    ) {
        for (place, weight) in GAUSS {
            let instant = Instant::of(segment, place * span_s);
            self.add(&instant, circuit, train, weight * span_s);
        }
        let end = Instant::of(segment, span_s);
        let at = circuit.at;
        self.ledger.magnetic_j = [at.positive, at.negative, at.idle]
            .iter()
            .zip(end.currents_a)
            .map(|(&phase, i)| 0.5 * self.inductance_henry[phase] * i * i)
            .sum();
        if let Some(loops) = circuit.shorted {
            self.ledger.magnetic_j += loops.magnetic_j(&end.phases_a(at), span_s);
        }
        let w = end.speed_rad_per_s;
        self.ledger.kinetic_j = 0.5 * train.inertia_kg_m2 * w * w;
    }

    fn surface(&mut self, s: &SurfaceSegment, span_s: f64) {
        let (r, ledger) = (s.per_gear_ratio, &mut self.ledger);
        for (place, weight) in GAUSS {
            let at = |series| value(series, place * span_s);
            let (motor, speed, torque) = (r * at(&s.motor_speed), at(&s.speed), at(&s.torque));
            let for_s = weight * span_s;
            ledger.gear_j += for_s * s.gear_loss_ratio * torque * motor;
            ledger.load_j += for_s * s.load_n_m * speed;
            if torque != 0.0 {
                let rate = motor - speed;
                ledger.damping_j += for_s * s.damping_n_m_s_per_rad * rate * rate;
            }
        }
        let speed = value(&s.speed, span_s);
        ledger.kinetic_j += 0.5 * s.inertia_kg_m2 * speed * speed;
        ledger.elastic_j = 0.5 * s.stiffness_n_m_per_rad * s.beyond_rad * s.beyond_rad;
    }

    fn released(&mut self, energy_j: f64) {
        self.ledger.damping_j += energy_j;
        self.ledger.elastic_j -= energy_j;
    }

    fn impact(&mut self, lost_j: f64) {
        self.ledger.impact_j += lost_j;
        self.ledger.kinetic_j -= lost_j;
    }

    fn longest_segment_ratio(&self) -> f64 {
        self.longest_segment_ratio
    }
}
