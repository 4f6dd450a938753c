//! What a sweep runs: its axes, and the run at each of their points.

use crate::error::Error;
use model::{Mode, Scenario};
use scenarios::{Files, NamedIn, NoFiles, Overrides, Problems};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The name and version of the plan in `sweep.json`.
pub const SCHEMA: &str = "shoal.sweep-plan/1";
/// More runs are refused: their records would not fit the memory.
pub const RUNS_MAX: usize = 100_000;
/// Keys that another option sets.
const KEYS_OF_OPTIONS: [(&str, &str); 2] = [("clock.seed", "--seeds"), ("clock.mode", "--mode")];

/// A scenario of a sweep. Two are equal if their names and fingerprints are: a plan that was read from a file has no texts.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScenarioSource {
    /// As the command line named it: a file, or a name of the catalog.
    pub name: String,
    /// Its TOML.
    #[serde(skip)]
    pub text: String,
    /// Fingerprint of the text, 16 hexadecimal digits.
    pub text_hash: String,
    /// Where the files are that it names.
    #[serde(skip, default = "no_files")]
    pub files: Arc<dyn Files + Send + Sync>,
}

fn no_files() -> Arc<dyn Files + Send + Sync> {
    Arc::new(NoFiles)
}

impl ScenarioSource {
    /// A scenario of this name and text.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> ScenarioSource {
        let text = text.into();
        ScenarioSource { name: name.into(), text_hash: fingerprint(text.as_bytes()), text, files: no_files() }
    }

    /// The same with the files that it names. Their contents are in the fingerprint: a map that has changed is another scenario.
    pub fn with_files(self, files: impl Files + Send + Sync + 'static) -> ScenarioSource {
        let watched = Watched { files: &files, bytes: RefCell::new(self.text.clone().into_bytes()) };
        // Problems are reported when the runs are checked.
        let _ = scenarios::parse_with_files(&self.name, &self.text, &Overrides::default(), &watched);
        let text_hash = fingerprint(&watched.bytes.into_inner());
        ScenarioSource { files: Arc::new(files), text_hash, ..self }
    }
}

/// Files, and the bytes of all that were read, behind each other.
#[derive(Debug)]
struct Watched<'a> {
    files: &'a dyn Files,
    bytes: RefCell<Vec<u8>>,
}

impl Files for Watched<'_> {
    fn read(&self, path: &str, named_in: NamedIn, bytes_max: u64) -> Result<Vec<u8>, String> {
        let read = self.files.read(path, named_in, bytes_max)?;
        self.bytes.borrow_mut().extend_from_slice(&read);
        Ok(read)
    }
}

impl PartialEq for ScenarioSource {
    fn eq(&self, other: &ScenarioSource) -> bool {
        (&self.name, &self.text_hash) == (&other.name, &other.text_hash)
    }
}

impl Eq for ScenarioSource {}

/// A key of the scenarios and the values that it takes, as TOML.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Varied {
    /// The path of the key, as in `radio.drop`.
    pub key: String,
    /// Its values.
    pub values: Vec<String>,
}

impl Varied {
    /// Reads `KEY=VALUE,VALUE,...`. Commas in brackets, braces and quotes belong to a value.
    ///
    /// # Errors
    /// In words, when it has no key or no value.
    pub fn parse(text: &str) -> Result<Varied, String> {
        let example = "write KEY=VALUE,VALUE,..., as in radio.drop=0,0.1,0.2";
        let (key, values) = text.split_once('=').ok_or_else(|| format!("`{text}` has no `=`; {example}"))?;
        let values = split(values);
        if key.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err(format!("`{text}` lacks a key or a value; {example}"));
        }
        Ok(Varied { key: key.trim().to_owned(), values })
    }
}

