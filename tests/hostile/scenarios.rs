//! Texts as large as a scenario may be.

use crate::counting::peak_of;
use scenarios::{Overrides, parse};
use shoal::source;
use std::ffi::OsStr;

/// The largest text that is read, bytes.
const SIZE: usize = 1 << 20;
/// A byte of a scenario may take this many, while it is checked.
const EXPANSION_MAX: usize = 200;
/// No list of problems is longer, bytes.
const PROBLEMS_MAX: usize = 200_000;

fn filled(begin: &str, line: impl Fn(usize) -> String, end: &str) -> String {
    let mut text = begin.to_owned();
    for n in 0.. {
        let line = line(n);
        if text.len() + line.len() + end.len() > SIZE {
            break;
        }
        text += &line;
    }
    text + end
}

#[test]
fn hostile_texts_are_refused_in_bounded_memory() {
    let all = [
        ("keys", filled("", |n| format!("k{n}=1\n"), "")),
        ("known keys", filled("", |n| format!("radius_m{n}=1\n"), "")),
        ("one name in many tables", filled("", |n| format!("[k{n}]\na=1\n"), "")),
        ("tables", filled("", |n| format!("[t{n}]\n"), "")),
        ("tables in tables", filled("", |n| format!("[a.b.c.t{n}]\n"), "")),
        ("lists of tables", filled("", |n| format!("[[t{n}]]\n"), "")),
        ("robots", filled("", |_| "[[robot]]\n".to_owned(), "")),
        ("robots with unknown keys", filled("", |n| format!("[[robot]]\nk{n}=1\n"), "")),
        ("robots in one place", filled("", |n| format!("[[robot]]\nid=\"r{n}\"\nstart_m=[0,0]\ngoal_m=[1,1]\n"), "")),
        ("obstacles", filled("", |_| "[[obstacle]]\n".to_owned(), "")),
        ("events", filled("", |_| "[[event]]\n".to_owned(), "")),
        ("corners", filled("[[obstacle]]\nshape=\"polygon\"\ncorners_m=[", |n| format!("[{n},0],"), "]")),
        ("waypoints", filled("[[robot]]\nid=\"a\"\nwaypoints_m=[", |_| "[1,1],".to_owned(), "]")),
        ("processors", filled("[processes.agents]\ncpus=[", |n| format!("{n},"), "]")),
        ("list", filled("x=[", |_| "1,".to_owned(), "]")),
        ("list of lists", filled("x=[", |_| "[],".to_owned(), "]")),
        ("deep list", filled("x=", |_| "[".to_owned(), "")),
        ("inline tables", filled("x=[", |_| "{a=1},".to_owned(), "]")),
        ("deep inline table", filled("x=", |_| "{a=".to_owned(), "")),
        ("dotted keys", filled("", |n| format!("a.b{n}.c=1\n"), "")),
        ("deep dotted key", filled("a", |_| ".a".to_owned(), "=1")),
        ("deep table", filled("[a", |_| ".a".to_owned(), "]")),
        ("deep tables", filled("", |n| format!("[a{}.k{n}]\n", ".a".repeat(60)), "")),
        ("long string", filled("description=\"", |_| "x".to_owned(), "\"")),
        ("long key", filled("", |_| "x".to_owned(), "=1")),
        ("long quoted key", filled("\"", |_| "\u{1f41f}".to_owned(), "\"=1")),
        ("long line", filled("", |_| "#".to_owned(), "")),
        ("long number", filled("x=", |_| "1".to_owned(), "")),
        ("numbers for an id", filled("[[robot]]\nid=\"", |_| "1".to_owned(), "\"")),
        ("methods", filled("", |n| format!("[planners.m{n}]\n"), "")),
        ("parameters", filled("[planners.apf]\n", |n| format!("p{n}=1\n"), "")),
        ("not TOML", filled("", |_| "]".to_owned(), "")),
        ("nothing", filled("", |_| "\n".to_owned(), "")),
    ];
    for (what, text) in &all {
        let (problems, peak) =
            peak_of(|| parse("hostile.toml", text, &Overrides::default()).expect_err(what).to_string());
        assert!(peak < EXPANSION_MAX * SIZE, "{what}: {peak} bytes");
        assert!(problems.len() < PROBLEMS_MAX, "{what}: {} bytes of problems", problems.len());
    }
}

#[test]
fn a_larger_file_is_refused_before_it_is_read() {
    let folder = tempfile::tempdir().expect("a temporary directory");
    let path = folder.path().join("large.toml");
    let file = std::fs::File::create(&path).expect("a file");
    file.set_len(20 << 30).expect("a sparse file");
    let read = |name: &OsStr| source::load(name, &Overrides::default()).expect_err("it is refused").to_string();
    for name in [path.as_os_str(), OsStr::new("/dev/zero")] {
        let (failure, peak) = peak_of(|| read(name));
        assert!(failure.contains("it is larger than 1 MiB") && peak < 4 * SIZE, "{failure}: {peak} bytes");
    }
}
