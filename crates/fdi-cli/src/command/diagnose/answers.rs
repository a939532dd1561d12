//! Inputs that an answer depends on, besides its recording.

use std::{collections::BTreeMap, path::PathBuf};

use anyhow::{Context, Result};
use fdi_core::{
    recording_sha256,
    report::{BatchShard, ResumeHead, SCHEMA_VERSION},
};

use crate::{DiagnoseArgs, Diagnoser, GlobalArgs, deciding::Deciding, output::TOOL, unit_file};

/// Options of `diagnose` that change no answer: which recordings, and what is made of the answers.
#[cfg(test)]
const OF_NO_ANSWER: [&str; 17] = [
    "color",
    "config",
    "exit-code",
    "figures",
    "files-from",
    "jobs",
    "output",
    "output-format",
    "quiet",
    "help",
    "report",
    "resume",
    "shard",
    "stamp",
    "verbose",
    "version",
    "warning-change",
];

/// The head of a file that keeps the answers.
pub(super) fn head(
    args: &DiagnoseArgs,
    global: &GlobalArgs,
    diagnoser: &dyn Diagnoser,
    deciding: &Deciding,
    shard: Option<BatchShard>,
) -> Result<ResumeHead> {
    let of_file =
        |path: &PathBuf| recording_sha256(path).with_context(|| path.display().to_string());
    let references = args.reference.iter().map(of_file).collect::<Result<Vec<_>>>()?;
    let units = args.unit.as_deref().map_or_else(|| Ok(Vec::new()), unit_file::listed)?;
    let units = units.iter().map(of_file).collect::<Result<Vec<_>>>()?;
    let word = |value: &dyn ToString| Some(value.to_string());
    let several = |values: &[String]| (!values.is_empty()).then(|| values.join(", "));
    let [watch, act] = args.levels.words();
    let switch = |on: bool| on.then(|| "on".to_owned());
    let depend_on = [
        ("bundle", Some(diagnoser.bundles().join(", "))),
        ("act", several(&act)),
        ("date-from", args.fleet.names.date_from.as_ref().and_then(|one| word(one))),
        ("decide", switch(deciding.is_asked())),
        ("encoding", Some(args.encoding.word().to_owned())),
        ("fidelity", Some(args.fidelity.word().to_owned())),
        ("free-start", switch(args.free_start)),
        ("id-from", args.fleet.names.id_from.as_ref().and_then(|one| word(one))),
        ("identifiability", switch(args.identifiability)),
        ("gaps", Some(args.map.gaps.word().to_owned())),
        ("map", several(&args.map.map)),
        ("max-delay-s", args.max_delay_s.and_then(|one| word(&one))),
        ("max-evaluations", args.max_evaluations.and_then(|one| word(&one))),
        ("method", Some(args.method.word().to_owned())),
        ("noise-a", args.noise_a.and_then(|one| word(&one))),
        ("reference", several(&references)),
        ("seed", word(&global.seed)),
        ("skip-lines", word(&args.map.skip_lines)),
        ("stable", switch(global.stable)),
        ("together", args.together.map(|by| by.word().to_owned())),
        ("tolerance", Some(args.tolerance.word().to_owned())),
        ("unit", several(&units)),
        ("watch", several(&watch)),
        ("where", several(&args.map.rows)),
    ];
    let answers_depend_on: BTreeMap<String, Option<String>> =
        depend_on.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    let tool = TOOL.to_owned();
    Ok(ResumeHead { schema_version: SCHEMA_VERSION, tool, answers_depend_on, shard })
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::{Cli, args::Command};

    struct Two;

    impl Diagnoser for Two {
        fn bundle_sha256(&self) -> &'static str {
            "00ff"
        }

        fn bundles(&self) -> Vec<&str> {
            vec!["00ff", "11ff"]
        }

        fn rates_hz(&self) -> &[f64] {
            &[]
        }

        fn diagnose(&self, _: &fdi_core::Recording) -> Result<fdi_core::report::RecordDiagnosis> {
            anyhow::bail!("nothing is diagnosed here")
        }
    }

    fn depends_on(words: &[&str]) -> BTreeMap<String, Option<String>> {
        let cli = Cli::parse_from([&["fdi", "diagnose", "r.csv"], words].concat());
        let Command::Diagnose(args) = &cli.command else { panic!("diagnose") };
        let deciding = Deciding::of(args, &Two).unwrap();
        head(args, &cli.global, &Two, &deciding, None).unwrap().answers_depend_on
    }

    /// An option that comes later is either what answers depend on or says that it is not.
    #[test]
    fn every_option_is_one_or_the_other() {
        let mut root = Cli::command();
        root.build();
        let command = root.find_subcommand("diagnose").unwrap();
        let told = depends_on(&[]);
        for long in command.get_arguments().filter_map(clap::Arg::get_long) {
            assert!(told.contains_key(long) != OF_NO_ANSWER.contains(&long), "--{long}");
        }
    }

    #[test]
    fn every_setting_is_told_as_it_was_given() {
        let plain = depends_on(&[]);
        assert_eq!(plain["bundle"].as_deref(), Some("00ff, 11ff"));
        for (name, value) in [
            ("date-from", "*_{date}"),
            ("encoding", "modes"),
            ("fidelity", "high"),
            ("id-from", "{id}_*"),
            ("map", "current_a=I*2"),
            ("max-delay-s", "0.01"),
            ("max-evaluations", "30"),
            ("method", "ei"),
            ("noise-a", "0.02"),
            ("seed", "7"),
        ] {
            let given = depends_on(&[&format!("--{name}={value}")]);
            assert_eq!(given[name].as_deref(), Some(value), "{name}");
            assert_ne!(given, plain);
        }
        for switch in ["free-start", "stable"] {
            assert_ne!(depends_on(&[&format!("--{switch}")]), plain, "{switch}");
        }
    }
}
