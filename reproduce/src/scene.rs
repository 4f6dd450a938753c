//! The papers' scenes: scenarios in shoal's own format, compiled in, with what their tables `[paper]` expect. Those that
//! are of use to a user are in the catalog; the others are in `scenes/`.

use geometry::Capsule;
use model::{Mover, Obstacle as Thing, Robot, Scenario, Shape};
use nalgebra::Point2;
use planners::Obstacle;
use scenarios::{Expectation, Overrides, Paper, find_catalog};
use std::sync::LazyLock;

macro_rules! files {
    ($($name:literal)+) => { &[$(($name, Text::File(include_str!(concat!("../scenes/", $name, ".toml"))))),+] };
}

enum Text {
    File(&'static str),
    /// The name of a scenario of the catalog.
    Catalog(&'static str),
}

/// Scenes of no use to a user.
const FILES: &[(&str, Text)] = files! {
    "apf_antipodal8" "apf_close_goals_05" "apf_close_goals_15" "apf_cross4" "apf_dynamic" "apf_headon"
    "apf_headon_offset" "apf_two_disc_trap"
    "liquid_clogged" "liquid_corridor" "liquid_enclosed" "liquid_free" "liquid_large" "liquid_ring_front" "liquid_two_obstacles"
    "liquid_u_shallow"
    "pso_arm_2"
    "rpoa_khan2014" "rpoa_orbiter_fast" "rpoa_squeeze" "walkers6"
    "amr_demo_single" "amr_demo_head_on" "amr_demo_crossing" "amr_demo_gate"
    "amr_extra_01" "amr_extra_02" "amr_extra_03" "amr_extra_04" "amr_extra_05" "amr_extra_06"
    "amr_extra_07" "amr_extra_08" "amr_extra_09" "amr_extra_10" "amr_extra_11" "amr_extra_12"
};

/// Scenes of the catalog: the name that the rows use, and that of the catalog.
const OF_CATALOG: &[(&str, Text)] = &[
    ("liquid_corridor_tight", Text::Catalog("liquid-corridor-tight")),
    ("liquid_gap", Text::Catalog("liquid-gap")),
    ("liquid_near_goal", Text::Catalog("liquid-near-goal")),
    ("liquid_ring_side", Text::Catalog("liquid-ring-side")),
    ("liquid_u_resonance", Text::Catalog("liquid-u-resonance")),
    ("liquid_u_trap", Text::Catalog("liquid-u-trap")),
    ("pso_arm_1", Text::Catalog("arm-1")),
    ("pso_arm_elbow_flip", Text::Catalog("arm-elbow-flip")),
    ("pso_mass_point_1", Text::Catalog("pso-mass-point-1")),
    ("pso_mass_point_2", Text::Catalog("pso-mass-point-2")),
    ("rpoa_moving6", Text::Catalog("rpoa-moving6")),
    ("rpoa_moving_target", Text::Catalog("rpoa-moving-target")),
    ("rpoa_orbiter", Text::Catalog("rpoa-orbiter")),
    ("rpoa_static", Text::Catalog("rpoa-static")),
    ("rpoa_static_moved4", Text::Catalog("rpoa-moved4")),
    ("rpoa_u_trap", Text::Catalog("rpoa-u-trap")),
];

static SCENES: LazyLock<Vec<Scene>> = LazyLock::new(|| {
    let read = |(name, text): &(&'static str, Text)| match text {
        Text::File(text) => Scene::read(name, text, &Overrides::default()),
        Text::Catalog(of_catalog) => Scene::of_catalog(name, of_catalog, &Overrides::default()),
    };
    let mut scenes: Vec<Scene> = FILES.iter().chain(OF_CATALOG).map(read).collect();
    scenes.sort_by(|a, b| a.name.cmp(&b.name));
    scenes
});

/// Every scene with a name of its own, by name.
pub fn scenes() -> &'static [Scene] {
    &SCENES
}

/// The scenes whose names begin so: those of one paper, by name.
pub fn scenes_of(prefix: &str) -> impl Iterator<Item = &'static Scene> {
    scenes().iter().filter(move |scene| scene.name.starts_with(prefix))
}

