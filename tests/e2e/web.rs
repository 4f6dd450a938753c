//! The page: what a browser shows and does, and whom the server lets in.

mod browser;
mod http;

use crate::service::Service;
use crate::support::{Run, SHOAL, assert_clean, run, shoal, signal, wait_for};
use browser::Browser;
use rustix::process::Signal;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

/// `shoal view` in the background, which ends with the test.
struct View {
    process: Child,
    url: String,
    port: u16,
    token: String,
}

impl View {
    fn of(fleet: &str) -> View {
        View::with(&["--fleet", fleet])
    }

    fn with(args: &[&str]) -> View {
        let mut process =
            Command::new(SHOAL).arg("view").args(args).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut url = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut url).unwrap();
        let url = url.trim().to_owned();
        let (host, token) =
            url.strip_prefix("http://127.0.0.1:").and_then(|rest| rest.split_once("/?token=")).expect(&url);
        View { process, port: host.parse().unwrap(), token: token.to_owned(), url }
    }

    fn headers(&self) -> [(&'static str, String); 2] {
        [("Host", format!("127.0.0.1:{}", self.port)), ("X-Shoal-Token", self.token.clone())]
    }

    /// Asks for something that changes the fleet.
    fn act(&self, fleet: &str, what: &Value) -> Value {
        let [host, token] = self.headers();
        let headers = [(host.0, &*host.1), (token.0, &*token.1), ("Content-Type", "application/json")];
        http::ask(self.port, "POST", &format!("/fleets/{fleet}/act"), &headers, &what.to_string()).json()
    }
}