/// Splits at commas outside of brackets, braces and quotes.
fn split(text: &str) -> Vec<String> {
    let (mut depth, mut quote, mut escaped) = (0, None, false);
    let mut parts = vec![String::new()];
    for c in text.chars() {
        match (quote, c) {
            (Some('"'), '\\') if !escaped => {
                escaped = true;
                parts.last_mut().expect("one at least").push(c);
                continue;
            }
            (Some(open), _) if c == open && !escaped => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '[' | '{') => depth += 1,
            (None, ']' | '}') => depth -= 1,
            (None, ',') if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        escaped = false;
        parts.last_mut().expect("one at least").push(c);
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}

/// What a sweep runs. The axes are scenarios, planners, varied keys and seeds; the run number counts through them, seeds
/// fastest. Another axis is one more list here, one more digit in [`Plan::run`], and one more override in [`Run::overrides`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of shoal.
    pub shoal: String,
    /// Fingerprint of the executable: trajectories are guaranteed for the same binary only.
    pub build: String,
    /// Clock mode.
    pub mode: Mode,
    /// The scenarios.
    pub scenarios: Vec<ScenarioSource>,
    /// The planners; without any, the scenarios' own.
    pub planners: Vec<String>,
    /// Settings of all runs, `KEY=VALUE`.
    pub set: Vec<String>,
    /// The varied keys.
    pub varied: Vec<Varied>,
    /// The seeds.
    pub seeds: Vec<u64>,
}

/// One run of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Run<'a> {
    /// Its number.
    pub index: usize,
    /// The number of its cell: of the runs that differ in the seed only.
    pub cell: usize,
    /// The scenario.
    pub scenario: &'a ScenarioSource,
    /// The planner of all robots; `None`: the scenario's own.
    pub planner: Option<&'a str>,
    /// The varied keys and their values here.
    pub varied: Vec<(&'a str, &'a str)>,
    /// The seed.
    pub seed: u64,
    plan: &'a Plan,
}

impl Plan {
    /// Checks that there are not too many runs, and none of them twice.
    ///
    /// # Errors
    /// Of kind `Usage`.
    pub fn check(&self) -> Result<(), Error> {
        unique("scenario", self.scenarios.iter().map(|scenario| scenario.name.as_str()))?;
        unique("planner", self.planners.iter().map(String::as_str))?;
        unique("seed", self.seeds.iter().map(u64::to_string))?;
        unique("key", self.varied.iter().map(|varied| varied.key.as_str()))
            .map_err(|error| Error { hints: vec!["give all of its values with one --vary".to_owned()], ..error })?;
        for Varied { key, values } in &self.varied {
            unique(&format!("value of `{key}`"), values.iter().map(String::as_str))?;
            if let Some((_, option)) = KEYS_OF_OPTIONS.iter().find(|(known, _)| known == key) {
                return Err(Error::usage(format!("key `{key}`: it cannot be varied")).hint(format!("use {option}")));
            }
            if self.set.iter().any(|set| set.split_once('=').is_some_and(|(set, _)| set.trim() == key)) {
                return Err(Error::usage(format!("key `{key}`: it is set and varied"))
                    .hint("give it with --set or with --vary"));
            }
        }
        let axes = self.varied.iter().map(|varied| varied.values.len());
        let mut sizes = [self.scenarios.len(), self.planners.len().max(1), self.seeds.len()].into_iter().chain(axes);
        let runs = sizes.try_fold(1_usize, |all, size| all.checked_mul(size));
        match runs {
            Some(runs) if runs <= RUNS_MAX => Ok(()),
            _ => Err(Error::usage(format!("the sweep has more than {RUNS_MAX} runs"))
                .hint("split it into several sweeps, or take fewer seeds")),
        }
    }

    /// Number of runs.
    pub fn runs(&self) -> usize {
        self.cells() * self.seeds.len()
    }

    /// Number of cells: of combinations of everything but the seed.
    pub fn cells(&self) -> usize {
        self.scenarios.len() * self.planners.len().max(1) * self.settings()
    }

    /// Number of combinations of the varied keys.
    pub fn settings(&self) -> usize {
        self.varied.iter().map(|varied| varied.values.len()).product()
    }

