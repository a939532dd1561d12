//! Development tasks of the workspace: `cargo xtask …`.

mod ci;
mod docs;
mod files_check;
mod fleet_check;
mod gen_dataset;
mod picture;
mod python;
mod tidy;

use anyhow::{Result, bail};

/// That of `fdi`, whose times the pages give.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Text of `cargo xtask` without a task.
const TASKS: &str = "\
cargo xtask gen-dataset [--check]       rebuild datasets, bundles and recordings, or compare them
cargo xtask validate [PAGE] [--check]   rebuild docs/validation, or recompute its quick figures
cargo xtask validate PAGE SECTION       rebuild one section of a long page
cargo xtask blind [FLAG...]             the scored hidden-effect cases
cargo xtask mutants                     breaks the program in a copy, one way after another, and tells which test sees it
cargo xtask budget                      the inference budgets, guarded
cargo xtask same-answers FDI [FLAG...]  answers of another program compared with those of this one, byte by byte
cargo xtask docs [--check]              rebuild the generated reference pages and drawings, or compare them
cargo xtask python                      the wheel: build, types, tests; skipped without Python
cargo xtask fleet-check [RECORDINGS]    a fleet on Spark, on Sail and in parts, workers killed meanwhile; docs/validation/fleet.md
cargo xtask files-check                 files of pandas, MATLAB, MDF, drives and others against their plain twins; docs/validation/files.md
cargo xtask tidy [--measures]           edges, paths, licences, prose, help, measures of the code; or all findings of these
cargo xtask ci                          all that must pass";

fn main() -> Result<()> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize()?;
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["blind", flags @ ..] => validation::score_blind_cases(&root, flags),
        ["budget"] => validation::check_budgets(&root),
        ["ci"] => ci::run(&root),
        ["docs"] => docs::run(&root, false),
        ["docs", "--check"] => docs::run(&root, true),
        ["files-check"] => files_check::run(&root),
        ["fleet-check"] => fleet_check::run(&root, None),
        ["fleet-check", recordings] => fleet_check::run(&root, Some(recordings)),
        ["gen-dataset"] => gen_dataset::run(&root, false),
        ["gen-dataset", "--check"] => gen_dataset::run(&root, true),
        ["mutants"] => validation::break_the_program(&root),
        ["python"] => python::run(&root),
        ["same-answers", arguments @ ..] => validation::same_answers(&root, arguments),
        ["tidy"] => tidy::run(&root),
        ["tidy", "--measures"] => tidy::measures(&root),
        ["validate"] => validation::validate_pages(&root, None, false),
        ["validate", "--check"] => validation::validate_pages(&root, None, true),
        ["validate", page] => validation::validate_pages(&root, Some(page), false),
        ["validate", page, "--check"] => validation::validate_pages(&root, Some(page), true),
        ["validate", page, section] => validation::validate_section(&root, page, section),
        other => bail!("unknown task {other:?}; the tasks are\n{TASKS}"),
    }
}
