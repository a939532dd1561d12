//! Cases by name: what is hidden in them, and the files that whoever answers may see.

use std::{
    collections::BTreeMap,
    f64::consts::TAU,
    fmt::{self, Write as _},
    fs,
    path::Path,
};

use greybox_blind::{Case, Class};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::commands::output;

/// Seeds of these cases: neither those of development nor the scored ones.
const SEEDS: u64 = 9 << 16;

/// A case: its class and a number. Even numbers of a blind class are actuators and odd ones servo
/// axes; in high fidelity all are actuators, those of even numbers damaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Name {
    pub(crate) kind: Kind,
    pub(crate) number: u64,
}

/// Where a case comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A crate that knows nothing of the catalogue of effects.
    Blind(Class),
    /// The simulator's high-fidelity model, with or without an effect.
    HighFidelity { hides: bool },
}

impl Kind {
    const HIGH: [(&'static str, Self); 2] = [
        ("high-null", Self::HighFidelity { hides: false }),
        ("high-single", Self::HighFidelity { hides: true }),
    ];

    pub(crate) fn hides(self) -> bool {
        match self {
            Self::Blind(class) => class.hides(),
            Self::HighFidelity { hides } => hides,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Blind(class) => class.name(),
            Self::HighFidelity { hides } => Self::HIGH[usize::from(hides)].0,
        }
    }

    fn find(name: &str) -> Option<Self> {
        let high = Self::HIGH.into_iter().find(|(known, _)| *known == name);
        high.map(|(_, kind)| kind).or_else(|| Class::find(name).map(Self::Blind))
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.kind.name(), self.number)
    }
}

impl Name {
    pub(crate) fn read(text: &str) -> Option<Self> {
        let (kind, number) = text.split_once(' ')?;
        Some(Self { kind: Kind::find(kind)?, number: number.parse().ok()? })
    }

    pub(crate) fn draw(self) -> Drawn {
        match self.kind {
            Kind::Blind(class) => {
                Drawn::Blind(Box::new(Case::draw(SEEDS | self.number, class).unwrap()))
            }
            Kind::HighFidelity { hides } => {
                Drawn::HighFidelity(Box::new(High::draw(self.number, hides)))
            }
        }
    }
}

/// A case with all that is hidden in it.
pub(crate) enum Drawn {
    Blind(Box<Case>),
    HighFidelity(Box<High>),
}

impl Drawn {
    /// The truth as JSON; writes no file.
    pub(crate) fn truth(&self) -> String {
        match self {
            Self::Blind(case) => case.truth_json(),
            Self::HighFidelity(high) => serde_json::to_string(&high.truth).unwrap(),
        }
    }

    /// The model file that whoever answers sees.
    pub(crate) fn nominal(&self) -> String {
        match self {
            Self::Blind(case) => case.nominal_toml().to_owned(),
            Self::HighFidelity(_) => nominal(),
        }
    }

    /// Writes recordings, their roles and the nominal model into a folder.
    pub(crate) fn write(&self, folder: &Path) {
        match self {
            Self::Blind(case) => {
                case.write(folder).unwrap();
            }
            Self::HighFidelity(high) => high.record(folder),
        }
    }
}

/// The truth of a case, as far as it is scored.
#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Truth {
    pub(crate) class: String,
    pub(crate) hidden: Vec<Hidden>,
    /// Size over the noise of what faults and tolerances leave of it in the recording held out.
    pub(crate) excess: f64,
    pub(crate) faults: BTreeMap<String, f64>,
    pub(crate) noise: String,
    pub(crate) noise_a: f64,
    /// Effects that the recordings cannot tell from the one hidden.
    #[serde(default)]
    pub(crate) tied_with: Vec<String>,
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Hidden {
    pub(crate) id: String,
    /// True where the recordings show it.
    pub(crate) visible: bool,
}

/// Noise of the phase currents of high-fidelity recordings, A.
const NOISE_A: f64 = 0.02;
/// Length and rate of their commands.
const SECONDS: f64 = 2.5;
const RATE_HZ: f64 = 1000.0;

