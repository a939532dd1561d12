//! The commands that two programs are asked.

use std::path::Path;

use anyhow::Result;
use greybox_blind::{Case, Role};

use crate::blind::plan::{Set, plan, root_of};

/// Blind cases, evenly from all classes, of the written-down development seeds.
const BLIND_CASES: usize = 10;

/// A command with the files that it writes.
pub(super) struct Asked {
    pub(super) name: String,
    pub(super) arguments: Vec<String>,
    pub(super) files: Vec<String>,
}

/// The bench of the guide's page on what a model misses, as its recordings are told to a command.
const GUIDE: &str = "--train swing.csv stairs.csv --repeat swing-again.csv --holdout ramps.csv";

/// Recordings, datasets and bundles are made first; later commands read them. Every line is the
/// arguments of one command, `-o FILE` its product.
const LINES: &[&str] = &[
    "diagnose recordings --output-format json",
    "diagnose recordings --output-format csv",
    "diagnose recordings",
    "diagnose recordings/r16.csv.gz --fidelity high --output-format json",
    "diagnose recordings/r16.csv.gz --method two-step-ei --max-evaluations 40 --output-format json",
    "diagnose recordings/r01.csv.gz --method emulator --output-format json",
    "simulate --seed 1 --faults k1=0.02,k6=0.03,k7=0.6 -o high.csv",
    "simulate --fidelity low --seed 1 --faults k1=0.02,k6=0.03,k7=0.6 -o low.csv",
    "simulate --model models/axis-on-the-bench.toml --faults k1=0.03 --noise-a 0.02 --command commands/axis-swing.csv --seed 1 -o swing.csv",
    "simulate --model models/axis-on-the-bench.toml --faults k1=0.03 --noise-a 0.02 --command commands/axis-swing.csv --seed 2 -o swing-again.csv",
    "simulate --model models/axis-on-the-bench.toml --faults k1=0.03 --noise-a 0.02 --command commands/axis-stairs.csv --seed 3 -o stairs.csv",
    "simulate --model models/axis-on-the-bench.toml --faults k1=0.03 --noise-a 0.02 --command commands/axis-ramps.csv --seed 4 -o ramps.csv",
    "explain --model models/axis.toml {guide} --output-format json",
    "explain --model models/axis.toml {guide} -o extended.toml",
    "propose --model models/axis.toml {guide} -o next.csv",
    "propose --model models/axis.toml {guide} --output-format json",
    "calibrate --model models/axis.toml {guide} -o calibrated.toml",
    "calibrate --model models/axis.toml {guide} --output-format json",
    "dataset --model models/ema-270.toml --command commands/flap.csv --conditions 30 -o flap.fdi-dataset",
    "bundle build --dataset flap.fdi-dataset -o flap.fdi-bundle",
    "bundle show flap.fdi-bundle --output-format json",
    "evaluate low --conditions 3 --snapshots 24 --methods {gls},emulator,ei --max-evaluations 40 --output-format json",
    "evaluate high --conditions 2 --snapshots 24 --methods {gls},emulator --output-format json",
    "evaluate bench --conditions 2 --snapshots 24 --methods {gls},ucb --max-evaluations 20 --output-format json",
    "evaluate metaheuristics --conditions 1 --snapshots 24 --methods ga,pso,de,gwo,cma-es --max-evaluations 60 --output-format json",
    "evaluate noisy --conditions 4 --snapshots 24 --sparse-snapshots 12 --healthy 4 --output-format json",
];

/// Every command; the blind cases are written to the folders of both programs.
pub(super) fn commands(folders: &[&Path]) -> Result<Vec<Asked>> {
    let mut all: Vec<Asked> = LINES.iter().map(|line| asked(line)).collect();
    for planned in plan(&root_of(Set::Dev, Path::new("."))?, None, Some(BLIND_CASES)) {
        let case = Case::draw(planned.seed, planned.class)?;
        let name = format!("blind-{}-{}", planned.class.name(), planned.index);
        let mut files = Vec::new();
        for folder in folders {
            files = case.write(&folder.join(&name))?;
        }
        let of = |role: Role| {
            let chosen = files.iter().filter(move |file| file.role == role);
            chosen.map(|file| format!("{name}/{}", file.name)).collect::<Vec<_>>().join(" ")
        };
        all.push(asked(&format!(
            "explain --model {name}/nominal.toml --train {} --holdout {} --repeat {} \
             --output-format json",
            of(Role::Train),
            of(Role::HoldOut),
            of(Role::Repeat)
        )));
    }
    Ok(all)
}

/// A command from its line.
fn asked(line: &str) -> Asked {
    let line = line.replace("{guide}", GUIDE);
    let arguments: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
    let written = arguments.windows(2).filter(|pair| pair[0] == "-o").map(|pair| pair[1].clone());
    Asked { files: written.collect(), arguments, name: line }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_read_off_the_line() {
        let one = asked("calibrate {guide} -o calibrated.toml");
        assert_eq!(one.files, ["calibrated.toml"]);
        assert!(one.arguments.iter().any(|argument| argument == "--repeat"));
    }
}
