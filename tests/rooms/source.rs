//! The sources of a crate: which of its modules names which.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The root of the workspace.
pub(crate) fn workspace_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package is a folder of the workspace").to_owned()
}

/// The packages of `known` that a package depends on, tests apart.
pub(crate) fn manifest_dependencies(package: &Path, known: &[&str]) -> BTreeSet<String> {
    let text = read(&package.join("Cargo.toml"));
    let mut section = "";
    let mut found = BTreeSet::new();
    for line in text.lines().map(str::trim) {
        if line.starts_with('[') {
            section = line;
        } else if section == "[dependencies]" {
            let name = line.split(['.', ' ', '=']).next().unwrap_or_default();
            if known.contains(&name) {
                found.insert(name.to_owned());
            }
        }
    }
    found
}

/// Every file below a folder, by its path in it, without comments, texts and tests.
pub(crate) fn code_of(folder: &Path) -> Vec<(String, String)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        for entry in std::fs::read_dir(&current).unwrap_or_else(|error| panic!("{}: {error}", current.display())) {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                folders.extend((name != "tests" && name != "snapshots").then_some(path));
            } else if name.ends_with(".rs") && name != "tests.rs" {
                let inside = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                files.push((inside, without_talk(&read(&path))));
            }
        }
    }
    assert!(!files.is_empty(), "{} has no source", folder.display());
    files.sort();
    files
}

#[expect(clippy::disallowed_methods, reason = "a test of sources")]
pub(crate) fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Code without comments, and without the tests in it.
fn without_talk(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let line = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// The modules of a crate: the files and folders in its `src`, each with everything in it. The root is transparent: a name
/// that it re-exports is a name of the module that has it.
pub(crate) struct Crate {
    /// By module, the files: how deep in the module, and the code.
    modules: BTreeMap<String, Vec<(usize, String)>>,
    /// What the root re-exports, and whose it is.
    aliases: BTreeMap<String, String>,
}

impl Crate {
    pub(crate) fn read(src: &Path) -> Crate {
        Crate::of(code_of(src))
    }

    pub(crate) fn of(files: impl IntoIterator<Item = (String, String)>) -> Crate {
        let mut modules = BTreeMap::<String, Vec<(usize, String)>>::new();
        let mut root = String::new();
        for (file, code) in files {
            let parts: Vec<&str> = file.trim_end_matches(".rs").split('/').collect();
            match parts[..] {
                ["lib" | "main"] => root += &code,
                [top, ..] => {
                    let depth = parts.len() - 1 - usize::from(parts.last() == Some(&"mod"));
                    modules.entry(top.to_owned()).or_default().push((depth, code));
                }
                [] => {}
            }
        }
        let mut aliases = BTreeMap::new();
        for path in paths(&root) {
            let path = path.strip_prefix("crate::").unwrap_or(&path).to_owned();
            if let Some((module, name)) = path.split_once("::")
                && modules.contains_key(module)
            {
                aliases.insert(name.rsplit("::").next().unwrap_or(name).to_owned(), module.to_owned());
            }
        }
        Crate { modules, aliases }
    }

    /// Which module names which.
    pub(crate) fn arrows(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut arrows = BTreeMap::<String, BTreeSet<String>>::new();
        for (module, files) in &self.modules {
            let into = arrows.entry(module.clone()).or_default();
            for (depth, code) in files {
                let named = paths(code).into_iter().filter_map(|path| self.target(&path, *depth));
                into.extend(named.filter(|target| target != module));
            }
        }
        arrows
    }

    /// The module that a path leads to, out of a file that is so deep in its own.
    fn target(&self, path: &str, depth: usize) -> Option<String> {
        let mut parts = path.split("::").peekable();
        match parts.peek().copied()? {
            "crate" => _ = parts.next(),
            "super" => {
                let mut up = 0;
                while parts.next_if_eq(&"super").is_some() {
                    up += 1;
                }
                if up <= depth {
                    return None;
                }
            }
            _ => return None,
        }
        let first = parts.next()?;
        if self.modules.contains_key(first) { Some(first.to_owned()) } else { self.aliases.get(first).cloned() }
    }
}

/// Every path in `use` declarations, groups taken apart, and every other path that begins with `crate` or `super`.
fn paths(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("use ") {
        let begins = code[..at].chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '_');
        if let Some(end) = code[at..].find(';').filter(|_| begins) {
            let tree: String = code[at + 4..at + end].split_whitespace().collect::<Vec<_>>().join(" ");
            take_apart("", &tree, &mut found);
        }
    }
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start) {
            let rest = &code[at..];
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':').unwrap_or(rest.len());
            found.push(rest[..end].trim_end_matches(':').to_owned());
        }
    }
    found
}

fn take_apart(prefix: &str, tree: &str, found: &mut Vec<String>) {
    let tree = tree.trim();
    let Some(open) = tree.find('{') else {
        let path = tree.split(" as ").next().unwrap_or(tree);
        found.push(format!("{prefix}{path}"));
        return;
    };
    let prefix = format!("{prefix}{}", &tree[..open]);
    let inside = tree[open + 1..].trim_end().trim_end_matches('}');
    // The last brace may have belonged to an inner group: count them.
    let missing = inside.matches('{').count() - inside.matches('}').count().min(inside.matches('{').count());
    let inside = format!("{inside}{}", "}".repeat(missing));
    let (mut depth, mut begin) = (0, 0);
    for (at, c) in inside.char_indices().chain([(inside.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                if !inside[begin..at].trim().is_empty() {
                    take_apart(&prefix, &inside[begin..at], found);
                }
                begin = (at + 1).min(inside.len());
            }
            _ => {}
        }
    }
}

/// Modules that lead back to themselves, each group once.
pub(crate) fn circles(arrows: &BTreeMap<String, BTreeSet<String>>) -> Vec<Vec<String>> {
    let reach = |from: &String| -> BTreeSet<String> {
        let (mut seen, mut next) = (BTreeSet::new(), vec![from.clone()]);
        while let Some(module) = next.pop() {
            for target in arrows.get(&module).into_iter().flatten() {
                if seen.insert(target.clone()) {
                    next.push(target.clone());
                }
            }
        }
        seen
    };
    let reached: BTreeMap<&String, BTreeSet<String>> = arrows.keys().map(|module| (module, reach(module))).collect();
    let mut found = BTreeSet::new();
    for (module, targets) in &reached {
        if targets.contains(*module) {
            let back = |other: &&String| reached.get(other).is_some_and(|targets| targets.contains(*module));
            found.insert(targets.iter().filter(back).cloned().collect::<Vec<String>>());
        }
    }
    found.into_iter().collect()
}
