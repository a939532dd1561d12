//! A case: a machine, four recordings, and what is hidden.

use std::{fmt::Write, fs, path::Path};

use crate::{
    chance::{Chance, Purpose},
    class::Class,
    command::{self, Course, Limits, Move},
    effect::{self, Form, Hidden},
    error::BlindError,
    information::{self, Outlook, Setting, Space},
    machine::{Machine, Nuisance, Numbers, RATE_HZ},
    noise::Noise,
    plant::{Faults, Subject, Trace, simulate},
    recording::{Columns, File, Role, read_command, rounded, write},
    tie::Tie,
    truth::{HiddenTruth, TieTruth, Truth},
};

/// Lambda at which the 1 % family-wise test over the catalogue finds half of the effects: twice
/// this counts as visible.
pub(crate) const HALF_DETECTED: f64 = 15.0;
/// Lambda from which an effect counts as visible.
pub const VISIBLE_LAMBDA: f64 = 30.0;
/// Lambda between two effects below which the recordings tie them.
pub const TIED_LAMBDA: f64 = 4.0;
/// Share of the fourfold energy that twice the size is to have.
const LEAST_GROWTH: f64 = 0.6;
/// Draws of a case before its class is given up.
const MOST_DRAWS: u64 = 60;

/// A blind case.
#[derive(Clone, Debug)]
pub struct Case {
    subject: Numbers,
    faults: Faults,
    hidden: Vec<Hidden>,
    noise: Noise,
    seed: u64,
    /// Training, training, hold-out.
    settings: Vec<Setting>,
    /// The repeat of the first.
    repeat: Setting,
    truth: Truth,
}

/// Choices by the low bits of a seed, so that running seeds cover all of it evenly.
#[derive(Clone, Copy, Debug)]
struct Stratum {
    machine: Machine,
    /// Which effect, and a number that runs over the rest.
    effect: usize,
    round: usize,
}

impl Stratum {
    fn of(seed: u64) -> Self {
        let place = (seed & 0xffff) as usize;
        let machine = Machine::ALL[place % 2];
        let count = effect::catalogue(machine).len();
        Self { machine, effect: place / 2 % count, round: place / 2 / count }
    }
}

impl Case {
    /// Draws a case. The low 16 bits of the seed choose machine, effect and quarter of the
    /// severities by turns; all else is random.
    ///
    /// # Errors
    ///
    /// [`BlindError::NothingFits`] when no draw gives what the class asks for.
    ///
    /// # Examples
    ///
    /// ```
    /// use greybox_blind::{Case, Class};
    ///
    /// let case = Case::draw(3, Class::Null)?;
    /// assert_eq!(case.files().len(), 4);
    /// assert_eq!(case.seal().len(), 64);
    /// # Ok::<_, greybox_blind::BlindError>(())
    /// ```
    pub fn draw(seed: u64, class: Class) -> Result<Self, BlindError> {
        let stratum = Stratum::of(seed);
        for attempt in 0..MOST_DRAWS {
            let mut chance = Chance::new(seed, Purpose::Truth, (class as u64) << 8 | attempt);
            if let Some(case) = Self::attempt(seed, class, stratum, &mut chance) {
                return Ok(case);
            }
        }
        Err(BlindError::NothingFits { seed, class, draws: MOST_DRAWS })
    }