impl Drop for View {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn id_of(service: &Service) -> String {
    service.root.file_name().unwrap().to_str().unwrap().rsplit('-').next().unwrap().to_owned()
}

/// Three robots that go to and fro for ever on lanes of their own.
fn wanderers(mode: &'static str) -> Service {
    let mut text = String::from(
        "description = \"To and fro.\"\n[world]\nx_m = [-6, 6]\ny_m = [-4, 4]\n[clock]\ntick_hz = 50\nduration_s = 100000\n\
         [fleet]\nmax_robots = 8\ncommand_timeout_s = 30\n[defaults]\nplanner = \"straight\"\nrestart = \"on-failure\"\n\
         restart_limit = 50\nrestart_delay_s = 0.2\n\
         [[obstacle]]\nshape = \"polygon\"\ncorners_m = [[-1, -3.6], [1, -3.6], [1, -3], [-1, -3]]\n",
    );
    for (name, y) in [("a", -2), ("b", 0), ("c", 2)] {
        text += &format!(
            "[[robot]]\nid = \"{name}\"\nstart_m = [-4, {y}]\nwaypoints_m = [[4, {y}]]\ngoal_m = [-4, {y}]\nrounds = \"forever\"\n"
        );
    }
    Service::in_mode(mode, text, &[])
}

/// Where a robot is in the window, in pixels.
fn pixel_of(browser: &Browser, slot: u32) -> [f64; 2] {
    pixel_at(browser, &format!("shoal.main.body({slot}).slice(2, 4)"))
}

/// Where a place on the map is in the window, in pixels.
fn pixel_at(browser: &Browser, place: &str) -> [f64; 2] {
    let at = browser.eval(&format!(
        "(() => {{ const [x, y] = shoal.stages[0].place({place}); \
         const box = shoal.stages[0].canvas.getBoundingClientRect(); return [box.left + x, box.top + y]; }})()"
    ));
    [at[0].as_f64().unwrap(), at[1].as_f64().unwrap()]
}

/// Chooses a robot with the mouse; it may move while the mouse does.
fn choose(browser: &Browser, slot: u32) {
    wait_for("the robot is chosen", || {
        browser.click(pixel_of(browser, slot));
        (browser.eval("shoal.chosen") == slot).then_some(())
    });
}

#[test]
fn a_fleet_is_watched_and_driven_in_a_browser() {
    let Some(browser) = Browser::start(1280, 860) else { return };
    let service = wanderers("realtime");
    let view = View::of(&service.name);
    browser.open(&view.url);
    browser.wait_until("shoal.main?.frame && shoal.vitals && shoal.vitals.pulse.window_s > 0");
    assert_eq!(browser.eval("shoal.main.fleet.things.length"), 1);
    assert_eq!(browser.eval("document.querySelectorAll('#robots tbody tr').length"), 3);

    // Robots move, and what is drawn moves with them.
    let drawn = || browser.eval("[shoal.main.frame.tick, shoal.drawn, shoal.main.body(1)[2]]");
    let before = drawn();
    browser.wait_until(&format!("shoal.main.frame.tick > {} + 50 && shoal.drawn > {} + 15", before[0], before[1]));
    assert_ne!(before[2], drawn()[2]);
    browser.picture("fleet.png");

    // Click a robot, and a place: it gets a task there, and goes there.
    choose(&browser, 1);
    assert_eq!(browser.eval("document.querySelector('#card-name').textContent"), "b");
    browser.click(pixel_at(&browser, "[0.5, 1]"));
    browser.wait_until("shoal.events.some((event) => event.kind === 'task' && event.robot === 'b')");
    let tasks = service.json(&["task", "list"]);
    let goal = &tasks["tasks"][0]["goal_m"];
    assert!(
        (goal[0].as_f64().unwrap() - 0.5).abs() < 0.05 && (goal[1].as_f64().unwrap() - 1.0).abs() < 0.05,
        "{tasks:#}"
    );
    browser.wait_until("shoal.events.some((event) => event.kind === 'task-done' && event.robot === 'b')");

    // Kill it from its menu, and see it come back.
    wait_for("the menu", || {
        let at = pixel_of(&browser, 1);
        browser.drag(at, at, 2);
        (browser.eval("!document.querySelector('#menu').hidden && shoal.chosen === 1") == true).then_some(())
    });
    browser.picture("menu.png");
    browser.press("#menu [data-act=kill]");
    browser.wait_until("shoal.events.some((event) => event.kind === 'killed' && event.robot === 'b')");
    browser.wait_until(
        "shoal.vitals.status.robots[1].incarnation === 1 && shoal.vitals.status.robots[1].state === 'running'",
    );

    // Drag a new one onto the map.
    browser.keys("a");
    browser.drag(pixel_at(&browser, "[-3, -1]"), pixel_at(&browser, "[3, -1]"), 0);
    browser.wait_until("shoal.main.fleet.members.length === 4 && shoal.main.body(3)");
    assert_eq!(service.json(&["ps"])["fleets"][0]["robots"].as_array().unwrap().len(), 4);

    // A narrow window, and no wider than that.
    browser.resize(420, 820);
    browser.wait_until("innerWidth < 520 && document.documentElement.scrollWidth <= innerWidth");
    browser.picture("narrow.png");
    browser.assert_no_errors();

    // The fleet ends, and the page says so.
    service.ask(&["down"]).expect(0);
    browser
        .wait_until("document.body.dataset.ended && document.querySelector('#notice').textContent.includes('ended')");
    assert_clean(&service.root);
}

#[test]
fn only_who_started_the_view_sees_or_does_anything() {
    let service = wanderers("realtime");
    let (view, id) = (View::of(&service.name), id_of(&service));
    let host = format!("127.0.0.1:{}", view.port);
    let with_token = |path: &str| format!("{path}?token={}", view.token);
    let get = |path: &str, headers: &[(&str, &str)]| http::ask(view.port, "GET", path, headers, "");
    let own = [("Host", host.as_str())];

    let page = get(&with_token("/"), &own);
    assert_eq!(page.status, 200);
    for header in
        ["content-security-policy: default-src 'none'", "referrer-policy: no-referrer", "frame-ancestors 'none'"]
    {
        assert!(page.head.contains(header), "{}", page.head);
    }
    let sources = get(&with_token("/sources"), &own).json();
    assert_eq!(sources["fleets"][0]["id"], *id, "{sources:#}");
    for path in ["/", "/sources", &format!("/fleets/{id}/stream"), "/nothing"] {
        assert_eq!(get(path, &own).status, 403, "{path} without a token");
        assert_eq!(get(&format!("{path}?token=0123456789abcdef0123456789abcdef"), &own).status, 403, "{path}");
        let foreign = [("Host", host.as_str()), ("Origin", "http://evil.example")];
        assert_eq!(get(&with_token(path), &foreign).status, 403, "{path} from a page of another site");
        let rebound = [("Host", "evil.example")];
        assert_eq!(get(&with_token(path), &rebound).status, 403, "{path} for another name");
    }

    let tasks = || service.json(&["task", "list"])["tasks"].as_array().unwrap().len();
    let body = r#"{"do":"task","robot":"a","at_m":[0,-2],"now":false}"#;
    let path = format!("/fleets/{id}/act");
    let post =
        |path: &str, headers: &[(&str, &str)], body: &str| http::ask(view.port, "POST", path, headers, body).status;
    let json = ("Content-Type", "application/json");
    assert_eq!(post(&path, &[own[0], json], body), 403);
    assert_eq!(post(&with_token(&path), &[own[0], json, ("Origin", "http://evil.example")], body), 403);
    assert_eq!(post(&with_token(&path), &[own[0], ("Content-Type", "text/plain")], body), 415);
    assert_eq!(post(&with_token(&path), &[own[0], json], "{\"do\":\"explode\"}"), 400);
    assert_eq!(post(&with_token(&path), &[own[0], json], &"x".repeat(100_000)), 413);
    assert_eq!(post(&with_token("/fleets/zzzzzzz/act"), &[own[0], json], body), 404);
    assert_eq!(tasks(), 0);
    let refused = view.act(&id, &serde_json::json!({ "do": "kill", "robot": "nosuch" }));
    assert_eq!((&refused["done"], &refused["words"]), (&false.into(), &"unknown robot `nosuch`".into()), "{refused:#}");
    assert_eq!(view.act(&id, &serde_json::from_str(body).unwrap())["done"], true);
    assert_eq!(tasks(), 1);
}

/// Pages that do not read, that are stopped, and that go away do not hold up the fleet, or others, or cost memory.
#[test]
fn the_fleet_does_not_notice_pages_that_are_slow_or_dead() {
    let service = wanderers("realtime");
    let (view, id) = (View::of(&service.name), id_of(&service));
    let [host, token] = view.headers();
    let headers = [(host.0, &*host.1), (token.0, &*token.1)];
    let stream = || http::send(view.port, "GET", &format!("/fleets/{id}/stream"), &headers, "");
    let resident = || {
        let statm = std::fs::read_to_string(format!("/proc/{}/statm", view.process.id())).unwrap();
        statm.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * rustix::param::page_size() as u64
    };
    // Twenty that never read, and twenty that went.
    let stuck: Vec<_> = (0..20).map(|_| stream()).collect();
    (0..20).for_each(|_| drop(stream()));
    let mut reader = BufReader::new(stream());
    let mut frames = 0;
    let mut read = |until: u32| {
        let mut line = String::new();
        while frames < until {
            line.clear();
            assert!(reader.read_line(&mut line).unwrap() > 0, "the stream goes on");
            frames += u32::from(line.starts_with("event: frame"));
        }
    };
    read(50);
    let before = resident();
    read(300);
    let after = resident();
    assert!(after < before + 8_000_000, "{before} bytes, then {after}");
    // A view that is stopped, and one that is killed, with all that.
    let tick = || service.json(&["ps"])["fleets"][0]["tick"].as_u64().unwrap();
    for sent in [Signal::STOP, Signal::KILL] {
        signal(view.process.id(), sent);
        let since = tick();
        wait_for("the fleet goes on", || (tick() > since + 100).then_some(()));
    }
    drop(stuck);
    let other = View::of(&service.name);
    let [host, token] = other.headers();
    let sources = http::ask(other.port, "GET", "/sources", &[(host.0, &*host.1), (token.0, &*token.1)], "");
    assert_eq!(sources.status, 200);
}

#[test]
fn a_view_that_cannot_be_says_why() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    shoal(&["view", "--port", &port]).expect_failure(3, &["port", "in use"]);
    shoal(&["view", "--fleet", "nosuch"]).expect_failure(if bus_has_fleets() { 2 } else { 3 }, &[]);
    let mut command = Command::new(SHOAL);
    command.args(["view", "--port", "70000"]);
    run(command).expect(2);
}

