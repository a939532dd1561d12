//! The library crates as somebody else gets them: packed, unpacked, and each used alone by a
//! project outside this workspace, with the example of its own README.

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// The library crates and what of each other they use.
const CRATES: [(&str, &[&str]); 7] = [
    ("recordings", &[]),
    ("ema-sim", &[]),
    ("inference", &[]),
    ("reduction", &[]),
    ("gp-bayesopt", &[]),
    ("fdi-report", &["recordings"]),
    ("fdi-core", &["recordings", "fdi-report", "ema-sim", "inference", "reduction", "gp-bayesopt"]),
];

fn run(command: &mut Command) {
    let output = command.output().unwrap();
    let (out, err) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
}

/// Packs all crates, in a folder that is kept between runs, and unpacks them into another.
fn packages(workspace: &Path, unpacked: &Path) -> PathBuf {
    let target = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("outside");
    let mut pack = Command::new(env!("CARGO"));
    pack.current_dir(workspace).args(["package", "--no-verify", "--allow-dirty", "--offline"]);
    pack.arg("--target-dir").arg(&target);
    for (name, _) in CRATES {
        pack.args(["--package", name]);
    }
    run(&mut pack);
    for (name, _) in CRATES {
        let file = format!("{name}-{}.crate", env!("CARGO_PKG_VERSION"));
        let file = target.join("package").join(file);
        run(Command::new("tar").current_dir(unpacked).arg("-xzf").arg(file));
    }
    target
}

/// The first example of a README, as a program.
fn example(readme: &str) -> String {
    let block = readme.split("```rust\n").nth(1).unwrap().split("```").next().unwrap();
    let lines: Vec<_> = block.lines().filter(|line| !line.starts_with("# ")).collect();
    let body = lines.join("\n");
    if body.contains("fn main()") {
        return body;
    }
    format!("fn main() -> Result<(), Box<dyn std::error::Error>> {{\n{body}\nOk(())\n}}\n")
}

#[test]
#[ignore = "slow: builds every library crate again, minutes"]
fn each_crate_is_used_alone_from_outside() {
    let workspace = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = tempfile::tempdir().unwrap();
    let target = packages(&workspace, folder.path());
    let unpacked = |name: &str| folder.path().join(format!("{name}-{}", env!("CARGO_PKG_VERSION")));
    for (name, uses) in CRATES {
        let project = folder.path().join(format!("uses-{name}"));
        fs::create_dir_all(project.join("src")).unwrap();
        let mut manifest = format!(
            "[package]\nname = \"uses-{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\
             [workspace]\n[dependencies]\n{name} = {{ path = {:?} }}\n[patch.crates-io]\n",
            unpacked(name)
        );
        for used in uses {
            writeln!(manifest, "{used} = {{ path = {:?} }}", unpacked(used)).unwrap();
        }
        fs::write(project.join("Cargo.toml"), manifest).unwrap();
        fs::copy(workspace.join("Cargo.lock"), project.join("Cargo.lock")).unwrap();
        let readme = fs::read_to_string(unpacked(name).join("README.md")).unwrap();
        fs::write(project.join("src/main.rs"), example(&readme)).unwrap();
        let mut cargo = Command::new(env!("CARGO"));
        run(cargo
            .args(["run", "--offline", "--quiet"])
            .current_dir(&project)
            .env("CARGO_TARGET_DIR", target.join("build")));
    }
}
