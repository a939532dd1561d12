//! The machines at work: Runge-Kutta of fourth order at a fixed share of the controller's tick,
//! cut where the shaft stops, the play closes, or the motor commutates.

mod bristles;
mod control_loop;
mod current_sensor;
mod delay;
mod random_load;

use core::f64::consts::{FRAC_PI_3, FRAC_PI_6, PI, TAU};

use libm::{floor, sin, sqrt};

use self::{
    bristles::{Bristles, Level},
    control_loop::Loop,
    current_sensor::Reading,
    random_load::series,
};
use crate::{
    chance::{Chance, Purpose},
    command::Course,
    effect::{Burden, Form, Here, Hidden},
    machine::{Machine, Numbers},
};

/// Faults as coordinates: `k1` to `k5`, `k6·cos φ`, `k6·sin φ`.
pub(crate) type Faults = [f64; 7];

/// A machine in a state of health with what is hidden in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Subject<'a> {
    pub(crate) numbers: Numbers,
    pub(crate) faults: Faults,
    pub(crate) hidden: &'a [Hidden],
}

/// Test of a machine in one recording.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Test<'a> {
    pub(crate) course: &'a Course,
    pub(crate) start_rad: f64,
    /// Seed of what an effect draws anew in each recording.
    pub(crate) seed: u64,
    /// Steps of the integrator in a tick.
    pub(crate) steps: usize,
}

/// Channels at the rate of the recordings, before noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trace {
    /// Current as its sensor shows it, before the controller acts on the sample.
    pub(crate) current: Vec<f64>,
    /// Motor angle of the actuator; of the servo the position as its sensor shows it.
    pub(crate) position: Vec<f64>,
    /// Energy from the motor, and what dry and viscous friction took, J; without effects.
    pub(crate) energy: Energy,
}

/// Where the energy of a run went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Energy {
    pub(crate) motor: f64,
    pub(crate) rubbed: f64,
    pub(crate) load: f64,
    pub(crate) kinetic: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Going {
    Back,
    Stuck,
    Forth,
}