/// Other tests may have fleets: then the one that is named does not exist, else there is none.
fn bus_has_fleets() -> bool {
    bus::clean::list_fleets().is_ok_and(|fleets| fleets.iter().any(|fleet| !fleet.abandoned))
}

#[test]
fn a_view_ends_when_it_is_asked_to() {
    let mut view = Command::new(SHOAL);
    shoal_tests::process::with_signals(&mut view, None);
    let mut view = view.arg("view").stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut out = BufReader::new(view.stdout.take().unwrap());
    let mut url = String::new();
    out.read_line(&mut url).unwrap();
    let port = url.strip_prefix("http://127.0.0.1:").and_then(|rest| rest.split('/').next()?.parse().ok()).expect(&url);
    let host = format!("127.0.0.1:{port}");
    assert_eq!(http::ask(port, "GET", "/page.css", &[("Host", &host)], "").status, 200);
    signal(view.id(), Signal::INT);
    assert_eq!(wait_for("its end", || view.try_wait().unwrap()).code(), Some(0));
    let mut rest = String::new();
    out.read_to_string(&mut rest).unwrap();
    assert_eq!(rest, "");
}

#[test]
fn a_fleet_in_lockstep_is_paused_and_stepped_on_the_page() {
    let Some(browser) = Browser::start(1100, 800) else { return };
    let service = wanderers("lockstep");
    service.json(&["resume", "--rate", "1"]);
    let view = View::of(&service.name);
    browser.open(&view.url);
    browser.wait_until("shoal.main?.frame?.tick > 5 && !document.querySelector('#pace').hidden");
    browser.press("#pause");
    browser.wait_until("shoal.vitals.status.paused && document.querySelector('#pause').textContent === 'Go on'");
    let tick = || service.json(&["ps"])["fleets"][0]["tick"].as_u64().unwrap();
    let paused_at = tick();
    browser.press("#step");
    wait_for("one tick", || (tick() == paused_at + 1).then_some(()));
    // A page that opens while the fleet is paused shows where everybody is.
    browser.open(&view.url);
    browser.wait_until("shoal.main?.robots().length === 3 && shoal.vitals?.status.paused");
    assert_eq!(tick(), paused_at + 1);
    browser.keys(" ");
    browser.wait_until(&format!("shoal.main.frame.tick > {paused_at} + 20"));
    browser.assert_no_errors();
}

