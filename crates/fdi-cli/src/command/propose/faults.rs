//! `fdi propose --faults`.

use std::{cell::RefCell, fmt::Write as _, path::Path, time::Instant};

use anyhow::{Context, Result, bail};
use fdi_core::{
    ChannelName, Experiment, PlanRequest, PlannedTest,
    ema_sim::{FaultId, model_file::Model},
    motion_limits, plan_test, read_model,
    report::{ExpectedStd, MotionLimits, PlannedFault, SCHEMA_VERSION, TestPlan, two_digits},
};

use super::{
    super::explain::{NO_SUCH_FORM, in_form},
    command_text,
};
use crate::{
    ExitStatus, GlobalArgs, OutputFormat, Streams,
    args::{DEFAULT_BEFORE, PlanArgs, ProposeArgs, TestArgs},
    experiment,
    output::{TOOL, table},
    stamp,
};

/// Standard deviation of a thermometer on the winding where none is given, K.
const READING_STD_K: f64 = 3.0;
/// Share of the least standard deviation to which a test tells all that there is.
const AS_GOOD_AS_LEAST: f64 = 1.1;

/// Plans a test for some faults, or for all where none is named, and writes its command.
#[expect(clippy::disallowed_methods, reason = "the time taken is part of the answer")]
pub(super) fn propose(
    args: &ProposeArgs,
    faults: &[FaultId],
    global: &GlobalArgs,
    streams: &mut Streams<'_>,
) -> Result<ExitStatus> {
    let start = Instant::now();
    check(args, global)?;
    let mut model = read_model(&args.model)?;
    let told = RefCell::new(&mut *streams);
    let tell = |what: &str| {
        if !global.quiet {
            told.borrow_mut().say(format_args!("{what}"));
        }
    };
    if experiment::take_usual_tolerances(&mut model) {
        tell(
            "the model file has no `[tolerance]`: taken are those that are usual for such actuators \
             (`docs/models/tolerances.md`)",
        );
    }
    let request = request(&args.plan, faults, &model, global);
    let before = compared(args, &model, &tell)?;
    let name = model.name.clone().unwrap_or_default();
    let plan = plan_test(&name, &model, before.as_ref(), &request, &tell)
        .with_context(|| args.model.clone())?;
    let mut answer = document(&plan, name, before.as_ref(), args, &request, global);
    answer.elapsed_s = (!global.stable).then(|| start.elapsed().as_secs_f64());
    let text = in_form(global.output_format, &answer, human)?;
    streams.product(None, |out| out.write_all(text.as_bytes()))?;
    if let Some(path) = &global.output {
        let load = vec![request.load_n_m; plan.command_rad.len()];
        let load = Some((ChannelName::Load, load.as_slice()));
        let text = command_text(plan.rate_hz, (ChannelName::Command, &plan.command_rad), load);
        streams.product(Some(path), |out| out.write_all(text.as_bytes()))?;
    }
    Ok(ExitStatus::Done)
}

/// Refuses options of the other kind of proposal, and forms that there are not.
fn check(args: &ProposeArgs, global: &GlobalArgs) -> Result<()> {
    let form = global.output_format;
    if !matches!(form, OutputFormat::Human | OutputFormat::Json | OutputFormat::Jsonl) {
        bail!("{NO_SUCH_FORM}");
    }
    let records = &args.records;
    let given = [
        (!records.holdout.is_empty(), "--holdout"),
        (!records.repeat.is_empty(), "--repeat"),
        (records.command.is_some(), "--command"),
        (records.inverse_dynamics, "--inverse-dynamics"),
        (records.correct, "--correct"),
    ];
    match given.into_iter().find(|(is_given, _)| *is_given) {
        Some((_, option)) => bail!("`{option}`: a test for faults is planned without recordings"),
        None => Ok(()),
    }
}

fn request(args: &PlanArgs, faults: &[FaultId], model: &Model, global: &GlobalArgs) -> PlanRequest {
    let usual = motion_limits(&model.actuator);
    let asked = if faults.is_empty() { &model.faults } else { faults };
    let is_size = |fault: &FaultId| *fault != FaultId::EccentricityPhase && asked.contains(fault);
    PlanRequest {
        faults: FaultId::ALL.into_iter().filter(is_size).collect(),
        within_s: args.within,
        references: args.references,
        reading_std_k: args.reading_std_k.unwrap_or(READING_STD_K),
        is_read: args.reading_std_k.is_some(),
        has_voltage: args.motor_voltage,
        load_n_m: args.load_n_m,
        limits: MotionLimits {
            travel_rad: args.most_travel_rad.unwrap_or(usual.travel_rad),
            speed_rad_per_s: args.most_speed_rad_per_s.unwrap_or(usual.speed_rad_per_s),
            current_a: args.most_current_a.unwrap_or(usual.current_a),
        },
        seed: global.root_seed(),
        jobs: global.threads(),
    }
}

