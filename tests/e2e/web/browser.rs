//! A headless Chromium, driven over WebDriver.

use super::http;
use crate::support::wait_for;
use rustix::process::{Pid, Signal, kill_process_group};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// With this in the environment a missing browser is a failure: `.ci/run` installs one.
const REQUIRED: &str = "SHOAL_NEEDS_BROWSER";

/// A browser with one window, which ends with the test.
pub(crate) struct Browser {
    driver: Child,
    port: u16,
    session: String,
    _profile: TempDir,
}

fn program(names: &[&str]) -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found =
        |name: &&str| std::env::split_paths(&path).map(|directory| directory.join(name)).find(|path| path.exists());
    names.iter().find_map(found)
}

impl Browser {
    /// Starts one, with a window of this size; `None` where there is none, which is said.
    pub(crate) fn start(width: u32, height: u32) -> Option<Browser> {
        let (chromium, driver) =
            (program(&["chromium", "chromium-browser", "google-chrome"]), program(&["chromedriver"]));
        let (Some(chromium), Some(driver)) = (chromium, driver) else {
            assert!(std::env::var_os(REQUIRED).is_none(), "chromium and chromedriver are needed here");
            eprintln!("skipped: there is no chromium with chromedriver (Debian: chromium, chromium-driver)");
            return None;
        };
        // A group of its own: the browser goes with its driver, whatever becomes of the test.
        let mut driver = Command::new(driver)
            .arg("--port=0")
            .process_group(0)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let port = (BufReader::new(driver.stdout.take().unwrap()).lines())
            .find_map(|line| {
                line.unwrap().split("started successfully on port ").nth(1)?.trim_end_matches('.').parse().ok()
            })
            .expect("chromedriver says its port");
        let profile = TempDir::with_prefix("shoal-browser-").unwrap();
        let args = [
            "--headless=new".to_owned(),
            "--no-sandbox".to_owned(),
            "--disable-gpu".to_owned(),
            "--disable-dev-shm-usage".to_owned(),
            "--disable-quic".to_owned(),
            "--no-first-run".to_owned(),
            "--disable-background-networking".to_owned(),
            "--disable-component-update".to_owned(),
            "--disable-sync".to_owned(),
            "--force-color-profile=srgb".to_owned(),
            format!("--window-size={width},{height}"),
            format!("--user-data-dir={}", profile.path().display()),
        ];
        let wanted = json!({ "capabilities": { "alwaysMatch": {
            "browserName": "chrome",
            "goog:chromeOptions": { "binary": chromium, "args": args },
            "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let mut browser = Browser { driver, port, session: String::new(), _profile: profile };
        let session = browser.call("POST", "", &wanted);
        browser.session = session["sessionId"].as_str().unwrap_or_else(|| panic!("{session:#}")).to_owned();
        Some(browser)
    }

    fn call(&self, method: &str, path: &str, body: &Value) -> Value {
        let at =
            if self.session.is_empty() { "/session".to_owned() } else { format!("/session/{}{path}", self.session) };
        let body = if method == "GET" { String::new() } else { body.to_string() };
        let host = format!("127.0.0.1:{}", self.port);
        let headers = [("Host", host.as_str()), ("Content-Type", "application/json")];
        let answer = http::ask(self.port, method, &at, &headers, &body);
        let value = answer.json()["value"].clone();
        assert_eq!(answer.status, 200, "{method} {path}: {value:#}");
        value
    }

    /// Goes to an address.
    pub(crate) fn open(&self, url: &str) {
        self.call("POST", "/url", &json!({ "url": url }));
    }

    /// What an expression of JavaScript comes to on the page.
    pub(crate) fn eval(&self, expression: &str) -> Value {
        self.call("POST", "/execute/sync", &json!({ "script": format!("return ({expression});"), "args": [] }))
    }

    /// Waits until an expression is true on the page.
    #[track_caller]
    pub(crate) fn wait_until(&self, expression: &str) {
        wait_for(expression, || (self.eval(&format!("Boolean({expression})")) == true).then_some(()));
    }

    /// Presses the mouse at one place of the window and lets it go at another one, in pixels.
    pub(crate) fn drag(&self, from: [f64; 2], to: [f64; 2], button: u32) {
        let move_to = |[x, y]: [f64; 2]| json!({ "type": "pointerMove", "duration": 30, "x": x.round() as i64, "y": y.round() as i64, "origin": "viewport" });
        let (down, up) =
            (json!({ "type": "pointerDown", "button": button }), json!({ "type": "pointerUp", "button": button }));
        let mut steps = vec![move_to(from), down];
        if from != to {
            steps.extend([move_to([0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])]), move_to(to)]);
        }
        steps.push(up);
        let pointer =
            json!({ "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" }, "actions": steps });
        self.call("POST", "/actions", &json!({ "actions": [pointer] }));
    }

    /// Clicks a place.
    pub(crate) fn click(&self, at: [f64; 2]) {
        self.drag(at, at, 0);
    }

    /// Clicks an element.
    pub(crate) fn press(&self, selector: &str) {
        let found = self.call("POST", "/element", &json!({ "using": "css selector", "value": selector }));
        let id = found.as_object().and_then(|found| found.values().next()?.as_str()).expect("an element");
        self.call("POST", &format!("/element/{id}/click"), &json!({}));
    }

    /// Presses keys, one after the other.
    pub(crate) fn keys(&self, keys: &str) {
        let steps: Vec<Value> = (keys.chars())
            .flat_map(|key| [json!({ "type": "keyDown", "value": key }), json!({ "type": "keyUp", "value": key })])
            .collect();
        self.call("POST", "/actions", &json!({ "actions": [{ "type": "key", "id": "keys", "actions": steps }] }));
    }

    /// Makes the window another size.
    pub(crate) fn resize(&self, width: u32, height: u32) {
        self.call("POST", "/window/rect", &json!({ "width": width, "height": height }));
    }

    /// Nothing went wrong on the page.
    #[track_caller]
    pub(crate) fn assert_no_errors(&self) {
        let log = self.call("POST", "/se/log", &json!({ "type": "browser" }));
        let severe = log.as_array().unwrap().iter().filter(|entry| entry["level"] == "SEVERE");
        assert_eq!(severe.collect::<Vec<_>>(), Vec::<&Value>::new());
    }

    /// Keeps a picture of the window among the artefacts of the build.
    pub(crate) fn picture(&self, name: &str) {
        let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("web");
        std::fs::create_dir_all(&directory).unwrap();
        let text = self.call("GET", "/screenshot", &Value::Null);
        std::fs::write(directory.join(name), decoded(text.as_str().unwrap())).unwrap();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let host = format!("127.0.0.1:{}", self.port);
        if !self.session.is_empty() {
            http::ask(self.port, "DELETE", &format!("/session/{}", self.session), &[("Host", &host)], "");
        }
        let group = Pid::from_raw(self.driver.id().cast_signed()).expect("it has a number");
        let _ = kill_process_group(group, Signal::KILL);
        let _ = self.driver.wait();
    }
}

/// Base64.
fn decoded(text: &str) -> Vec<u8> {
    const ALPHABET: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    for value in text.bytes().filter_map(|byte| ALPHABET.iter().position(|known| *known == byte)) {
        (bits, count) = (bits << 6 | value as u32, count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    bytes
}
