//! Peer to peer: what robots know of each other they read from each other's boards, and nobody checks it.

use crate::support::{Ended, Run, example};

/// `mover` drives along y = 0; `liar` stands three metres aside, at its goal, out of everybody's way. There is a wall
/// south of the lane to measure against.
fn scenario(agent: &str) -> String {
    format!(
        "[clock]\nmode = \"lockstep\"\nduration_s = 60\n[defaults]\nplanner = \"decentralized-apf\"\n\
         [[obstacle]]\nshape = \"segment\"\nfrom_m = [-3, -3]\nto_m = [3, -3]\n\
         [[robot]]\nid = \"mover\"\nstart_m = [-4, 0]\ngoal_m = [4, 0]\n\
         [[robot]]\nid = \"liar\"\nstart_m = [0, 3]\ngoal_m = [0, 3]\n{agent}"
    )
}

fn told(lie_m: &str) -> Ended {
    let agent = format!("agent = {:?}\n", example("lying_agent"));
    let ended = Run::scenario(&scenario(&agent)).env("SHOAL_LIE_M", lie_m).finish().expect(0);
    // Whatever it says, ground truth is that it stands where it stands, and that nobody came near.
    assert_eq!(ended.robot("liar")["path_length_m"], 0.0, "{ended}");
    assert_eq!(ended.report["outcome"]["robot_contacts"], 0, "{ended}");
    assert!(clearance(&ended, "min_clearance_m") > 1.0, "{ended}");
    ended
}

fn clearance(ended: &Ended, field: &str) -> f64 {
    ended.report["outcome"][field].as_f64().unwrap_or_else(|| panic!("{field}\n{ended}"))
}

#[test]
fn a_robot_that_lies_about_its_place_is_believed() {
    let honest = told("0");
    // It says that it stands in the lane, a little north or south of the middle.
    let (north, south) = (told("-2.7"), told("-3.3"));

    let path = |ended: &Ended| ended.robot("mover")["path_length_m"].as_f64().unwrap();
    assert!(path(&honest) < 8.0, "{honest}");
    for (lie, other) in [(&north, &south), (&south, &north)] {
        assert!(path(lie) > path(&honest) + 0.1, "{lie}");
        assert_ne!(lie.hash(), honest.hash());
        assert_ne!(lie.hash(), other.hash());
    }
    // The mover swerved away from where it was told that the other one is: towards the wall, or away from it.
    let wall = |ended: &Ended| clearance(ended, "min_obstacle_clearance_m");
    assert!((wall(&honest) - 2.8).abs() < 1e-6, "{honest}");
    assert!(wall(&north) < wall(&honest) - 0.2, "{north}");
    assert!(wall(&south) > wall(&honest) - 1e-6, "{south}");
    // And away from where it is in truth, or nearer to it.
    let truth = |ended: &Ended| clearance(ended, "min_clearance_m");
    assert!(truth(&north) > truth(&honest) && truth(&honest) > truth(&south) + 0.2, "{north}{south}");
    assert_eq!(told("-2.7").hash(), north.hash(), "the same lie, the same run");
}

#[test]
fn an_agent_of_ones_own_that_does_the_same_comes_to_the_same() {
    let own = told("0");
    for mode in ["lockstep", "single"] {
        let ours = Run::scenario(&scenario("")).mode(mode).finish().expect(0);
        assert_eq!(ours.hash(), own.hash(), "{mode}");
    }
}
