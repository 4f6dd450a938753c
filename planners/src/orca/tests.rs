//! ORCA, held against the authors' RVO2 library: planners/tests/data/rvo2.py made the scenes and has its answers.

use super::*;
use crate::testing::{LIMITS, input};
use geometry::Polygon;
use model::Limits;

/// The library computes in single precision.
const TOLERANCE: f64 = 5e-4;

/// A robot in the origin, what it wishes, and what is around it.
#[derive(Default)]
struct Scene {
    velocity: Vector2<f64>,
    wish: Vector2<f64>,
    neighbors: Vec<Neighbor>,
    obstacles: Vec<Obstacle>,
}

impl Scene {
    /// What ORCA commands, without a map and without inflation, and the half-planes behind it.
    fn commanded(&self) -> (Vector2<f64>, Vec<HalfPlane>) {
        let params = Params { inflation: 1.0, ..Params::default() };
        let mut planner = Orca::new(params);
        let plan = planner.plan(&PlanInput {
            kind: BodyKind::Point,
            limits: Limits { speed_mps_max: 1.0, ..LIMITS },
            velocity: self.velocity,
            // The wish is what brings it to its goal in a tick.
            goal: Point2::from(self.wish * 0.1),
            neighbors: &self.neighbors,
            obstacles: &self.obstacles,
            ..input()
        });
        let Drive::Velocity(velocity) = plan.drive else { panic!("a point has a velocity") };
        (velocity, planner.planes)
    }
}

fn robot(id: u32, at: [f64; 2], velocity: [f64; 2], radius_m: f64) -> Neighbor {
    Neighbor { velocity: velocity.into(), radius_m, ..crate::testing::neighbor(id, at) }
}

fn standing(shape: Capsule) -> Obstacle {
    Obstacle { id: 0, shape, velocity: Vector2::zeros() }
}

/// A scene of the file, and the velocity that the library answers.
fn read(line: &str) -> (Scene, Vector2<f64>) {
    let parts: Vec<Vec<f64>> = (line.split('|'))
        .map(|part| part.split_whitespace().map(|word| word.parse().expect("it is a number")).collect())
        .collect();
    let [me, others, corners] = &parts[..] else { panic!("a line has three parts: {line}") };
    let [vx, vy, wish_x, wish_y, x, y] = me[..] else { panic!("three velocities: {line}") };
    let robots = others.chunks(5).enumerate().map(|(index, other)| {
        let [x, y, vx, vy, radius_m] = other[..] else { panic!("five numbers: {line}") };
        robot(index as u32, [x, y], [vx, vy], radius_m)
    });
    let corners: Vec<Point2<f64>> = corners.chunks(2).map(|at| Point2::new(at[0], at[1])).collect();
    let edges: Vec<Capsule> = match corners[..] {
        [a, b] => vec![Capsule::segment(a, b)],
        _ => Polygon { corners }.edges().collect(),
    };
    let scene = Scene {
        velocity: Vector2::new(vx, vy),
        wish: Vector2::new(wish_x, wish_y),
        neighbors: robots.collect(),
        obstacles: edges.into_iter().map(standing).collect(),
    };
    (scene, Vector2::new(x, y))
}

/// Overlapping bodies, walls that are touched, and corners that point inwards are among them. Where no velocity fits, others
/// may be as little outside as the best one: that happens once.
#[test]
fn velocities_are_those_of_the_authors() {
    let (mut wrong, mut as_good) = (Vec::new(), 0);
    for (index, line) in include_str!("../../tests/data/rvo2.txt").lines().enumerate() {
        let (scene, theirs) = read(line);
        let (ours, planes) = scene.commanded();
        let worst = |velocity| planes.iter().map(|plane| plane.excess(velocity)).fold(0.0, f64::max);
        if (ours - theirs).norm() <= TOLERANCE {
            continue;
        }
        if worst(ours) > TOLERANCE && (worst(theirs) - worst(ours)).abs() <= TOLERANCE {
            as_good += 1;
            continue;
        }
        wrong.push(format!("{index}: {:?} instead of {:?}: {line}", ours.data.0, theirs.data.0));
    }
    assert!(wrong.is_empty() && as_good <= 1, "{as_good} are as good, and these differ:\n{}", wrong.join("\n"));
}

#[test]
fn who_has_arrived_does_not_give_way() {
    let mut scene = Scene { velocity: Vector2::x(), wish: Vector2::x(), ..Scene::default() };
    scene.neighbors = vec![robot(1, [1.2, 0.1], [0.0, 0.0], 0.2)];
    let (shared, _) = scene.commanded();
    scene.neighbors[0].arrived = true;
    let (alone, _) = scene.commanded();
    assert!((alone.y - 2.0 * shared.y).abs() < 1e-12 && shared.y < 0.0, "{alone} {shared}");
}

#[test]
fn what_moves_without_being_heard_is_avoided_as_well() {
    let mut scene = Scene { velocity: Vector2::x(), wish: Vector2::x(), ..Scene::default() };
    let body = Obstacle { velocity: -Vector2::x(), ..standing(Capsule::disc([2.0, 0.1].into(), 0.2)) };
    scene.obstacles = vec![body];
    let (unheard, _) = scene.commanded();
    scene.obstacles.clear();
    scene.neighbors = vec![Neighbor { arrived: true, ..robot(1, [2.0, 0.1], [-1.0, 0.0], 0.2) }];
    let (heard, _) = scene.commanded();
    assert!((unheard - heard).norm() < 1e-12 && heard.y < 0.0, "{unheard} {heard}");
}

/// Sensors see the nearer walls of a block, from any of them on, whichever way its corners run.
#[test]
fn of_a_block_that_is_seen_in_part_the_near_walls_count() {
    let corners = [[1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [1.0, 1.0]].map(Point2::from);
    let edges: Vec<Capsule> = Polygon { corners: corners.to_vec() }.edges().collect();
    let wish = Vector2::new(1.0, 0.1);
    let commanded = |edges: &[Capsule]| {
        let obstacles = edges.iter().map(|edge| standing(*edge)).collect();
        Scene { velocity: wish, wish, obstacles, ..Scene::default() }.commanded().0
    };
    let whole = commanded(&edges);
    assert!(whole.x < 0.9, "{whole}");
    let back = |edge: &Capsule| Capsule::segment(edge.b, edge.a);
    for seen in [[0, 3, 1].as_slice(), &[3], &[2, 3], &[1, 2, 3], &[0, 3]] {
        let some: Vec<Capsule> = seen.iter().map(|index| edges[*index]).collect();
        let turned: Vec<Capsule> = some.iter().rev().map(back).collect();
        for walls in [some, turned] {
            assert!((commanded(&walls) - whole).norm() < 1e-9, "{seen:?}: {} instead of {whole}", commanded(&walls));
        }
    }
}