    fn attempt(seed: u64, class: Class, stratum: Stratum, chance: &mut Chance) -> Option<Self> {
        let tie = (class == Class::Tied)
            .then(|| Tie::draw(stratum.machine, stratum.effect + stratum.round, chance));
        let machine = stratum.machine;
        let mut numbers = Numbers::nominal(machine);
        let nuisances: Vec<(&'static str, f64)> = Nuisance::ALL
            .into_iter()
            .map(|nuisance| {
                let half = nuisance.half_width(machine);
                let change = chance.between(-half, half);
                nuisance.change(&mut numbers, change);
                (nuisance.key(machine), change)
            })
            .collect();
        let (settings, moves) = draw_settings(seed, machine, tie.as_ref(), chance);
        let unusual = (class == Class::UnusualNull).then_some(stratum.effect % 4);
        let middle = if machine == Machine::Servo { 10.0 } else { 60.0 };
        let noise = Noise::draw(unusual, middle, chance);
        let faults = draw_faults(class, machine, stratum, chance);
        let mut repeat = settings[0].clone();
        repeat.disturbance_seed = information::seeds(seed, 8)[7];
        let mut case = Self {
            subject: numbers,
            faults,
            hidden: Vec::new(),
            noise,
            seed,
            settings,
            repeat,
            truth: Truth::plain(class, machine, seed),
        };
        case.truth.moves = moves;
        case.truth.nuisances = nuisances;
        case.truth.noise = (noise.kind.name(), noise.rms_a);
        case.truth.faults = case.fault_levels();
        case.hide(stratum, tie, chance).then_some(case)
    }

    /// Hides what the class asks for; false where this draw does not allow it.
    fn hide(&mut self, stratum: Stratum, tie: Option<Tie>, chance: &mut Chance) -> bool {
        let class = self.truth.class;
        let settings = self.settings.clone();
        let outlook = Outlook {
            numbers: self.subject,
            faults: self.faults,
            noise: self.noise,
            settings: &settings,
        };
        if !class.hides() {
            return true;
        }
        let look = Look::new(&outlook);
        let wanted = match class {
            Class::Single => {
                let quarter = (stratum.effect + stratum.round) % 4;
                0.3 * libm::pow(100.0, (quarter as f64 + chance.uniform()) / 4.0)
            }
            Class::Outside => chance.log_between(1.0, 120.0),
            _ => chance.log_between(1.6, 30.0),
        };
        let mut hidden = Vec::new();
        if let Some(tie) = &tie {
            let Some(effect) = look.sized(&tie.truth, tie.most, wanted) else { return false };
            hidden.push(effect);
        } else {
            let Some(first) = look.drawn(class, stratum, wanted, chance) else { return false };
            hidden.push(first);
            if class == Class::Double {
                let Some(second) = look.second(&hidden[0], chance) else { return false };
                hidden.push(second);
            }
        }
        if let Some(tie) = tie {
            let Some((effect, truth)) = look.tied(&hidden[0], &tie) else { return false };
            (hidden, self.truth.tie) = (vec![effect], Some(truth));
        }
        self.hidden = hidden;
        look.tell(&self.hidden, &mut self.truth);
        !matches!(class, Class::Double | Class::Tied) || self.truth.hidden.iter().all(|h| h.visible)
    }

    fn fault_levels(&self) -> Vec<(&'static str, f64)> {
        let k = &self.faults;
        if self.subject.machine == Machine::Servo {
            return vec![("k1", k[0]), ("k2", k[1])];
        }
        let size = libm::hypot(k[5], k[6]);
        let turn = libm::atan2(k[6], k[5]) / core::f64::consts::TAU + 0.5;
        let phase = if size > 0.0 { turn - libm::floor(turn) } else { 0.5 };
        let names = ["k1", "k2", "k3", "k4", "k5"];
        let mut levels: Vec<_> = names.into_iter().zip(k[..5].iter().copied()).collect();
        levels.extend([("k6", size), ("k7", phase)]);
        levels
    }

    /// The machine of the case.
    pub fn machine(&self) -> Machine {
        self.subject.machine
    }

    /// The nominal model, as a model file: all that the explainer may know besides recordings.
    pub fn nominal_toml(&self) -> &'static str {
        self.subject.machine.nominal_toml()
    }

    /// The recordings, under shuffled names and with shuffled columns: two for training, one with
    /// another command that is held out, and a repeat of a training one.
    pub fn files(&self) -> Vec<File> {
        let roles = [Role::Train, Role::Train, Role::HoldOut, Role::Repeat];
        let mut chance = Chance::new(self.seed, Purpose::Shuffle, 0);
        let mut numbers: Vec<usize> = (1..=roles.len()).collect();
        chance.shuffle(&mut numbers);
        let noise = information::seeds(self.seed ^ 0x6e6f_6973_6500, roles.len());
        let settings = self.settings.iter().chain([&self.repeat]);
        settings
            .zip(roles)
            .enumerate()
            .map(|(n, (setting, role))| File {
                name: format!("rec{:02}.csv", numbers[n]),
                role,
                text: self.recorded(setting, noise[n], &mut chance),
            })
            .collect()
    }

