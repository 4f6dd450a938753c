//! What is packaged, without the tools that package: that files which a package names are made, and that they are there.

use std::collections::BTreeSet;
use std::path::Path;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace")
}

fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// What stands in quotes in a line.
fn quoted(line: &str) -> Vec<&str> {
    line.split('"').skip(1).step_by(2).collect()
}

#[test]
fn what_the_package_for_debian_holds_is_made_or_is_there() {
    let (manifest, script) = (read("cli/Cargo.toml"), read("packaging/deb"));
    let (_, assets) = manifest.split_once("\nassets = [\n").expect("the package has assets");
    let (assets, _) = assets.split_once("\n]").expect("a list ends");
    // The man pages are written and packed together, and the completions in a loop over the shells.
    let made = script
        .replace("man --out \"$made/man\"", "$made/man/*.gz")
        .replace("for shell in bash zsh fish;", "$made/shoal.bash $made/shoal.zsh $made/shoal.fish");
    let made: BTreeSet<&str> =
        made.split([' ', '"', '\n', ';']).filter_map(|word| word.strip_prefix("$made/")).collect();
    let mut installed = BTreeSet::new();
    for line in assets.lines() {
        let [from, to, mode] = quoted(line)[..] else { panic!("{line}") };
        let from = from.strip_prefix("../").expect("it is named from the manifest's directory");
        match from.strip_prefix("target/package/") {
            Some(file) => assert!(made.contains(file), "packaging/deb does not make `{file}`: {made:?}"),
            None => assert!(root().join(from).is_file(), "file `{from}` is missing"),
        }
        assert_eq!(mode, if to == "usr/bin/" { "755" } else { "644" }, "{line}");
        let name = from.rsplit('/').next().filter(|_| to.ends_with('/')).unwrap_or("");
        installed.insert(format!("{to}{name}"));
    }
    // Where the programs of others look for them.
    for path in [
        "usr/bin/shoal",
        "usr/share/man/man1/*.gz",
        "usr/share/bash-completion/completions/shoal",
        "usr/share/zsh/vendor-completions/_shoal",
        "usr/share/fish/vendor_completions.d/shoal.fish",
    ] {
        assert!(installed.contains(path), "{path}: {installed:?}");
    }
}

#[test]
fn what_the_image_copies_is_there_and_what_builds_made_is_not_sent() {
    let file = read("packaging/Dockerfile");
    let copied: Vec<&str> = file.split_whitespace().filter_map(|word| word.strip_prefix("/shoal/")).collect();
    assert!(copied.contains(&"target/release/shoal"), "{copied:?}");
    for path in copied.iter().filter(|path| **path != "target/release/shoal") {
        assert!(root().join(path).is_file(), "file `{path}` is missing");
    }
    let left_out = read(".dockerignore");
    assert!(left_out.lines().any(|line| line == "**/target"), "{left_out}");
}