    /// The run of this number, which is below [`Plan::runs`].
    pub fn run(&self, index: usize) -> Run<'_> {
        let (cell, seed) = (index / self.seeds.len(), index % self.seeds.len());
        let mut rest = cell;
        let mut digit = |size: usize| {
            let digit = rest % size;
            rest /= size;
            digit
        };
        let mut varied: Vec<(&str, &str)> = (self.varied.iter().rev())
            .map(|varied| (varied.key.as_str(), varied.values[digit(varied.values.len())].as_str()))
            .collect();
        varied.reverse();
        let planner = self.planners.get(digit(self.planners.len().max(1))).map(String::as_str);
        let scenario = &self.scenarios[rest];
        Run { index, cell, scenario, planner, varied, seed: self.seeds[seed], plan: self }
    }

    /// The cell with the same scenario and settings, and this planner.
    pub fn cell_with(&self, cell: usize, planner: &str) -> Option<usize> {
        let place = self.planners.iter().position(|name| name == planner)?;
        let (planners, settings) = (self.planners.len(), self.settings());
        let (scenario, setting) = (cell / settings / planners, cell % settings);
        Some((scenario * planners + place) * settings + setting)
    }

    /// What differs from a plan that was kept before: axis, what it was, what it is.
    pub fn differences(&self, before: &Plan) -> Vec<String> {
        let mut found = Vec::new();
        let mut of = |what: &str, words: &dyn Fn(&Plan) -> Vec<String>| {
            let [was, is] = [before, self].map(words);
            if was != is {
                found.push(difference(what, &was, &is));
            }
        };
        of("format", &|plan| vec![plan.schema.clone()]);
        of("mode", &|plan| vec![plan.mode.word().to_owned()]);
        of("scenarios", &|plan| plan.scenarios.iter().map(|scenario| scenario.name.clone()).collect());
        of("planners", &|plan| plan.planners.clone());
        of("--set", &|plan| plan.set.clone());
        let vary = |Varied { key, values }: &Varied| format!("{key}={}", values.join(","));
        of("--vary", &|plan| plan.varied.iter().map(vary).collect());
        of("seeds", &|plan| plan.seeds.iter().map(u64::to_string).collect());
        of("version of shoal", &|plan| vec![plan.shoal.clone()]);
        if before.shoal == self.shoal && before.build != self.build {
            found.push("the executable: another build of shoal made these runs".to_owned());
        }
        for (was, is) in before.scenarios.iter().zip(&self.scenarios) {
            if was.name == is.name && was.text_hash != is.text_hash {
                found.push(format!("the text of scenario `{}` has changed", is.name));
            }
        }
        found
    }
}

/// How two lists differ; of long ones, in which entry.
fn difference(what: &str, was: &[String], is: &[String]) -> String {
    const SHOWN_MAX: usize = 120;
    let list = |words: &[String]| if words.is_empty() { "none".to_owned() } else { words.join(", ") };
    let [was_list, is_list] = [list(was), list(is)];
    if was_list.chars().count().max(is_list.chars().count()) <= SHOWN_MAX {
        return format!("{what}: {was_list} before, {is_list} now");
    }
    let place = was.iter().zip(is).take_while(|(was, is)| was == is).count();
    let entry = |words: &[String]| words.get(place).map_or("none", String::as_str).to_owned();
    let [was_entry, is_entry] = [was, is].map(|words| report::cut(&entry(words), SHOWN_MAX));
    format!("{what}: {} before, {} now; entry {}: {was_entry} before, {is_entry} now", was.len(), is.len(), place + 1)
}

/// Refuses words that are there twice.
fn unique<T: AsRef<str>>(what: &str, words: impl Iterator<Item = T>) -> Result<(), Error> {
    let mut seen = BTreeSet::new();
    for word in words {
        if !seen.insert(word.as_ref().to_owned()) {
            let word = word.as_ref().escape_debug().to_string();
            return Err(Error::usage(format!("{what} `{word}`: it is given twice")).hint("give it once"));
        }
    }
    Ok(())
}

