//! `realtime`: the report against the same numbers recomputed from the frames that the live fleet shows to whoever
//! watches.

use crate::report::check_form;
use crate::support::{SHOAL, report_of};
use bus::{FrameSubscriber, Node, clean};
use protocol::world_to_observer::FrameHeader;
use shoal_tests::process::{Place, Run, Running, parent_of, wait_for};
use shoal_tests::recording::Frame;
use shoal_tests::truth::{agree, recompute};

/// Both kinds of bodies, two robots that touch, things that move; over in a few seconds.
const SCENARIO: &str = r#"
    [world]
    x_m = [-6, 6]
    y_m = [-6, 6]
    [clock]
    mode = "realtime"
    duration_s = 20
    [defaults]
    sensor_range_m = 2
    radio_range_m = 3
    [[robot]]
    id = "a"
    start_m = [-2, 0]
    goal_m = [2, 0]
    [[robot]]
    id = "b"
    start_m = [2, 0.3]
    goal_m = [-2, 0.3]
    [[robot]]
    id = "turns"
    kind = "unicycle"
    start_m = [-2, 3]
    start_yaw_rad = 1.5
    goal_m = [0.5, 3]
    [[robot]]
    id = "blind-1"
    planner = "straight"
    start_m = [-2, -3]
    goal_m = [1, -3]
    [[robot]]
    id = "blind-2"
    planner = "straight"
    start_m = [1, -2.9]
    goal_m = [-2, -2.9]
    [[obstacle]]
    shape = "polygon"
    corners_m = [[0, -1.6], [0.5, -1.6], [0.3, -1.2]]
    [[obstacle]]
    shape = "disc"
    center_m = [-0.8, -4]
    radius_m = 0.2
    motion = { kind = "bounce", velocity_mps = [0.1, 0.4], x_m = [-3, 3], y_m = [-4.5, -1.8] }
    [expect]
    contacts_max = 10
"#;

/// The live fleet of a daemon that this test started: the one with a process whose parent it is.
fn fleet_of(daemon: &mut Running) -> bus::Address {
    wait_for("the fleet", || {
        assert!(daemon.runs(), "it ended before anybody could watch");
        let fleets = clean::list_fleets().expect("fleets can be listed");
        let ours = |pid: &u32| parent_of(*pid) == Some(daemon.pid());
        fleets.into_iter().find(|fleet| fleet.processes.iter().any(ours)).map(|fleet| fleet.address)
    })
}

#[test]
fn the_report_of_realtime_is_what_an_observer_saw() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("live.toml");
    #[expect(clippy::disallowed_methods, reason = "a scenario of its own")]
    std::fs::write(&path, SCENARIO).expect("it can be written");
    let scenario = shoal_tests::scenario(SCENARIO);

    let _place = Place::take();
    let mut daemon = Run::new(SHOAL).args(["run", "--format", "json"]).args([&path]).start();
    let address = fleet_of(&mut daemon);
    let mut headers: Vec<FrameHeader> = Vec::new();
    let mut frames: Vec<Frame> = Vec::new();
    {
        let node = Node::new(&address, "test").expect("an observer may join");
        // The services are made before the first process is started, but by another process: a moment may be missing.
        let mut subscriber = wait_for("the frames", || FrameSubscriber::open(&node, 0).ok());
        wait_for("the end", || {
            let runs = daemon.runs();
            while let Ok(Some((header, bodies))) = subscriber.take() {
                headers.push(header);
                frames.push(Frame { tick: header.tick, bodies });
            }
            (!runs).then_some(())
        });
    }
    let report = report_of(&daemon.end());
    check_form(&report, "realtime");
    assert_eq!(report["exit_code"], 0, "{:#}", report["unmet"]);
    let hz = report["tick_hz"].as_f64().expect("a number");
    assert!(report["latency"]["periods"].as_u64() >= report["ticks"].as_u64());

    assert!(!frames.is_empty(), "an observer sees something");
    for (header, frame) in headers.iter().zip(&frames) {
        assert!((header.time_s - header.tick as f64 / hz).abs() < 1e-9 && header.stamp_ns > 0);
        assert!(frame.bodies.len() <= scenario.robots.len() + 1);
    }
    assert!(headers.windows(2).all(|two| two[0].tick < two[1].tick && two[0].stamp_ns <= two[1].stamp_ns));
    let ticks = report["ticks"].as_u64().expect("a number");
    let lost = (ticks + 1).saturating_sub(frames.len() as u64);
    if lost > 0 {
        // An observer is never waited for. What it missed cannot be compared; everything above can.
        let (first, last) = (headers[0].tick, headers[headers.len() - 1].tick);
        #[expect(clippy::print_stderr, reason = "a comparison that is skipped is said to be")]
        {
            eprintln!("{lost} of {} frames were lost (saw {first} to {last}): nothing is compared", ticks + 1);
        }
        return;
    }

    let truth = recompute(&scenario, &frames);
    let outcome = &report["outcome"];
    for (name, truth) in [
        ("makespan_s", truth.makespan_s),
        ("flowtime_s", Some(truth.flowtime_s)),
        ("path_length_m", Some(truth.path_length_m)),
        ("min_clearance_m", truth.min_clearance_m),
        ("min_obstacle_clearance_m", truth.min_obstacle_clearance_m),
    ] {
        let told = outcome[name].as_f64();
        // A report holds the digits that are known.
        let truth = truth.map(report::numbers::rounded);
        assert!(told.zip(truth).is_some_and(|(told, truth)| agree(told, truth)), "{name}: {told:?}, seen {truth:?}");
    }
    for (name, truth) in [
        ("arrived", truth.arrived as u64),
        ("succeeded", truth.succeeded as u64),
        ("robot_contacts", truth.robot_contacts),
        ("obstacle_contacts", truth.obstacle_contacts),
    ] {
        assert_eq!(outcome[name].as_u64(), Some(truth), "{name}");
    }
    assert!(truth.robot_contacts > 0, "the two that look at nobody meet");
    let last = headers[headers.len() - 1];
    assert_eq!(u64::from(last.contacts), truth.robot_contacts + truth.obstacle_contacts);
    assert_eq!(last.arrived as usize, truth.arrived);
}