impl Going {
    fn sign(self) -> f64 {
        match self {
            Self::Back => -1.0,
            Self::Stuck => 0.0,
            Self::Forth => 1.0,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Touch {
    None,
    /// The motor pushes the load forth, or back.
    Forth,
    Back,
}

/// The load behind an elastic shaft.
#[derive(Clone, Copy, Debug)]
struct Elastic {
    stiffness: f64,
    damping: f64,
    /// Twist at which the hardening doubles the stiffness' slope.
    hard: f64,
    inertia: f64,
}

/// State: motor angle from the start, speed, angle and speed of an elastically driven load.
type State = [f64; 4];

struct Run<'a> {
    subject: Subject<'a>,
    start: f64,
    inertia: f64,
    kinetic: f64,
    fixed: f64,
    half_play: f64,
    turns: [f64; 3],
    /// True where all phases have the same turns and nothing else changes with the sector.
    even: bool,
    x: State,
    time: f64,
    going: Going,
    touch: Touch,
    left_at: f64,
    load: f64,
    sector: i64,
    hall_lead: [f64; 3],
    commutated: f64,
    reference: f64,
    bristles: Option<Bristles>,
    elastic: Option<Elastic>,
    /// Phases of vibrations, and random loads at the rate of the recordings.
    phases: [f64; 2],
    series: Vec<f64>,
    disturbance: f64,
    hysteresis: f64,
    energy: Energy,
}

/// Runs a test.
pub(crate) fn simulate(subject: &Subject<'_>, test: &Test<'_>) -> Trace {
    let samples = test.course.command_rad.len();
    let mut run = Run::new(subject, test);
    let mut loop_ = Loop::new(subject, test.start_rad);
    let per_sample = subject.numbers.ticks_per_sample();
    let tick_s = 1.0 / subject.numbers.tick_hz;
    let mut trace = Trace::default();
    let mut reading = Reading::new(subject.hidden);
    let between = |values: &[f64], tick: usize| {
        let (n, part) = (tick / per_sample, (tick % per_sample) as f64 / per_sample as f64);
        let next = values.get(n + 1).copied().unwrap_or(values[n]);
        values[n] + (next - values[n]) * part
    };
    let steps = run.steps(test.steps, tick_s);
    for tick in 0..samples * per_sample {
        run.begin(between(&test.course.load_n_m, tick), tick);
        let shown = loop_.shown(&run);
        let current = reading.of(run.current_now(), tick_s);
        if tick % per_sample == 0 {
            trace.current.push(current);
            trace.position.push(match subject.numbers.machine {
                Machine::Ema48 => run.start + run.x[0],
                Machine::Servo => shown,
            });
        }
        let command = between(&test.course.command_rad, tick) + loop_.origin;
        let reference = loop_.step(command, shown, run.x[1]);
        run.hold(reference, tick_s, steps);
    }
    run.energy.kinetic = 0.5 * run.inertia * run.x[1] * run.x[1];
    trace.energy = run.energy;
    trace
}

impl<'a> Run<'a> {
    fn new(subject: &Subject<'a>, test: &Test<'_>) -> Self {
        let (n, k) = (&subject.numbers, &subject.faults);
        let wear = (1.0 + 2.0 * k[0]).max(0.0);
        let turns = [k[2], k[3], k[4]].map(|k| (1.0 - k).max(0.01));
        let by_sector = subject.hidden.iter().any(Hidden::by_sector);
        let mut chance = Chance::new(test.seed, Purpose::Disturbance, 0);
        let phases = [chance.angle(), chance.angle()];
        let mut run = Self {
            subject: *subject,
            start: test.start_rad,
            inertia: n.inertia(),
            kinetic: n.kinetic * wear,
            fixed: n.fixed * wear,
            half_play: 0.5 * n.play * (1.0 + 99.0 * k[1]).max(0.0) * n.gear,
            turns,
            even: n.machine == Machine::Servo
                || (!by_sector && turns[0] == turns[1] && turns[1] == turns[2]),
            x: [0.0; 4],
            time: 0.0,
            going: Going::Stuck,
            touch: Touch::None,
            left_at: 0.0,
            load: 0.0,
            sector: 0,
            hall_lead: [0.0; 3],
            commutated: f64::NEG_INFINITY,
            reference: 0.0,
            bristles: None,
            elastic: None,
            phases,
            series: Vec::new(),
            disturbance: 0.0,
            hysteresis: 0.0,
            energy: Energy::default(),
        };
        run.equip(test.course.command_rad.len(), &mut chance);
        run.sector = run.sector_of(0.0);
        run
    }

    /// Takes on effects that have a memory.
    fn equip(&mut self, samples: usize, chance: &mut Chance) {
        for effect in self.subject.hidden {
            let a = effect.size;
            match &effect.form {
                Form::FourElements { damping, fall_speed } | Form::Dahl { damping, fall_speed } => {
                    let stiffness = self.kinetic / a;
                    self.bristles = Some(Bristles {
                        deflection: a,
                        damping: 2.0 * damping * sqrt(stiffness * self.inertia),
                        fall_speed: *fall_speed,
                        dahl: matches!(effect.form, Form::Dahl { .. }),
                        force: [0.0; 4],
                        at: 0.0,
                    });
                }
                Form::Elastic { load_share, damping_ratio, hardening } => {
                    let whole = self.inertia;
                    let load = load_share * whole;
                    self.inertia = whole - load;
                    let both = load * self.inertia / whole;
                    self.elastic = Some(Elastic {
                        stiffness: 1.0 / a,
                        damping: 2.0 * damping_ratio * sqrt(both / a),
                        hard: 0.3 * a / sqrt(hardening.max(1e-9)),
                        inertia: load,
                    });
                }
                Form::Halls { shares } => self.hall_lead = shares.map(|share| a * share),
                Form::Pulses { .. } | Form::Telegraph { .. } | Form::Chaotic { .. } => {
                    self.series = series(&effect.form, samples, chance);
                    for value in &mut self.series {
                        *value *= a;
                    }
                }
                _ => {}
            }
        }
    }

    /// Steps in a tick: more where an elastic shaft swings fast.
    fn steps(&self, least: usize, tick_s: f64) -> usize {
        let swing = self
            .elastic
            .map_or(0.0, |e| sqrt(e.stiffness * (1.0 / e.inertia + 1.0 / self.inertia)));
        least.max(libm::ceil(swing * tick_s / 0.3) as usize)
    }

    fn begin(&mut self, load: f64, tick: usize) {
        self.load = load / self.subject.numbers.gear;
        self.disturbance = 0.0;
        if !self.series.is_empty() {
            let place = tick / self.subject.numbers.ticks_per_sample();
            self.disturbance = self.series[place.min(self.series.len() - 1)];
        }
    }

    fn hold(&mut self, reference: f64, tick_s: f64, steps: usize) {
        self.reference = reference;
        for effect in self.subject.hidden {
            if let Form::HystereticTorque { width_a } = effect.form {
                let half = 0.5 * width_a;
                self.hysteresis = self.hysteresis.clamp(reference - half, reference + half);
            }
        }
        let step_s = tick_s / steps as f64;
        for _ in 0..steps {
            self.advance(step_s);
        }
    }

    // ---- geometry ----

    fn surface(&self) -> f64 {
        self.surface_at(&self.x)
    }

    fn surface_at(&self, x: &State) -> f64 {
        if self.elastic.is_some() {
            return x[2];
        }
        let shaft = match self.touch {
            Touch::None => self.left_at,
            Touch::Forth => x[0] - self.half_play,
            Touch::Back => x[0] + self.half_play,
        };
        shaft / self.subject.numbers.gear
    }

    /// Load that the motor feels in a touch.
    fn felt(&self, touch: Touch) -> f64 {
        let efficiency = self.subject.numbers.efficiency;
        let against = match touch {
            Touch::None => return 0.0,
            Touch::Forth => self.load > 0.0,
            Touch::Back => self.load < 0.0,
        };
        if against { self.load / efficiency } else { self.load * efficiency }
    }

    /// Motor angle, from the start, at which a sector begins.
    fn sector_begin(&self, sector: i64) -> f64 {
        let lead = self.hall_lead[sector.rem_euclid(3) as usize];
        let electrical = FRAC_PI_6 + FRAC_PI_3 * sector as f64 - lead;
        electrical / self.subject.numbers.pole_pairs - self.start
    }

    fn sector_of(&self, angle: f64) -> i64 {
        let electrical = (self.start + angle) * self.subject.numbers.pole_pairs;
        let mut sector = floor((electrical - FRAC_PI_6) / FRAC_PI_3) as i64;
        while angle >= self.sector_begin(sector + 1) {
            sector += 1;
        }
        while angle < self.sector_begin(sector) {
            sector -= 1;
        }
        sector
    }

    // ---- motor ----

    /// Torque over current at a motor angle, and resistance.
    fn constant(&self, angle: f64, current: f64) -> (f64, f64) {
        let n = &self.subject.numbers;
        let motor = self.start + angle;
        let (mut share, mut ohm) = (self.turns[0], n.ohm * self.turns[0]);
        if !self.even {
            (share, ohm) = self.pair(motor);
        }
        let (c, s) = (self.subject.faults[5], self.subject.faults[6]);
        if c != 0.0 || s != 0.0 {
            let (sin, cos) = libm::sincos(motor);
            share *= 1.0 + c * cos - s * sin;
        }
        let factor: f64 = self.subject.hidden.iter().map(|e| e.constant_factor(current)).product();
        (n.constant * share * factor, ohm)
    }

    /// The conducting pair's back-EMF over that of healthy flat tops, and its resistance.
    fn pair(&self, motor: f64) -> (f64, f64) {
        let place = self.sector.rem_euclid(6) as usize;
        let (plus, minus) = ([0, 0, 1, 1, 2, 2][place], [1, 2, 2, 0, 0, 1][place]);
        let (np, nm) = (self.turns[plus], self.turns[minus]);
        let ohm = self.subject.numbers.ohm * 0.5 * (np + nm);
        let mut rounded = None;
        for effect in self.subject.hidden {
            match effect.form {
                Form::RoundedEmf => rounded = Some(effect.size),
                Form::Halls { .. } => rounded = rounded.or(Some(0.0)),
                _ => {}
            }
        }
        let Some(a) = rounded else { return (0.5 * (np + nm), ohm) };
        let electrical = motor * self.subject.numbers.pole_pairs;
        let wave = |phase: usize| {
            let x = electrical - TAU / 3.0 * phase as f64;
            (1.0 - a) * trapezoid(x) + a * sin(x)
        };
        (0.5 * (np * wave(plus) - nm * wave(minus)), ohm)
    }

    /// Torque and current at a state.
    fn motor(&self, angle: f64, speed: f64) -> (f64, f64) {
        let (constant, ohm) = self.constant(angle, self.reference);
        let limit = self.subject.numbers.supply_v;
        let emf = constant * speed;
        let current = if (ohm * self.reference + emf).abs() <= limit {
            self.reference
        } else {
            self.reference.clamp((-limit - emf) / ohm, (limit - emf) / ohm)
        };
        let mut acting = current;
        for effect in self.subject.hidden {
            if let Form::HystereticTorque { .. } = effect.form {
                acting -= effect.size * self.hysteresis;
            }
        }
        (constant * acting, current)
    }

    fn current_now(&self) -> f64 {
        self.motor(self.x[0], self.x[1]).1
    }

    // ---- torques ----

    fn burden(&self, tau: f64, x: &State, torque: f64) -> Burden {
        let mut burden = Burden::NONE;
        if self.subject.hidden.is_empty() {
            return burden;
        }
        let load =
            if self.touch == Touch::None && self.elastic.is_none() { 0.0 } else { self.load };
        let here = Here {
            time_s: self.time + tau,
            motor: self.start + x[0],
            speed: x[1],
            position: self.position(x),
            torque,
            load,
            surface_load: load * self.subject.numbers.gear,
            commutated_s: self.time + tau - self.commutated,
        };
        burden.against += self.disturbance;
        for effect in self.subject.hidden {
            if let Form::Shaking { hz } = effect.form {
                let turn = TAU * hz * here.time_s;
                let shake = sin(turn + self.phases[0]) + 0.15 * sin(2.0 * turn + self.phases[1]);
                burden.against += effect.size * shake;
            } else {
                effect.act(&here, &mut burden);
            }
        }
        burden
    }

    /// Position of the surface, of the servo with its start.
    fn position(&self, x: &State) -> f64 {
        let origin = if self.subject.numbers.machine == Machine::Servo { self.start } else { 0.0 };
        origin + self.surface_at(x)
    }

    /// Kinetic and static friction of a direction (0 backward, 1 forward).
    fn dry(&self, burden: &Burden, side: usize) -> Level {
        let kinetic = (self.kinetic * burden.factor + burden.dry[side]).max(0.0);
        let fixed = (self.fixed * burden.factor + burden.dry[side]).max(kinetic);
        Level { kinetic, fixed }
    }

    /// Torque that the elastic shaft takes from the motor.
    fn passed(&self, x: &State) -> f64 {
        let Some(e) = &self.elastic else { return 0.0 };
        let twist = x[0] - x[2];
        let beyond = twist - twist.clamp(-self.half_play, self.half_play);
        if beyond == 0.0 {
            return 0.0;
        }
        let hard = beyond / e.hard;
        let spring = e.stiffness * beyond * (1.0 + hard * hard);
        let all = spring + e.damping * (x[1] - x[3]);
        if all * spring > 0.0 { all } else { 0.0 }
    }

    /// Everything against the shaft but dry friction: of a shaft that moves or rests.
    fn against(&self, burden: &Burden, x: &State, touch: Touch) -> f64 {
        let mut against = burden.against + self.passed(x);
        if self.elastic.is_none() {
            against += self.felt(touch);
        }
        if let Some(bristles) = &self.bristles {
            let side = usize::from(x[1] >= 0.0);
            against += bristles.torque(x[0], x[1], self.dry(burden, side));
        }
        against
    }

    fn rates(&self, tau: f64, x: &State) -> State {
        let mut rates = [0.0; 4];
        if let Some(e) = &self.elastic {
            rates[2] = x[3];
            rates[3] = (self.passed(x) - self.load) / e.inertia;
        }
        if self.going == Going::Stuck {
            return rates;
        }
        let (torque, _) = self.motor(x[0], x[1]);
        let burden = self.burden(tau, x, torque);
        let mut net =
            torque - self.subject.numbers.viscous * x[1] - self.against(&burden, x, self.touch);
        if self.bristles.is_none() {
            let side = usize::from(self.going == Going::Forth);
            net -= self.going.sign() * self.dry(&burden, side).kinetic;
        }
        rates[0] = x[1];
        rates[1] = net / self.inertia;
        rates
    }

    // ---- motion ----

    fn runge_kutta(&self, h: f64) -> State {
        let x = &self.x;
        let plus = |k: &State, h: f64| -> State { core::array::from_fn(|i| x[i] + h * k[i]) };
        let k1 = self.rates(0.0, x);
        let k2 = self.rates(0.5 * h, &plus(&k1, 0.5 * h));
        let k3 = self.rates(0.5 * h, &plus(&k2, 0.5 * h));
        let k4 = self.rates(h, &plus(&k3, h));
        core::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    /// Distances to the next events, positive before them: standstill, end of play, sector.
    fn distances(&self, x: &State) -> [f64; 3] {
        let sign = self.going.sign();
        let forth = self.going == Going::Forth;
        let play = if self.touch == Touch::None && self.elastic.is_none() {
            self.half_play - sign * (x[0] - self.left_at)
        } else {
            f64::INFINITY
        };
        let sector = if self.even {
            f64::INFINITY
        } else if forth {
            self.sector_begin(self.sector + 1) - x[0]
        } else {
            x[0] - self.sector_begin(self.sector)
        };
        [x[1] * sign, play, sector]
    }

    fn advance(&mut self, span: f64) {
        let mut left = span;
        // more than this many events in a step are a shaft that trembles at rest
        for _ in 0..40 {
            if self.going == Going::Stuck {
                self.try_to_leave();
                if self.going == Going::Stuck {
                    if self.elastic.is_some() {
                        self.x = self.runge_kutta(left);
                    }
                    self.time += left;
                    return;
                }
            }
            let end = self.runge_kutta(left);
            let after = self.distances(&end);
            let Some((event, h)) = self.first_event(&after, left) else {
                self.commit(end, left);
                return;
            };
            if event == 0 && h <= 1e-12 * span && self.x[1] == 0.0 {
                // it cannot leave after all
                self.rest();
                self.time += left;
                return;
            }
            let at = self.runge_kutta(h);
            self.commit(at, h);
            self.meet(event);
            left -= h;
            if left <= 1e-12 * span {
                return;
            }
        }
        self.rest();
        self.time += left;
    }

    /// The first event of a step, and when.
    fn first_event(&self, after: &[f64; 3], span: f64) -> Option<(usize, f64)> {
        let mut first: Option<(usize, f64)> = None;
        for event in 0..3 {
            let passed = if event == 0 { after[0] <= 0.0 } else { after[event] < 0.0 };
            if passed {
                let h = self.locate(event, after[event], span);
                if first.is_none_or(|(_, earlier)| h < earlier) {
                    first = Some((event, h));
                }
            }
        }
        first
    }

    /// When a distance comes to zero: false position, halved where it creeps.
    fn locate(&self, event: usize, after: f64, span: f64) -> f64 {
        let (mut low, mut high) = (0.0, span);
        let (mut at_low, mut at_high) = (self.distances(&self.x)[event].max(0.0), after.min(0.0));
        if at_low == 0.0 && event == 0 {
            // just left: standstill again within the step is found from its middle
            let middle = self.distances(&self.runge_kutta(0.5 * span))[event];
            if middle <= 0.0 {
                return 0.0;
            }
            (low, at_low) = (0.5 * span, middle);
        }
        let mut side = 0;
        for _ in 0..60 {
            let h = if at_low - at_high > 0.0 {
                low + (high - low) * at_low / (at_low - at_high)
            } else {
                0.5 * (low + high)
            };
            if high - low <= 1e-13 * span {
                break;
            }
            let value = self.distances(&self.runge_kutta(h))[event];
            if value.abs() < 1e-15 {
                return h;
            }
            if value > 0.0 {
                (low, at_low) = (h, value);
                if side == 1 {
                    at_high *= 0.5;
                }
                side = 1;
            } else {
                (high, at_high) = (h, value);
                if side == -1 {
                    at_low *= 0.5;
                }
                side = -1;
            }
        }
        high
    }

    fn commit(&mut self, x: State, h: f64) {
        self.account(&x);
        if let Some(mut bristles) = self.bristles {
            let speed = 0.5 * (self.x[1] + x[1]);
            let (torque, _) = self.motor(x[0], x[1]);
            let burden = self.burden(h, &x, torque);
            let level = self.dry(&burden, usize::from(speed >= 0.0));
            bristles.force = bristles.forces(x[0], speed, level);
            bristles.at = x[0];
            self.bristles = Some(bristles);
        }
        self.x = x;
        self.time += h;
    }

    /// Books the energy of a piece of the way of a machine without effects.
    fn account(&mut self, x: &State) {
        if !self.subject.hidden.is_empty() {
            return;
        }
        let turn = x[0] - self.x[0];
        let torque = 0.5 * (self.motor(self.x[0], self.x[1]).0 + self.motor(x[0], x[1]).0);
        let speed = 0.5 * (self.x[1] + x[1]);
        self.energy.motor += torque * turn;
        let drag = self.subject.numbers.viscous * speed;
        self.energy.rubbed += (self.going.sign() * self.kinetic + drag) * turn;
        self.energy.load += self.felt(self.touch) * turn;
    }

    fn meet(&mut self, event: usize) {
        match event {
            0 => self.rest(),
            1 if self.going == Going::Forth => {
                self.touch = Touch::Forth;
                self.x[0] = self.left_at + self.half_play;
            }
            1 => {
                self.touch = Touch::Back;
                self.x[0] = self.left_at - self.half_play;
            }
            _ => {
                let forth = self.going == Going::Forth;
                self.x[0] = self.sector_begin(self.sector + i64::from(forth));
                self.sector += if forth { 1 } else { -1 };
                self.commutated = self.time;
            }
        }
    }

    /// The shaft has stopped; the load stays where it is.
    fn rest(&mut self) {
        self.left_at = match self.touch {
            Touch::None => self.left_at,
            Touch::Forth => self.x[0] - self.half_play,
            Touch::Back => self.x[0] + self.half_play,
        };
        (self.touch, self.going, self.x[1]) = (Touch::None, Going::Stuck, 0.0);
    }

    /// Leaves the rest where the torque is beyond what holds.
    fn try_to_leave(&mut self) {
        let x = self.x;
        let (torque, _) = self.motor(x[0], 0.0);
        let burden = self.burden(0.0, &x, torque);
        let against = self.against(&burden, &x, Touch::None);
        let mut hold = [0, 1].map(|side| self.dry(&burden, side).fixed);
        if self.bristles.is_some() {
            hold = [1e-12; 2];
        }
        // touching but for rounding
        let near = 1e-9 * self.half_play.max(1e-6);
        let loads = self.elastic.is_none();
        let at_front = loads && x[0] - self.left_at >= self.half_play - near;
        let at_back = loads && x[0] - self.left_at <= near - self.half_play;
        let front = if at_front { self.felt(Touch::Forth) } else { 0.0 };
        let back = if at_back { self.felt(Touch::Back) } else { 0.0 };
        if torque > hold[1] + against + front {
            self.going = Going::Forth;
            if at_front {
                self.touch = Touch::Forth;
            }
        } else if torque < against + back - hold[0] {
            self.going = Going::Back;
            if at_back {
                self.touch = Touch::Back;
            }
        }
    }
}

/// The back-EMF of a phase with unit flat tops of 120°.
fn trapezoid(x: f64) -> f64 {
    let turned = x - TAU * floor(x / TAU);
    let rising = if turned < 0.5 * PI {
        turned
    } else if turned < 1.5 * PI {
        PI - turned
    } else {
        turned - TAU
    };
    (rising / FRAC_PI_6).clamp(-1.0, 1.0)
}