/// The test that the plan is compared with; `None` where it is the default and the machine cannot run
/// it.
fn compared(args: &ProposeArgs, model: &Model, tell: &dyn Fn(&str)) -> Result<Option<Experiment>> {
    let command = &args.plan.before;
    let test = TestArgs {
        model: args.model.clone(),
        command: command.clone(),
        load_n_m: None,
        start_angle_rad: 0.0,
    };
    match experiment::experiment_of(model, &test) {
        Ok(before) => Ok(Some(before)),
        Err(error) if command == DEFAULT_BEFORE => {
            tell(&format!("no comparison with the chirp: {error:#}"));
            Ok(None)
        }
        Err(error) => Err(error.context(format!("`--before {command}`"))),
    }
}

fn document(
    plan: &PlannedTest,
    name: String,
    before: Option<&Experiment>,
    args: &ProposeArgs,
    request: &PlanRequest,
    global: &GlobalArgs,
) -> TestPlan {
    let named = &args.plan.before;
    let file = Path::new(named).file_name();
    TestPlan {
        schema_version: SCHEMA_VERSION,
        tool: TOOL.to_owned(),
        seed: global.seed,
        stamp: global.stamp.then(stamp::now),
        model: name,
        compared_with: file.map_or(named.clone(), |name| name.to_string_lossy().into()),
        compared_load_n_m: before.map(|test| test.scenario.load_n_m),
        references: request.references,
        reading_std_k: request.reading_std_k,
        is_read: request.is_read,
        has_voltage: request.has_voltage,
        load_n_m: request.load_n_m,
        within_s: request.within_s,
        limits: request.limits,
        duration_s: plan.command_rad.len() as f64 / plan.rate_hz,
        motions: plan.motions.clone(),
        candidates: plan.candidates,
        faults: plan.faults.clone(),
        elapsed_s: None,
    }
}

fn human(plan: &TestPlan) -> String {
    let mut text = String::new();
    // text takes what is written
    let _ = write_human(&mut text, plan);
    text
}

fn write_human(text: &mut String, plan: &TestPlan) -> std::fmt::Result {
    let asked: Vec<&str> =
        plan.faults.iter().filter(|fault| fault.is_asked).map(|fault| fault.id.id()).collect();
    let MotionLimits { travel_rad, speed_rad_per_s, current_a } = plan.limits;
    writeln!(
        text,
        "{}: test of {:.2} s for {}: {} of {} motions within ±{travel_rad} rad, {speed_rad_per_s} rad/s \
         of the rotor and {current_a} A, under {} N·m\n",
        plan.model,
        plan.duration_s,
        asked.join(", "),
        plan.motions.len(),
        plan.candidates,
        plan.load_n_m
    )?;
    let cells = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    let motions: Vec<Vec<String>> = plan
        .motions
        .iter()
        .map(|motion| {
            let times = [motion.begins_s, motion.duration_s].map(|time_s| format!("{time_s:.2} s"));
            let speed = format!("{:.0} rad/s", motion.rotor_rad_per_s);
            [times.to_vec(), vec![motion.description.clone(), speed]].concat()
        })
        .collect();
    table(text, &cells(["from", "for", "motion", "rotor"]), &motions)?;
    writeln!(
        text,
        "\nstandard deviation expected of one recording beside {} as new of the same test; in brackets \
         with the winding's temperature read to {} K, and with the motor's voltage",
        plan.references, plan.reading_std_k
    )?;
    let load = plan.compared_load_n_m.map(|load_n_m| format!(", {load_n_m} N·m"));
    let before = plan.compared_with.clone() + &load.unwrap_or_default();
    let header = cells(["fault", &before, "this test", "any test"]);
    let faults: Vec<Vec<String>> = plan
        .faults
        .iter()
        .map(|fault| {
            let stds = [fault.before, fault.planned, fault.least].map(in_words);
            [vec![fault.id.short_name()], stds.to_vec()].concat()
        })
        .collect();
    table(text, &header, &faults)?;
    let limits: Vec<String> = plan.faults.iter().filter_map(|fault| limit(fault, plan)).collect();
    if !limits.is_empty() {
        writeln!(text, "\nno longer test tells much more of")?;
        limits.iter().try_for_each(|line| writeln!(text, "  {line}"))?;
    }
    Ok(())
}

fn in_words(std: Option<ExpectedStd>) -> String {
    std.map_or("-".to_owned(), |std| {
        let ExpectedStd { alone, with_reading, with_voltage } = std;
        format!(
            "{} ({}, {})",
            two_digits(alone),
            two_digits(with_reading),
            two_digits(with_voltage)
        )
    })
}

/// The limit of a fault that the test tells as well as any, in words.
fn limit(fault: &PlannedFault, plan: &TestPlan) -> Option<String> {
    let [planned, least] = [fault.planned?, fault.least?].map(|std| {
        if plan.has_voltage {
            std.with_voltage
        } else if plan.is_read {
            std.with_reading
        } else {
            std.alone
        }
    });
    if planned > AS_GOOD_AS_LEAST * least {
        return None;
    }
    let id = fault.id;
    // numbers are known in turn beside the current alone
    let is_alone = !plan.is_read && !plan.has_voltage;
    let shared = fault.shared_with.as_ref().filter(|_| is_alone);
    Some(shared.map_or_else(
        || format!("{id}: {}", two_digits(least)),
        |shared| {
            format!(
                "{id}: {}; it is shared with `{}` of `[tolerance]`, and would be {} were that known",
                two_digits(least),
                shared.key,
                two_digits(shared.std)
            )
        },
    ))
}