/// The scene of that name. Panics if there is none: the names stand in the code of the papers.
pub fn scene(name: &str) -> &'static Scene {
    scenes().iter().find(|scene| scene.name == name).unwrap_or_else(|| panic!("no scene is called `{name}`"))
}

/// A scenario as a paper has it: robots are points, and discs larger, if the paper says so.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its name in rows and figures.
    pub name: String,
    /// Robots and discs.
    pub scenario: Scenario,
    /// What the paper says about it.
    pub paper: Paper,
}

impl Scene {
    /// A scenario of the catalog. Panics if there is none of that name, or if it does not fit the overrides.
    pub fn of_catalog(name: &str, of_catalog: &str, overrides: &Overrides) -> Scene {
        let entry = find_catalog(of_catalog).unwrap_or_else(|unknown| panic!("{unknown}"));
        Scene::read(name, entry.text, overrides)
    }

    fn read(name: &str, text: &str, overrides: &Overrides) -> Scene {
        let read = scenarios::parse_with_paper(name, text, overrides);
        let (mut scenario, paper) = read.unwrap_or_else(|problems| panic!("{problems}"));
        if let Some(inflation_m) = paper.inflation_m {
            scenario.robots.iter_mut().for_each(|robot| robot.radius_m = 0.0);
            for obstacle in &mut scenario.obstacles {
                let disc = disc(obstacle);
                *obstacle = Thing {
                    shape: Shape::Capsule(Capsule::disc(disc.a, micro(disc.radius + inflation_m))),
                    ..obstacle.clone()
                };
            }
        }
        let goals = scenario.robots.iter_mut().map(|robot| &mut robot.goal_motion);
        let motions = scenario.obstacles.iter_mut().map(|obstacle| &mut obstacle.motion).chain(goals);
        for motion in motions.flatten() {
            // Where a file leaves them out they follow from coordinates of six digits.
            if let model::Motion::Orbit { radius_m, phase_rad, .. } = motion {
                (*radius_m, *phase_rad) = (micro(*radius_m), micro(*phase_rad));
            }
        }
        Scene { name: name.to_owned(), scenario, paper }
    }

    /// Its first robot.
    pub fn robot(&self) -> &Robot {
        &self.scenario.robots[0]
    }

    /// Its first robot, to be changed.
    pub fn robot_mut(&mut self) -> &mut Robot {
        &mut self.scenario.robots[0]
    }

    /// Its expectations.
    pub fn expectations(&self) -> &[Expectation] {
        &self.paper.expectations
    }

    /// The obstacles where they start, as planners see them when nothing moves.
    pub fn discs(&self) -> Vec<Obstacle> {
        discs(&self.scenario)
    }

    /// The obstacles where they start, for figures: x, y, radius, m.
    pub fn drawn(&self) -> Vec<[f64; 3]> {
        self.scenario.obstacles.iter().map(disc).map(|disc| [disc.a.x, disc.a.y, disc.radius]).collect()
    }
}

/// A key of a result without its unit, as the rows name it.
pub fn plain(key: &str) -> &str {
    key.strip_suffix("_m").or(key.strip_suffix("_s")).unwrap_or(key)
}

/// Without what rounding does behind the sixth digit.
fn micro(x: f64) -> f64 {
    (x * 1e6).round() / 1e6
}

/// The obstacles of a scenario where they start, as planners see them when nothing moves.
pub fn discs(scenario: &Scenario) -> Vec<Obstacle> {
    let discs = scenario.obstacles.iter().map(disc).zip(0..);
    discs.map(|(disc, id)| disc_at(id, disc.a, disc.radius)).collect()
}

/// The disc that an obstacle is. Panics if it is something else: the papers have nothing else.
pub fn disc(obstacle: &Thing) -> Capsule {
    match &obstacle.shape {
        Shape::Capsule(capsule) if capsule.a == capsule.b => *capsule,
        other => panic!("not a disc: {other:?}"),
    }
}

