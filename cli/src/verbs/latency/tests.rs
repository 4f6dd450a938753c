use super::*;
use bus::{StatsWriter, Strips, clean};
use model::Cause;

/// Two robots and a world, as they would be seen; the second robot was added while the fleet ran.
fn seen(mode: Mode) -> Look {
    let address = Address::create().unwrap();
    for slot in 0..2_u32 {
        let metrics = [Metric::PoseAge, Metric::Wake, Metric::Plan, Metric::Step];
        let name = format!("agent-{slot}-0");
        let mut stats = StatsWriter::create(&address, &name, &metrics, Strips::of_agent(4)).unwrap();
        for period in 0..1000_u64 {
            stats.record(Metric::Wake, 50_000 + 100 * period);
            stats.record(Metric::Plan, 2_000 + period);
            stats.record(Metric::Step, 20_000);
            stats.record(Metric::PoseAge, 1_000_000 + 10_000 * period);
            stats.record_of(RobotIndex(1 - slot), Metric::PoseAge, 1_000_000 + 10_000 * period, period);
        }
        stats.add(Counter::Periods, 1000);
        stats.add(Counter::DeadlineMisses, 3 * u64::from(slot));
        stats.add_late(Cause::Scheduler, 4 * u64::from(slot));
        stats.add_late(Cause::Neither, 1);
        stats.add(Counter::WaitedNs, 5);
        stats.add(Counter::WatchedNs, 1000);
        stats.add(Counter::UsesDropped, 7);
    }
    let mut world = StatsWriter::create(
        &address,
        bus::stats::WORLD,
        &[Metric::CommandAge, Metric::Reaction, Metric::Wake],
        Strips::of_world(4),
    )
    .unwrap();
    for slot in [0, 1] {
        for (metric, ns) in [(Metric::CommandAge, 9_000_000), (Metric::Reaction, 20_000_000)] {
            world.record(metric, ns);
            world.record_of(RobotIndex(slot), metric, ns, 1);
        }
    }
    world.record(Metric::Wake, 70_000);
    world.add(Counter::Periods, 1000);
    let stats = bus::stats::read_all(&address);
    clean::sweep(&address);
    let (stats, names) =
        (stats.unwrap(), BTreeMap::from([(RobotIndex(0), "r00".to_owned()), (RobotIndex(1), "scout".to_owned())]));
    let (robots, world) = bus::stats::by_robot(&stats);
    let facts = measured::latency(&stats, &|slot| names.get(&slot).cloned(), mode == Mode::Realtime);
    let (fleet, scenario) = ("abcd234".to_owned(), "demo-15".to_owned());
    Look { what: "fleet", fleet, scenario, mode, tick_hz: 50.0, tick: 1000, robots, world, names, facts }
}

fn text(look: &Look, width: usize, named: bool, pairs: bool) -> String {
    let mut page = Page::new(width);
    look.text(&mut page, named, Metric::PoseAge);
    if pairs {
        look.pairs_text(&mut page);
    }
    let text = page.into_text();
    assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
    text
}

#[test]
fn tables_for_people() {
    insta::assert_snapshot!("fleet_80", text(&seen(Mode::Realtime), 80, false, true));
    insta::assert_snapshot!("fleet_40", text(&seen(Mode::Realtime), 40, false, true));
    let one = |mode| seen(mode).only(&["scout".to_owned()]).unwrap();
    insta::assert_snapshot!("robot_80", text(&one(Mode::Realtime), 80, true, true));
    insta::assert_snapshot!("robot_lockstep_40", text(&one(Mode::Lockstep), 40, true, false));
}

#[test]
fn numbers_for_programs() {
    let look = seen(Mode::Realtime);
    let json = look.json();
    for field in
        "schema fleet scenario mode tick_hz tick verdict starved_because pair_uses_dropped pose_age_us wake_us \
                  plan_us step_us command_age_us reaction_us periods deadline_misses blame world per_robot"
            .split_whitespace()
    {
        assert!(!json[field].is_null(), "`{field}` is missing in {json:#}");
    }
    assert_eq!((&json["schema"], &json["pair_uses_dropped"]), (&json!("shoal.latency/1"), &json!(14)));
    assert_eq!(json["per_robot"][1]["blame"], json!(look.facts.per_robot[1].blame));
    assert_eq!(json["verdict"], "valid", "3 of 3000 is the bound itself");
    let pairs = look.pairs();
    let names: Vec<(&str, &str, u64)> =
        pairs.iter().map(|pair| (pair.robot.as_str(), pair.heard.as_str(), pair.pose_age_us.n)).collect();
    assert_eq!(names, [("r00", "scout", 1000), ("scout", "r00", 1000)]);
    let lockstep = seen(Mode::Lockstep).json();
    assert_eq!((&lockstep["blame"], &lockstep["deadline_misses"]), (&Value::Null, &Value::Null));
}

#[test]
fn unknown_robots_are_refused_with_those_that_there_are() {
    let Err(failure) = seen(Mode::Realtime).only(&["r00".to_owned(), "r01".to_owned()]) else {
        panic!("there is none")
    };
    assert_eq!(failure.code, crate::exit::USAGE);
    let text = failure.to_string();
    assert!(text.contains("fleet `abcd234`: unknown robot `r01`") && text.contains("r00, scout"), "{text}");
}