    /// Writes what the explainer may see into an empty folder: `nominal.toml`, the recordings, and
    /// `roles.toml` with the names of `train`, `holdout` and `repeat`. The truth is not written.
    ///
    /// # Errors
    ///
    /// [`std::io::Error`] where the folder cannot be written to.
    pub fn write(&self, folder: &Path) -> std::io::Result<Vec<File>> {
        let files = self.files();
        fs::create_dir_all(folder)?;
        fs::write(folder.join("nominal.toml"), self.nominal_toml())?;
        let mut roles = String::new();
        for role in [Role::Train, Role::HoldOut, Role::Repeat] {
            let of_role = files.iter().filter(|file| file.role == role);
            let names: Vec<String> = of_role.map(|file| format!("{:?}", file.name)).collect();
            let _ = writeln!(roles, "{} = [{}]", role.name(), names.join(", "));
        }
        fs::write(folder.join("roles.toml"), roles)?;
        for file in &files {
            fs::write(folder.join(&file.name), &file.text)?;
        }
        Ok(files)
    }

    /// The recording of another command with the same machine: what a proposal asks for.
    ///
    /// The text is a command of `time_s`, `command_rad` and, where there is one, `load_n_m`.
    ///
    /// # Errors
    ///
    /// [`BlindError`] for a text that is no such command.
    pub fn record_for(&self, command_csv: &str) -> Result<File, BlindError> {
        let (mut course, first) = read_command(command_csv)?;
        let seeds = information::seeds(self.seed ^ 0x7072_6f70_6f73, 3);
        let mut chance = Chance::new(self.seed, Purpose::Shuffle, 1);
        let servo = self.subject.machine == Machine::Servo;
        let start_rad = if servo { first } else { rounded(chance.angle(), 6) };
        if servo {
            course.command_rad.iter_mut().for_each(|c| *c -= first);
        }
        let setting = Setting { course, start_rad, disturbance_seed: seeds[0] };
        let text = self.recorded(&setting, seeds[1], &mut chance);
        Ok(File { name: "rec09.csv".to_owned(), role: Role::Train, text })
    }

    fn recorded(&self, setting: &Setting, noise_seed: u64, chance: &mut Chance) -> String {
        let trace = self.trace(setting, &self.hidden, information::fine(self.subject.machine));
        let speeds: Vec<f64> = (0..trace.position.len())
            .map(|n| (trace.position[n] - trace.position[n.max(1) - 1]) * RATE_HZ)
            .collect();
        let noise = self.noise.samples(&speeds, RATE_HZ, noise_seed);
        let current: Vec<f64> = trace.current.iter().zip(noise).map(|(i, e)| i + e).collect();
        let columns = Columns { setting, current: &current, position: &trace.position };
        write(self.subject.machine, &columns, chance)
    }

    fn trace(&self, setting: &Setting, hidden: &[Hidden], steps: usize) -> Trace {
        let subject = Subject { numbers: self.subject, faults: self.faults, hidden };
        simulate(&subject, &setting.test(steps))
    }

    /// Truth of the case.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The truth as JSON.
    pub fn truth_json(&self) -> String {
        self.truth.to_json()
    }

    /// SHA-256 of [`truth_json`](Self::truth_json), in hexadecimal digits.
    pub fn seal(&self) -> String {
        crate::truth::sha256_hex(self.truth_json().as_bytes())
    }
}

/// Draws the recordings: training, training, hold-out.
fn draw_settings(
    seed: u64,
    machine: Machine,
    tie: Option<&Tie>,
    chance: &mut Chance,
) -> (Vec<Setting>, Vec<&'static str>) {
    let mut menu = Move::MENU;
    chance.shuffle(&mut menu);
    let start = chance.angle();
    let start_rad = rounded(if machine == Machine::Servo { start - 3.0 } else { start }, 6);
    let seeds = information::seeds(seed, 3);
    // tied cases go the same way in all recordings
    let way = chance.sign();
    let mut settings = Vec::new();
    let mut moves = Vec::new();
    for (n, seconds) in [6.0, 5.5, 5.0].into_iter().enumerate() {
        let kind = tie.map_or(menu[n], |tie| tie.kind);
        let mut course = command::draw(kind, machine, seconds, chance);
        let limits = Limits::of(machine);
        match tie {
            None if n == 1 => {
                let samples = course.command_rad.len();
                course.load_n_m = command::load_steps(&limits, samples, chance);
            }
            Some(tie) => {
                if way * course.command_rad[course.command_rad.len() - 1] < 0.0
                    && kind == Move::OneWay
                {
                    course.command_rad.iter_mut().for_each(|c| *c = -*c);
                }
                if tie.loaded {
                    let samples = course.command_rad.len();
                    let steps = command::load_steps(&limits, samples, chance);
                    // against the motion, so that it never drives
                    course.load_n_m = steps.iter().map(|l| way * l.abs()).collect();
                }
            }
            None => {}
        }
        course.round();
        moves.push(kind.name());
        settings.push(Setting { course, start_rad, disturbance_seed: seeds[n] });
    }
    (settings, moves)
}