impl Run<'_> {
    /// What the run changes in its scenario.
    pub fn overrides(&self) -> Overrides {
        let varied = self.varied.iter().map(|(key, value)| format!("{key}={value}"));
        Overrides {
            mode: Some(self.plan.mode),
            planner: self.planner.map(str::to_owned),
            seed: Some(self.seed),
            set: self.plan.set.iter().cloned().chain(varied).collect(),
            ..Overrides::default()
        }
    }

    /// The scenario, checked.
    ///
    /// # Errors
    /// With all of its problems.
    pub fn scenario(&self) -> Result<Scenario, Problems> {
        let ScenarioSource { name, text, files, .. } = self.scenario;
        scenarios::parse_with_files(name, text, &self.overrides(), &**files)
    }

    /// The varied keys and their values as a map.
    pub fn varied_map(&self) -> BTreeMap<String, String> {
        self.varied.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
    }

    /// The options of `shoal run` that make this run of its scenario.
    pub fn options(&self) -> Vec<String> {
        let mut words = vec!["--mode".to_owned(), self.plan.mode.word().to_owned()];
        let mut option = |name: &str, value: &str| words.extend([name.to_owned(), value.to_owned()]);
        if let Some(planner) = self.planner {
            option("--planner", planner);
        }
        option("--seed", &self.seed.to_string());
        self.overrides().set.iter().for_each(|set| option("--set", set));
        words
    }

    /// The command that repeats the run, quoted for a shell, in pieces that belong on one line each.
    pub fn command(&self) -> Vec<String> {
        let first = format!("shoal run {}", quoted(&self.scenario.name));
        let pieces = self.options();
        let pieces = pieces.chunks(2).map(|pair| format!("{} {}", pair[0], quoted(&pair[1])));
        std::iter::once(first).chain(pieces).collect()
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_./:=,@%+-".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A fingerprint of bytes, 16 hexadecimal digits (FNV-1a, in words of eight bytes).
pub fn fingerprint(bytes: &[u8]) -> String {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64 ^ bytes.len() as u64;
    for chunk in bytes.chunks(8) {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        hash = (hash ^ u64::from_le_bytes(word)).wrapping_mul(0x0100_0000_01b3);
        hash ^= hash >> 29;
    }
    format!("{hash:016x}")
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Two scenarios, two planners, two keys, three seeds.
    pub(crate) fn plan() -> Plan {
        let varied = |text: &str| Varied::parse(text).unwrap();
        Plan {
            schema: SCHEMA.to_owned(),
            shoal: "0.1.0".to_owned(),
            build: "b".to_owned(),
            mode: Mode::Single,
            scenarios: vec![ScenarioSource::new("a.toml", "a"), ScenarioSource::new("b", "b")],
            planners: vec!["apf".to_owned(), "straight".to_owned()],
            set: vec!["clock.duration_s=9".to_owned()],
            varied: vec![varied("radio.drop=0,0.5"), varied("defaults.params={ a = 1, b = 2 },{}")],
            seeds: vec![7, 0, 3],
        }
    }

    /// A map of this text, whatever it is called.
    #[derive(Debug)]
    struct OneMap(&'static str);

    impl Files for OneMap {
        fn read(&self, _: &str, _: NamedIn, _: u64) -> Result<Vec<u8>, String> {
            Ok(self.0.as_bytes().to_vec())
        }
    }

    #[test]
    fn another_map_is_another_scenario() {
        let source = |text: &str, map| ScenarioSource::new("a.toml", text).with_files(OneMap(map));
        let [one, other] = ["type octile\nheight 1\nwidth 2\nmap\n..\n", "type octile\nheight 1\nwidth 2\nmap\n.@\n"];
        let with_map = "[world]\nmap = \"a.map\"\n";
        assert_eq!(source(with_map, one), source(with_map, one));
        assert_ne!(source(with_map, one), source(with_map, other));
        assert_eq!(source("", one), source("", other), "it names no map");
        assert_eq!(source("", one), ScenarioSource::new("a.toml", ""));
    }

    #[test]
    fn every_combination_is_one_run_and_seeds_come_fastest() {
        let plan = plan();
        assert_eq!((plan.check(), plan.runs(), plan.cells()), (Ok(()), 48, 16));
        let all: BTreeSet<String> = (0..48).map(|index| plan.run(index).command().join(" ")).collect();
        assert_eq!(all.len(), 48);
        assert_eq!([0, 1, 2].map(|index| plan.run(index).seed), [7, 0, 3]);
        let run = plan.run(47);
        assert_eq!((run.cell, run.scenario.name.as_str(), run.planner, run.seed), (15, "b", Some("straight"), 3));
        assert_eq!(run.varied, [("radio.drop", "0.5"), ("defaults.params", "{}")]);
        assert_eq!(
            plan.run(3).command().join(" "),
            "shoal run a.toml --mode single --planner apf --seed 7 --set clock.duration_s=9 --set radio.drop=0 --set \
             'defaults.params={}'"
        );
        for cell in 0..16 {
            let run = plan.run(cell * 3);
            let other = plan.run(plan.cell_with(cell, "straight").unwrap() * 3);
            assert_eq!((other.planner, other.varied, other.scenario), (Some("straight"), run.varied, run.scenario));
        }
        assert_eq!(plan.cell_with(3, "lanes"), None);
    }

    #[test]
    fn a_plan_without_planners_and_keys_has_one_cell_for_each_scenario() {
        let plan = Plan { planners: Vec::new(), varied: Vec::new(), set: Vec::new(), ..plan() };
        assert_eq!((plan.runs(), plan.run(5).planner), (6, None));
        assert_eq!(plan.run(5).command().join(" "), "shoal run b --mode single --seed 3");
    }

    #[test]
    fn values_are_split_at_the_commas_between_them() {
        let check = |text: &str, values: &[&str]| {
            let varied = Varied::parse(text).unwrap();
            assert_eq!((varied.key.as_str(), &varied.values[..]), ("k", &values.map_to_strings()[..]), "{text}");
        };
        check("k=1,2", &["1", "2"]);
        check("k = 1 , 2 ", &["1", "2"]);
        check("k=[1, 2],[3]", &["[1, 2]", "[3]"]);
        check(r#"k="a,\",b",'c,"',d"#, &[r#""a,\",b""#, r#"'c,"'"#, "d"]);
        check("k={ a = [1, 2] },{}", &["{ a = [1, 2] }", "{}"]);
        for wrong in ["k", "k=", "=1", "k=1,", "k=1,,2"] {
            assert!(Varied::parse(wrong).is_err(), "{wrong}");
        }
    }

    trait Strings {
        fn map_to_strings(&self) -> Vec<String>;
    }

    impl Strings for &[&str] {
        fn map_to_strings(&self) -> Vec<String> {
            self.iter().map(|word| (*word).to_owned()).collect()
        }
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        let check = |plan: Plan, words: &str| {
            let error = plan.check().unwrap_err();
            assert!(error.message.contains(words), "{words}: {error}");
        };
        check(Plan { seeds: vec![1, 1], ..plan() }, "seed `1`: it is given twice");
        check(Plan { planners: vec!["apf".into(), "apf".into()], ..plan() }, "planner `apf`: it is given twice");
        check(Plan { seeds: (0..10_000).collect(), ..plan() }, "more than 100000 runs");
        let varied = |texts: &[&str]| texts.iter().map(|text| Varied::parse(text).unwrap()).collect::<Vec<_>>();
        check(Plan { varied: varied(&["k=1,1"]), ..plan() }, "value of `k` `1`: it is given twice");
        check(Plan { varied: varied(&["k=1", "k=2"]), ..plan() }, "key `k`: it is given twice");
        check(Plan { varied: varied(&["clock.seed=1,2"]), ..plan() }, "key `clock.seed`: it cannot be varied");
        check(Plan { varied: varied(&["clock.duration_s=1,2"]), ..plan() }, "it is set and varied");
    }

    #[test]
    fn differences_name_the_axis() {
        let now = plan();
        assert_eq!(now.differences(&now), Vec::<String>::new());
        let seeds = Plan { seeds: vec![1], ..plan() };
        assert_eq!(now.differences(&seeds), ["seeds: 1 before, 7, 0, 3 now"]);
        let text =
            Plan { scenarios: vec![ScenarioSource::new("a.toml", "A"), ScenarioSource::new("b", "b")], ..plan() };
        assert_eq!(now.differences(&text), ["the text of scenario `a.toml` has changed"]);
        let many = |n: u64| Plan { seeds: (0..n).collect(), ..plan() };
        let words = ["seeds: 200 before, 201 now; entry 201: none before, 200 now"];
        assert_eq!(many(201).differences(&many(200)), words);
        let none = Plan { planners: Vec::new(), build: "c".to_owned(), ..plan() };
        assert_eq!(
            now.differences(&none),
            ["planners: none before, apf, straight now", "the executable: another build of shoal made these runs"]
        );
    }

    #[test]
    fn words_are_quoted_for_a_shell() {
        for (word, expected) in [("a/b.toml", "a/b.toml"), ("a b", "'a b'"), ("it's", r"'it'\''s'"), ("", "''")] {
            assert_eq!(quoted(word), expected);
        }
    }
}