/// A disc that stands still.
pub fn disc_at(id: u32, center: Point2<f64>, radius: f64) -> Obstacle {
    Obstacle { id, shape: Capsule::disc(center, radius), velocity: nalgebra::Vector2::zeros() }
}

/// How the obstacle of this index moves, if it does. Random walks are those of `shoal run` with this seed.
pub fn mover(obstacle: &Thing, seed: u64, index: u32) -> Option<Mover> {
    let walk = || model::random::Stream::new(seed, index, 0, "obstacle-walk");
    obstacle.motion.as_ref().map(|motion| Mover::new(motion, obstacle.shape.reference(), walk))
}

/// How a robot's goal moves, if it does.
pub fn goal_mover(robot: &Robot) -> Option<Mover> {
    // No goal of the papers walks at random.
    let walk = || model::random::Stream::new(0, 0, 0, "scene");
    robot.goal_motion.as_ref().map(|motion| Mover::new(motion, goal(robot), walk))
}

/// Where a robot is to go; where its goal is at first if that moves.
pub fn goal(robot: &Robot) -> Point2<f64> {
    *robot.goals.last().expect("a robot has a goal")
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::distance;

    #[test]
    fn every_scene_is_read() {
        let compared: Vec<&Scene> = scenes().iter().filter(|scene| !scene.expectations().is_empty()).collect();
        assert_eq!(compared.len(), 34);
        let expectations = || compared.iter().flat_map(|scene| scene.expectations());
        assert_eq!(expectations().count(), 143);
        assert_eq!(expectations().flat_map(Expectation::results).count(), RESULTS);
        assert_eq!(scenes_of("rpoa_").count(), 9);
        let mut names: Vec<&str> = scenes().iter().map(|scene| scene.name.as_str()).collect();
        names.dedup();
        assert_eq!(names.len(), 53, "{names:?}");
    }

    /// Results that the tables give: a result that is not read has no row.
    const RESULTS: usize = 568;

    #[test]
    fn points_stand_among_discs_that_are_larger() {
        let entry = find_catalog("pso-mass-point-2").unwrap();
        let built = scenarios::parse(entry.name, entry.text, &Overrides::default()).unwrap();
        let scene = scene("pso_mass_point_2");
        assert_eq!((built.robots[0].radius_m, scene.robot().radius_m), (0.05, 0.0));
        let radii = |scenario: &Scenario| scenario.obstacles.iter().map(|it| disc(it).radius).collect::<Vec<_>>();
        assert_eq!(radii(&built), [0.55, 0.55, 0.35, 0.55, 0.45, 0.35, 0.45, 0.35]);
        assert_eq!(radii(&scene.scenario), [0.6, 0.6, 0.4, 0.6, 0.5, 0.4, 0.5, 0.4]);
        assert!(radii(&super::scene("rpoa_khan2014").scenario).iter().all(|radius| *radius == 0.0));
    }

    #[test]
    fn what_moves_starts_where_it_is_said_to_be() {
        for scene in scenes() {
            for obstacle in &scene.scenario.obstacles {
                let Some(mut mover) = mover(obstacle, 1, 0) else { continue };
                assert!(distance(&mover.at(0.0).0, &disc(obstacle).a) < 1e-6, "{}: {obstacle:?}", scene.name);
            }
            for robot in &scene.scenario.robots {
                let Some(mut mover) = goal_mover(robot) else { continue };
                assert!(distance(&mover.at(0.0).0, &goal(robot)) < 1e-6, "{}: {robot:?}", scene.name);
            }
        }
    }

    /// The papers' coordinates have six digits; what follows from them has no more.
    #[test]
    fn orbits_are_round_numbers() {
        let orbits = scene("rpoa_moving6").scenario.obstacles.iter().filter_map(|obstacle| match obstacle.motion {
            Some(model::Motion::Orbit { radius_m, phase_rad, .. }) => Some((radius_m, phase_rad)),
            _ => None,
        });
        assert_eq!(orbits.collect::<Vec<_>>(), [(1.2, 0.0), (0.8, 1.0)]);
    }
}
