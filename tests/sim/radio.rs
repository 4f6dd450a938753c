//! Faults of the radio: they change what happens, from the tick at which they begin, and always in the same way.

use model::EventName;
use scenarios::Overrides;
use shoal_tests::{Recording, build, catalog, scenario, seeds};

fn ring(seed: u64, set: &[&str]) -> Recording {
    let set = set.iter().map(|key| key.to_string()).collect();
    Recording::of(&catalog("ring-15", &Overrides { set, duration_s: Some(15.0), ..build::seed(seed) }))
}

/// Robots that know each other by radio alone: who is seen is where it is seen, however late its pose comes.
#[test]
fn every_fault_changes_the_run_and_always_in_the_same_way() {
    seeds(1..=3, |seed| {
        let perfect = ring(seed, &[]);
        let faults: [&[&str]; 5] = [
            &["radio.delay_ticks=4"],
            &["radio.delay_ticks=20"],
            &["radio.drop=0.3"],
            &["radio.noise_m=0.02"],
            &["radio.delay_ticks=4", "radio.drop=0.3", "radio.noise_m=0.02"],
        ];
        let mut hashes = vec![perfect.hash()];
        for fault in faults {
            let fault = [fault, &["defaults.sees_robots=false"]].concat();
            let faulty = ring(seed, &fault);
            assert_eq!(faulty.first_difference(&ring(seed, &fault)), None, "{fault:?}");
            assert!(!hashes.contains(&faulty.hash()), "{fault:?} makes no difference of its own");
            hashes.push(faulty.hash());
        }
    });
}

/// Whoever hears nothing drives as if there were nobody to hear.
#[test]
fn without_any_message_and_without_eyes_everybody_is_alone() {
    seeds(1..=3, |seed| {
        let blind = "defaults.sees_robots=false";
        let deaf = ring(seed, &["radio.drop=1", blind]);
        let far = ring(seed, &["defaults.radio_range_m=0.001", "defaults.radio_hysteresis_m=0", blind]);
        assert_eq!(deaf.first_difference(&far), None);
        assert!(deaf.outcome.robot_contacts > 0, "the ring meets in its middle");
    });
}

/// A robot that hears nothing sees the others, whether nothing comes in range or everything is lost on the way.
#[test]
fn without_any_message_everybody_is_seen() {
    seeds(1..=3, |seed| {
        let deaf = ring(seed, &["radio.drop=1"]);
        let far = ring(seed, &["defaults.radio_range_m=0.001", "defaults.radio_hysteresis_m=0"]);
        assert_eq!(deaf.first_difference(&far), None);
        assert_eq!(deaf.outcome.robot_contacts, 0);
    });
}

/// Two broad bodies that the radio tells of each other too late, not at all, or no more: they are seen in time.
#[test]
fn bodies_that_the_radio_does_not_tell_of_do_not_meet() {
    let meet = |keys: &str, rest: &str| {
        Recording::of(&scenario(&format!(
            r#"
            [clock]
            duration_s = 40
            [defaults]
            radius_m = 1.2
            sensor_range_m = 10
            {keys}
            [[robot]]
            id = "a"
            start_m = [-10, 0]
            goal_m = [10, 0]
            [[robot]]
            id = "b"
            start_m = [10, 0.1]
            goal_m = [-10, 0.1]
            {rest}
            "#
        )))
    };
    let short = "radio_range_m = 2\nradio_hysteresis_m = 0";
    let lost_later = "[[event]]\nat_s = 3\nkind = \"radio\"\ndrop = 1";
    let late_later = "[[event]]\nat_s = 3\nkind = \"radio\"\nrobot = \"a\"\ndelay_ticks = 200";
    for (keys, rest) in [(short, ""), ("", "[radio]\ndrop = 1"), ("", lost_later), ("", late_later)] {
        let seen = meet(keys, rest);
        assert_eq!(seen.outcome.robot_contacts, 0, "{keys} {rest}");
        assert!(seen.outcome.robots.iter().all(|robot| robot.arrived_tick.is_some()), "{keys} {rest}");
        let unseen = meet(&format!("{keys}\nsees_robots = false"), rest);
        assert_ne!(seen.hash(), unseen.hash(), "{keys} {rest}");
    }
    assert!(meet(&format!("{short}\nsees_robots = false"), "").outcome.robot_contacts > 0);
}