/// Effects hidden in high fidelity: symbol, other parameters, key and range of the size.
const EFFECTS: [(&str, &str, &str, [f64; 2]); 2] = [
    ("E11", "order = 12, ", "cogging-sin-n-m", [0.004, 0.01]),
    ("E03", "", "coulomb-asymmetry-n-m", [0.006, 0.012]),
];

/// A machine in high fidelity, its electronics with all their noise and steps.
pub(crate) struct High {
    truth: Truth,
    model: String,
    commands: [String; 3],
    seed: u64,
}

fn nominal() -> String {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/models");
    fs::read_to_string(models.join("ema-48.toml")).unwrap()
}

impl High {
    fn draw(number: u64, hides: bool) -> Self {
        let seed = SEEDS | number << 1 | u64::from(hides);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut between = |[least, most]: [f64; 2]| random.random_range(least..most);
        let (id, more, key, sizes) = EFFECTS[number as usize % EFFECTS.len()];
        let size = between(sizes);
        let mut model = nominal();
        if hides {
            let _ = write!(
                model,
                "\n[[effect]]\nid = \"{id}\"\nparameters = {{ {more}{key} = {size} }}\n"
            );
        }
        let hidden = if hides { vec![Hidden { id: id.to_owned(), visible: true }] } else { vec![] };
        let is_damaged = number.is_multiple_of(2);
        let level = |key: &str| {
            let most = if is_damaged && ["k1", "k3"].contains(&key) { 0.04 } else { 0.0 };
            (key.to_owned(), most * between([0.5, 1.0]))
        };
        let faults = ["k1", "k2", "k3", "k4", "k5", "k6"].map(level).into_iter().collect();
        let [first, second, third] = [[0.5, 0.9], [1.9, 2.6], [0.4, 0.6]].map(&mut between);
        let commands = [
            command(|t| 4e-3 * (TAU * first * t).sin() + 2e-3 * (TAU * second * t).sin()),
            command(|t| 3e-3 * (3.0 - ((t / 0.4).floor() - 3.0).abs()).max(0.0)),
            command(|t| 6e-3 * (TAU * third * t).sin().asin()),
        ];
        let class = Kind::HighFidelity { hides }.name().to_owned();
        let noise = "white".to_owned();
        let truth = Truth {
            class,
            hidden,
            excess: 1.0,
            faults,
            noise,
            noise_a: NOISE_A,
            tied_with: Vec::new(),
        };
        Self { truth, model, commands, seed }
    }

    fn record(&self, folder: &Path) {
        // model, commands and their runs are in a folder that is gone before anybody answers
        let own = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder).unwrap();
        fs::write(own.path().join("true.toml"), &self.model).unwrap();
        fs::write(folder.join("nominal.toml"), nominal()).unwrap();
        let roles =
            "train = [\"rec01.csv\", \"rec02.csv\"]\nholdout = [\"rec03.csv\"]\nrepeat = []\n";
        fs::write(folder.join("roles.toml"), roles).unwrap();
        let levels: Vec<String> =
            self.truth.faults.iter().map(|(key, level)| format!("{key}={level}")).collect();
        for (place, command) in self.commands.iter().enumerate() {
            fs::write(own.path().join("command.csv"), command).unwrap();
            let file = folder.join(format!("rec{:02}.csv", place + 1)).display().to_string();
            let (noise, seed) = (NOISE_A.to_string(), (3 * self.seed + place as u64).to_string());
            let done = output(
                own.path(),
                &[
                    "simulate",
                    "--model",
                    "true.toml",
                    "--command",
                    "command.csv",
                    "--faults",
                    &levels.join(","),
                    "--noise-a",
                    &noise,
                    "--adc-bits",
                    "12",
                    "--seed",
                    &seed,
                    "-o",
                    &file,
                ],
            );
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        }
    }
}

/// A command of the surface, rad, as a file.
fn command(at: impl Fn(f64) -> f64) -> String {
    let row = |n: usize| (n as f64 / RATE_HZ, at(n as f64 / RATE_HZ));
    let rows = (0..(SECONDS * RATE_HZ) as usize).map(row).map(|(t, rad)| format!("{t},{rad}\n"));
    std::iter::once("time_s,command_rad\n".to_owned()).chain(rows).collect()
}
