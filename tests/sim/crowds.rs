//! A hundred robots that push each other for a minute: no robot is lost, every contact is counted once, and none is deeper
//! than is said here. Bodies pass through each other where their planners let them: the world does not hold them back.

use scenarios::Overrides;
use shoal_tests::recording::at;
use shoal_tests::truth::{agree, recompute};
use shoal_tests::{Recording, build};

/// Ten by ten robots with 0.9 m between them, each with its goal opposite, in a square of half that size: for bodies of
/// 0.4 m that is hardly room.
fn crowd() -> String {
    let mut text = "[clock]\ntick_hz = 20\nduration_s = 60\nstop = \"duration\"\n[defaults]\nradius_m = 0.2\n\
                    sensor_range_m = 2\nradio_range_m = 3\n"
        .to_owned();
    for index in 0..100 {
        let [x, y] = [index % 10, index / 10].map(f64::from).map(|place| place - 4.5);
        text += &format!(
            "[[robot]]\nid = \"r{index:02}\"\nstart_m = [{:.3}, {:.3}]\ngoal_m = [{:.3}, {:.3}]\n",
            0.9 * x,
            0.9 * y,
            -0.45 * x,
            -0.45 * y
        );
    }
    text
}

#[test]
fn a_hundred_robots_that_push_each_other() {
    // How deep bodies may overlap, m: less than nothing is a distance that is kept.
    for (planner, deepest_m) in [("decentralized-apf", -0.1), ("apf", -0.1), ("amr-apf", 0.2), ("dapf", 0.2)] {
        let overrides = Overrides { planner: Some(planner.to_owned()), ..Overrides::default() };
        let scenario = build::with(&crowd(), &overrides);
        let recording = Recording::of(&scenario);
        let (report, truth) = (recording.report(), recompute(&scenario, &recording.frames));
        let told = &report.outcome;

        let least_m = told.min_clearance_m.expect("there are pairs");
        assert!(agree(least_m, truth.min_clearance_m.unwrap()), "{planner}: {least_m}, {:?}", truth.min_clearance_m);
        assert!(least_m >= -deepest_m, "{planner}: {least_m} m");
        assert_eq!(told.robot_contacts, truth.robot_contacts, "{planner}");
        assert_eq!(told.robot_contacts > 0, least_m < -1e-9, "{planner}: {} contacts", told.robot_contacts);
        let of_each: Vec<u64> = report.per_robot.iter().map(|robot| robot.contacts).collect();
        assert_eq!(of_each, truth.contacts, "{planner}");
        // Two robots make one contact.
        assert_eq!(of_each.iter().sum::<u64>(), 2 * told.robot_contacts, "{planner}");

        for frame in &recording.frames[1..] {
            let here = frame.robots().filter(|body| at(body).coords.amax() < 10.0).count();
            assert_eq!(here, 100, "{planner}, tick {}", frame.tick);
        }
        assert!(report.per_robot.iter().all(|robot| robot.gone.is_none()), "{planner}");
        // They do push: some robots get nowhere, and the report tells them from those that have arrived.
        let stuck = told.deadlocked + told.livelocked + told.oscillating;
        assert!(stuck > 20 && told.arrived + stuck <= 100, "{planner}: {told:#?}");
    }
}