impl Course {
    /// To the digits of the recordings, so that the machine gets what is written.
    pub(crate) fn round(&mut self) {
        self.command_rad.iter_mut().for_each(|c| *c = rounded(*c, 8));
        self.load_n_m.iter_mut().for_each(|l| *l = rounded(*l, 4));
    }
}

fn draw_faults(class: Class, machine: Machine, stratum: Stratum, chance: &mut Chance) -> Faults {
    let mut places: Vec<usize> =
        if machine == Machine::Servo { vec![0, 1] } else { (0..6).collect() };
    chance.shuffle(&mut places);
    let most = places.len().min(3);
    let healthy = class == Class::Single && (stratum.effect + stratum.round / 4).is_multiple_of(2);
    let count = match class {
        _ if healthy => 0,
        Class::Null | Class::UnusualNull => chance.index(most + 1),
        _ => 1 + chance.index(most),
    };
    let mut faults = [0.0; 7];
    for &place in &places[..count] {
        let level = match (class, place) {
            (Class::FaultOnly, 0) => chance.between(0.1, 0.6),
            (Class::FaultOnly, 1) => chance.between(0.05, 0.4),
            (Class::FaultOnly, _) => chance.between(0.05, 0.3),
            _ => chance.between(0.005, 0.05),
        };
        if place == 5 {
            let angle = chance.angle();
            (faults[5], faults[6]) = (level * libm::cos(angle), level * libm::sin(angle));
        } else {
            faults[place] = level;
        }
    }
    faults
}

/// Recordings seen with the generator's own knowledge.
struct Look<'a> {
    outlook: &'a Outlook<'a>,
    plain: Vec<Vec<f64>>,
    slopes: Vec<Vec<Vec<f64>>>,
    space: Space,
}

/// Steps by which damage and nuisance parameters follow what they imitate.
const IMITATIONS: usize = 3;

/// Training recordings among the settings.
const TRAINING: usize = 2;

impl<'a> Look<'a> {
    fn new(outlook: &'a Outlook<'a>) -> Self {
        let (plain, slopes) = (outlook.plain(), outlook.slopes());
        let space = information::space(outlook, &slopes, TRAINING);
        Self { outlook, plain, slopes, space }
    }

