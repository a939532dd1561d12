//! The command `fdi`, as a library: its tree of commands can be documented, its batches tested, and
//! [`Session`] answers without a terminal for other front ends.

mod answering;
pub mod args;
mod batch;
mod bundle;
mod command;
mod config;
mod deciding;
mod diagnoser;
mod exit;
mod experiment;
mod files;
mod identity;
mod output;
mod progress;
mod reading_options;
mod reference;
mod regular_file;
mod report_file;
mod resume;
mod session;
mod setting;
mod shell;
mod simulator;
mod stamp;
mod streams;
mod unit_file;

pub use answering::Source;
pub use args::{Cli, DiagnoseArgs, ExitBy, GlobalArgs, OutputFormat};
pub use command::diagnose_with;
pub use config::{LoadError, config_reference, load};
pub use deciding::Deciding;
pub use diagnoser::Diagnoser;
pub use exit::ExitStatus;
pub use output::{Answer, Cell, Head, Kind};
pub use reference::{ListedOption, OptionValue, listed_options, reference};
pub use session::{Answers, Session, Stopped, parsed, simulated};
pub use setting::ResolvedSetting;
pub use streams::Streams;

use args::{BundleCommand, Command, UnitCommand};
use files::Files;

/// Runs a parsed command line.
///
/// # Errors
/// Whatever keeps the command from being done at all; what keeps single
/// recordings of a batch from being done is in the answer.
pub fn run(cli: &Cli, streams: &mut Streams<'_>) -> anyhow::Result<ExitStatus> {
    Files::of(&cli.command, &cli.global).check()?;
    if let (true, false, Some(path)) =
        (cli.global.is_config_found, cli.global.quiet, &cli.global.config)
    {
        streams.say(format_args!("settings of {}", path.display()));
    }
    match &cli.command {
        Command::Diagnose(args) => {
            let diagnoser = diagnoser::diagnoser(args, cli.global.root_seed())?;
            command::diagnose(diagnoser.as_ref(), args, &cli.global, streams)
        }
        Command::Setup(args) => command::setup(args, &cli.global, streams),
        Command::Merge(args) => command::merge(args, &cli.global, streams),
        Command::Simulate(args) => command::simulate(args, &cli.global, streams),
        Command::Dataset(args) => command::dataset(args, &cli.global, streams),
        Command::Bundle(BundleCommand::Build(args)) => command::build(args, &cli.global, streams),
        Command::Bundle(BundleCommand::Show(args)) => command::show(args, &cli.global, streams),
        Command::Evaluate(args) => command::evaluate_protocol(args, &cli.global, streams),
        Command::Calibrate(args) => command::calibrate(args, &cli.global, streams),
        Command::Explain(args) => command::explain(args, &cli.global, streams),
        Command::Propose(args) => command::propose(args, &cli.global, streams),
        Command::Unit(UnitCommand::Learn(args)) => command::learn(args, &cli.global, streams),
        Command::Unit(UnitCommand::Update(args)) => command::update(args, &cli.global, streams),
        Command::Unit(UnitCommand::Reset(args)) => command::reset(args, &cli.global, streams),
        Command::Unit(UnitCommand::Show(args)) => command::show_unit(args, &cli.global, streams),
        Command::Unit(UnitCommand::Model(args)) => command::write_model(args, &cli.global, streams),
        Command::Effects(args) => command::effects(args, &cli.global, streams),
        Command::Schema(args) => command::schema(args, &cli.global, streams),
        Command::Completions(args) => command::completions(args, &cli.global, streams),
        Command::Man => command::man(&cli.global, streams),
        Command::Inspect(args) => command::inspect(args, &cli.global, streams),
    }
}