/// While the radio is perfect and reaches beyond the sensors, nothing that is seen says more.
#[test]
fn who_is_heard_needs_not_be_seen() {
    seeds(1..=2, |seed| {
        assert_eq!(ring(seed, &[]).first_difference(&ring(seed, &["defaults.sees_robots=false"])), None);
    });
}

fn head_on(events: &str) -> Recording {
    Recording::of(&scenario(&format!(
        r#"
        [clock]
        duration_s = 12
        [defaults]
        planner = "decentralized-apf"
        radio_range_m = 20
        [planners.decentralized-apf]
        p_r = 20
        [[robot]]
        id = "east"
        start_m = [-4, 0]
        goal_m = [4, 0]
        [[robot]]
        id = "west"
        start_m = [4, 0.05]
        goal_m = [-4, 0.05]
        {events}
        "#
    )))
}

/// The two feel each other all the time, so a fault shows in the first tick in which it acts: the commands of tick k
/// have moved the bodies at tick k + 1.
#[test]
fn a_fault_begins_at_its_tick() {
    let quiet = head_on("");
    for (fault, shows_after) in [("delay_ticks = 6", 1), ("noise_m = 0.1", 1), ("drop = 1", 1)] {
        let faulty = head_on(&format!("[[event]]\nat_s = 2\nkind = \"radio\"\n{fault}"));
        assert_eq!(quiet.first_difference(&faulty), Some(100 + shows_after), "{fault}");
        let noted: Vec<_> =
            faulty.outcome.events.iter().filter(|event| event.kind.name() == EventName::Radio).collect();
        assert_eq!(noted.len(), 1);
        assert_eq!((noted[0].tick, noted[0].robot), (100, None), "{fault}");
    }
}

/// A fault of one receiver is a fault of that receiver: the other one is right as long as it sees nothing of it.
#[test]
fn a_fault_of_one_receiver_is_not_one_of_the_other() {
    let quiet = head_on("");
    let faulty = head_on("[[event]]\nat_s = 2\nkind = \"radio\"\nrobot = \"east\"\nnoise_m = 0.1");
    let place = |recording: &Recording, tick, id| recording.position(tick, recording.slot(id));
    assert_ne!(place(&quiet, 101, "east"), place(&faulty, 101, "east"));
    assert_eq!(place(&quiet, 101, "west"), place(&faulty, 101, "west"));
    // What `east` does in tick 100 shows in its pose of tick 101, which `west` hears in tick 102.
    assert_eq!(place(&quiet, 102, "west"), place(&faulty, 102, "west"));
    assert_ne!(place(&quiet, 103, "west"), place(&faulty, 103, "west"));
}

/// A fault that ends is over.
#[test]
fn a_fault_that_comes_and_goes_before_anybody_is_near_is_none() {
    let text = |events: &str| {
        format!(
            r#"
            [clock]
            duration_s = 12
            [defaults]
            radio_range_m = 3
            sensor_range_m = 3
            [[robot]]
            id = "a"
            start_m = [-6, 0]
            goal_m = [6, 0]
            [[robot]]
            id = "b"
            start_m = [6, 0.05]
            goal_m = [-6, 0.05]
            {events}
            "#
        )
    };
    let event = |at_s: f64, fault: &str| format!("[[event]]\nat_s = {at_s}\nkind = \"radio\"\n{fault}\n");
    let quiet = Recording::of(&scenario(&text("")));
    let over = event(1.0, "noise_m = 0.3\ndrop = 0.5\ndelay_ticks = 9") + &event(3.0, "");
    let passed = Recording::of(&scenario(&text(&over)));
    assert_eq!(quiet.first_difference(&passed), None);
}