    fn training(&self) -> Outlook<'_> {
        Outlook { settings: &self.outlook.settings[..TRAINING], ..*self.outlook }
    }

    fn whitened(&self, hidden: &[Hidden]) -> Vec<f64> {
        let signature = self.training().signature(&self.plain, hidden);
        self.outlook.pooled(&signature)
    }

    fn lambda(&self, effect: &Hidden) -> f64 {
        let one = core::slice::from_ref(effect);
        information::lambda(&self.space, &self.whitened(one)).0
    }

    fn drawn(
        &self,
        class: Class,
        stratum: Stratum,
        wanted: f64,
        chance: &mut Chance,
    ) -> Option<Hidden> {
        let symbol = match class {
            Class::Outside => effect::OUTSIDE[stratum.effect % effect::OUTSIDE.len()],
            _ => effect::catalogue(stratum.machine)[stratum.effect],
        };
        self.of_symbol(symbol, wanted, chance)
    }

    fn of_symbol(&self, symbol: &'static str, wanted: f64, chance: &mut Chance) -> Option<Hidden> {
        let (form, most) = effect::draw(symbol, &self.outlook.numbers, chance);
        self.sized(&Hidden { symbol, form, size: 0.0 }, most, wanted)
    }

    /// Gives an effect the size that is a multiple of the half-detected one, within its bounds.
    fn sized(&self, effect: &Hidden, most: f64, wanted: f64) -> Option<Hidden> {
        let target = HALF_DETECTED * wanted * wanted;
        let bounds = (least(&effect.form, most), most);
        let mut effect = effect.clone();
        effect.size = (0.05 * most).max(bounds.0);
        // lambda grows with a power of the size: the square where the effect is linear
        let (mut power, mut before) = (2.0, None);
        for _ in 0..5 {
            let lambda = self.lambda(&effect);
            if !lambda.is_finite() || lambda <= 0.0 {
                return None;
            }
            let now = (libm::log(effect.size), libm::log(lambda));
            if let Some((size, energy)) = before.replace(now)
                && libm::fabs(now.0 - size) > 1e-3
            {
                power = ((now.1 - energy) / (now.0 - size)).clamp(1.0, 6.0);
            }
            let change = libm::log(target / lambda) / power;
            if change.abs() < 0.15 {
                break;
            }
            let size = libm::exp(now.0 + change).clamp(bounds.0, bounds.1);
            if size == effect.size {
                break;
            }
            effect.size = size;
        }
        self.is_smooth(&effect).then_some(effect)
    }

    /// Tells whether the effect's energy is that of its size. A shaft at rest may break away a tick
    /// earlier or later for next to nothing, and where such a jump is most of the energy, it says
    /// little of the effect.
    fn is_smooth(&self, effect: &Hidden) -> bool {
        if effect.form.replaces() {
            return true;
        }
        let twice = Hidden { size: 2.0 * effect.size, ..effect.clone() };
        self.lambda(&twice) > LEAST_GROWTH * 4.0 * self.lambda(effect)
    }

    /// Another effect of the catalogue beside the first.
    fn second(&self, first: &Hidden, chance: &mut Chance) -> Option<Hidden> {
        let all = effect::catalogue(self.outlook.numbers.machine);
        let symbol = chance.one_of(all);
        if symbol == first.symbol || ["E05", "E08"].contains(&symbol) {
            return None;
        }
        self.of_symbol(symbol, chance.log_between(1.6, 30.0), chance)
    }

    /// Makes the effect small enough that its partner imitates it, where it is still visible.
    fn tied(&self, effect: &Hidden, tie: &Tie) -> Option<(Hidden, TieTruth)> {
        let mut space = self.space.clone();
        for partner in &tie.partners {
            space.add(&self.whitened(core::slice::from_ref(partner)));
        }
        let mut effect = effect.clone();
        for _ in 0..2 {
            let whitened = self.whitened(core::slice::from_ref(&effect));
            let separate = information::lambda(&space, &whitened).0;
            let visible = information::lambda(&self.space, &whitened).0 >= VISIBLE_LAMBDA;
            if visible && separate < TIED_LAMBDA {
                let partners = vec![tie.partner];
                return Some((effect, TieTruth { partners, lambda: separate }));
            }
            effect.size *= libm::sqrt(0.7 * TIED_LAMBDA / separate).min(1.0);
        }
        None
    }

    /// The least energy that is left of a whitened signature, beyond a space, when the machine
    /// itself has the damage and the nuisance parameters that imitate it, followed along the
    /// slopes: what they do is not in proportion to them, and weak magnets are the same as equal
    /// shorts, whatever slopes make of where a shaft sticks.
    fn beyond_damage(&self, space: &Space, whitened: &[f64]) -> f64 {
        let (mut left, mut least) = (whitened.to_vec(), f64::INFINITY);
        let mut by = vec![0.0; self.slopes.len()];
        for _ in 0..IMITATIONS {
            let more = self.space.coefficients(&self.space.take_off(&mut left));
            by.iter_mut().zip(more).for_each(|(by, more)| *by += more);
            self.outlook.hold(&mut by);
            let moved = self.outlook.pooled(&self.training().imitated(&self.plain, &by));
            left = information::minus(whitened, &moved);
            least = least.min(information::lambda(space, &left).0);
        }
        least
    }

    /// Writes down what the truth says of effects.
    fn tell(&self, hidden: &[Hidden], truth: &mut Truth) {
        let signature = self.outlook.signature(&self.plain, hidden);
        let together = self.outlook.pooled(&signature[..TRAINING]);
        let apart: Vec<Vec<f64>> = match hidden {
            [_] => vec![together.clone()],
            _ => hidden.iter().map(|h| self.whitened(core::slice::from_ref(h))).collect(),
        };
        for (place, effect) in hidden.iter().enumerate() {
            let mut space = self.space.clone();
            for (other, rival) in apart.iter().enumerate() {
                if other != place {
                    space.add(rival);
                }
            }
            let (linear, whole) = information::lambda(&space, &apart[place]);
            let beyond = self.beyond_damage(&space, &apart[place]);
            let lambda = linear.min(beyond);
            truth.hidden.push(HiddenTruth {
                symbol: effect.symbol,
                size: effect.size,
                form: effect.words(),
                lambda,
                lambda_by_slopes: linear,
                visible: lambda >= VISIBLE_LAMBDA,
                own_share: if whole > 0.0 { libm::sqrt(lambda / whole) } else { 0.0 },
                severity: libm::sqrt(lambda / HALF_DETECTED),
            });
        }
        truth.excess =
            information::excess(self.outlook, &self.space, &self.slopes, &signature, TRAINING);
        truth.lambda = information::lambda(&self.space, &together).0;
        let shares = self.space.take_off(&mut together.clone());
        let shifts = self.space.coefficients(&shares);
        let names = ["k1", "k2", "k3", "k4", "k5"].into_iter();
        truth.shifts = names.zip(shifts).take(self.outlook.numbers.machine.fault_count()).collect();
    }
}