/// Two records of one scenario: one is played and sought through, two are compared.
#[test]
fn records_are_played_and_compared() {
    let Some(browser) = Browser::start(1200, 800) else { return };
    let directory = tempfile::tempdir().unwrap();
    let record = |planner: &str| {
        let path = directory.path().join(format!("{planner}.mcap")).to_str().unwrap().to_owned();
        let args = ["run", "head-on", "--mode", "single", "--planner", planner, "--filter", "none", "--record", &path];
        assert!(shoal(&args).code.is_some_and(|code| code <= 1), "{planner}");
        path
    };
    let (straight, lanes) = (record("straight"), record("lanes"));

    let view = View::with(&[&straight]);
    browser.open(&view.url);
    browser.wait_until("shoal.main?.frame?.tick > 20 && !document.querySelector('#player').hidden");
    assert!(browser.eval("shoal.tapes[0].info.events.length").as_u64() > Some(2));
    browser.wait_until("shoal.main.flashes.length > 0 || shoal.play.time >= shoal.play.seconds");
    assert_eq!(
        browser.eval("shoal.tapes[0].info.events.some((event) => event.kind === 'contact' && event.at_m)"),
        true
    );
    browser.press("#play");
    browser.eval("seek(shoal.play.seconds / 2)");
    browser.wait_until("Math.abs(shoal.main.frame.time_s - shoal.play.time) < 0.05");
    browser.picture("record.png");
    browser.keys(".");
    browser.wait_until("shoal.main.frame.time_s > shoal.play.seconds / 2");
    browser.eval("seek(1e9)");
    browser.wait_until("shoal.main.frame.tick === shoal.tapes[0].info.last");
    browser.assert_no_errors();
    drop(view);

    let view = View::with(&[&straight, &lanes]);
    browser.open(&view.url);
    browser.wait_until("shoal.stages.length === 2 && shoal.layers.every((layer) => layer.frame?.tick > 10)");
    browser.eval(
        "(() => { const choice = document.querySelector('#compare'); choice.value = 'over'; choice.onchange(); })()",
    );
    browser.wait_until("shoal.stages.length === 1 && shoal.stages[0].layers.length === 2");
    browser.wait_until("shoal.play.time > 4 || !shoal.play.playing");
    assert_eq!(browser.eval("document.querySelectorAll('#robots tbody tr').length"), 2);
    browser.wait_until("document.querySelector('#robots tbody').textContent.includes('moves')");
    browser.picture("compared.png");
    browser.assert_no_errors();

    std::fs::write(directory.path().join("no.mcap"), "nothing").unwrap();
    let no = directory.path().join("no.mcap");
    shoal(&["view", no.to_str().unwrap()]).expect_failure(2, &["no.mcap", "record"]);
    shoal(&["view", "nosuch.mcap"]).expect_failure(2, &["nosuch.mcap"]);
}

/// `shoal run --view`: the address is said, the page shows the run, and hears of its end.
#[test]
fn a_run_is_watched_from_its_beginning_to_its_end() {
    let Some(browser) = Browser::start(1360, 860) else { return };
    let alone = Run::catalog("demo-15").mode("single").finish().expect(0);
    let mut fleet = Run::catalog("demo-15").mode("lockstep").arg("--view").start();
    let root = fleet.root();
    fleet.wait_said("view: http://127.0.0.1:");
    let said = fleet.stderr();
    let url = said.split("view: ").nth(1).and_then(|rest| rest.split_whitespace().next()).unwrap();
    browser.open(url);
    browser.wait_until("shoal.main?.frame && shoal.main.robots().length >= 15");
    assert_eq!(browser.eval("shoal.main.fleet.mode"), "lockstep");
    browser.eval("(() => { document.querySelector('#links').checked = true; choose(4); })()");
    // Everybody is in the middle, on the way round each other.
    browser.wait_until("shoal.main.frame.time_s > 7");
    browser.picture("view.png");
    browser.wait_until("document.body.dataset.ended");
    assert_eq!(browser.eval("shoal.main.frame.arrived"), 17);
    browser.assert_no_errors();
    let ended = fleet.wait().expect(0);
    assert_eq!(ended.report["trajectory_hash"], alone.report["trajectory_hash"], "to be watched changes nothing");
    assert_clean(&root);
}
