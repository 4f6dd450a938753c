//! Builds what is to be measured. What cannot be built is not measured, and the cause is told.

use crate::peers::{Beside, DORA, Peer, Tools};
use std::path::Path;
use std::process::{Command, Stdio};

/// Builds a peer and installs what it needs, or says why not.
pub(crate) fn prepare(peer: &Peer, tools: &Tools) -> Result<(), String> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("Cargo.toml");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let target = tools.executables.parent().unwrap_or(&tools.executables);
    // Niced: this takes minutes, and others may be at work.
    let mut build = Command::new("nice");
    build.args(["-n", "19"]).arg(cargo).args(["build", "--release", "--locked", "--package", peer.package]);
    build.arg("--manifest-path").arg(manifest).arg("--target-dir").arg(target);
    // What `cargo run` told this process about its own package: build scripts would take it for a change.
    for (key, _) in std::env::vars_os() {
        let name = key.to_string_lossy();
        if name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_") {
            build.env_remove(&key);
        }
    }
    run(build, "cargo build")?;
    if peer.beside == Beside::Dora && !has_dora(tools) {
        eprintln!("installing dora-rs-cli {DORA}");
        let mut venv = Command::new("python3");
        venv.args(["-m", "venv", "--clear"]).arg(tools.venv());
        run(venv, "python3 -m venv")?;
        let mut pip = Command::new(tools.venv().join("bin/pip"));
        pip.args(["install", "--quiet", "--disable-pip-version-check", &format!("dora-rs-cli=={DORA}")]);
        run(pip, "pip install dora-rs-cli")?;
    }
    Ok(())
}

fn has_dora(tools: &Tools) -> bool {
    let output = Command::new(tools.dora()).arg("--version").output();
    output.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains(DORA))
}

/// Runs a command whose talk goes to stderr; its first error line is the cause if it fails.
fn run(mut command: Command, what: &str) -> Result<(), String> {
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let output = child.and_then(std::process::Child::wait_with_output).map_err(|e| format!("{what}: {e}"))?;
    if output.status.success() {
        return Ok(());
    }
    let talk = String::from_utf8_lossy(&output.stderr).into_owned();
    let cause = talk.lines().find(|line| line.to_lowercase().starts_with("error")).or(talk.lines().last());
    Err(format!("{what}: {}", cause.map_or_else(|| output.status.to_string(), str::to_owned)))
}