/// Smallest size: none to speak of, but for what puts other physics in place of the machine's
/// even where it is small, whose size is as drawn.
fn least(form: &Form, most: f64) -> f64 {
    match form {
        Form::FourElements { .. } | Form::Dahl { .. } | Form::Elastic { .. } => most,
        _ => 1e-6 * most,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The energy of a linear effect goes with the square of its size.
    #[test]
    fn law_lambda_goes_with_the_square_of_the_size() {
        for (machine, symbol) in
            [(Machine::Servo, "E11"), (Machine::Servo, "E10"), (Machine::Ema48, "E11")]
        {
            let mut chance = Chance::new(5, Purpose::Truth, 0);
            let numbers = Numbers::nominal(machine);
            let (settings, _) = draw_settings(5, machine, None, &mut chance);
            let noise = Noise::draw(None, 10.0, &mut chance);
            let outlook = Outlook { numbers, faults: [0.0; 7], noise, settings: &settings };
            let look = Look::new(&outlook);
            let (form, most) = effect::draw(symbol, &numbers, &mut chance);
            let lambda = |size: f64| {
                look.lambda(&Hidden { symbol: "E00", form: form.clone(), size: size * most })
            };
            let ratio = lambda(4e-2) / lambda(2e-2);
            // small sizes shift the instants of breakaway by whole ticks now and then
            assert!((ratio / 4.0 - 1.0).abs() < 0.1, "{machine:?} {symbol}: {ratio}");
            assert!(lambda(2e-2) > 0.0);
        }
    }

    /// A fault's share is not the effect's: a change of friction has no energy left.
    #[test]
    fn law_a_fault_is_projected_off() {
        let mut chance = Chance::new(6, Purpose::Truth, 0);
        let numbers = Numbers::nominal(Machine::Servo);
        let (settings, _) = draw_settings(6, Machine::Servo, None, &mut chance);
        let noise = Noise::draw(None, 10.0, &mut chance);
        let outlook = Outlook { numbers, faults: [0.0; 7], noise, settings: &settings };
        let look = Look::new(&outlook);
        let worn = Subject { numbers, faults: [2e-2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], hidden: &[] };
        let moved: Vec<Vec<f64>> = settings
            .iter()
            .zip(&look.plain)
            .map(|(s, plain)| {
                let current = simulate(&worn, &s.test(4)).current;
                current.iter().zip(plain).map(|(a, b)| a - b).collect()
            })
            .collect();
        let (own, whole) = information::lambda(&look.space, &outlook.pooled(&moved[..TRAINING]));
        assert!(whole > 100.0 && own < 0.02 * whole, "{own} of {whole}");
    }
}
