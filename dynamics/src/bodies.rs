//! The bodies of a world in the engine. Everything goes through the slots in their order, so a tick is a function of what
//! was in it and of what was asked; the engine is built to give the same bits for the same calls on every machine.

use crate::ground::{Chassis, Course, Hold, Patch};
use crate::touch::{Touch, Touches, With};
use geometry::{Capsule, wrap};
use model::{BodyKind, Drive};
use nalgebra::{Point2, Vector2};
use rapier2d_f64::prelude as engine;

/// Longest step of the engine, s: a tick has as many equal steps as it needs.
const STEP_S_MAX: f64 = 0.005;
/// The size of what the engine handles, m: it lets bodies sink into each other by a two-hundredth of this, and sees
/// neighbours at a fiftieth of it.
const SIZE_M: f64 = 0.05;
/// Friction of what has none of its own: of two bodies the smaller coefficient counts.
const WALL_FRICTION: f64 = 1e3;
/// How firmly a patch of ground holds a body to its velocity as long as the force is there, 1/s: far more than one step
/// can tell from entirely.
const FIRMNESS: f64 = 1e9;
/// Natural frequency of two bodies that lean on each other: with it, bodies in a crowd sink into each other by less than a
/// millimetre; with the engine's own 30 Hz it was eight.
const STIFFNESS_HZ: f64 = 120.0;
/// A body that is fast sees what it comes to this much earlier, m, so that it does not sink into it.
const AHEAD_M: f64 = 0.2;
/// Bodies that touched have parted when their surfaces are this far from each other, m.
const PARTED_M: f64 = 0.002;
/// Marks a collider of an obstacle; without it a collider is the body of the robot of this number.
const OBSTACLE_BIT: u128 = 1 << 127;

/// Where a body is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Centre, m.
    pub position: Point2<f64>,
    /// Heading, rad, in (-π, π].
    pub yaw_rad: f64,
    /// In the world frame, m/s.
    pub velocity: Vector2<f64>,
    /// Along its heading, m/s.
    pub speed_mps: f64,
    /// rad/s, counter-clockwise.
    pub turn_radps: f64,
    /// Rates of its wheels, left and right, rad/s; zero without wheels.
    pub wheels_radps: [f64; 2],
}

/// The way of an obstacle in a tick: its offset from where the scenario has it, at the beginning and at the end, m.
pub type Way = [Vector2<f64>; 2];

/// The bodies of a world.
pub struct Bodies {
    world: engine::PhysicsWorld,
    /// What everything stands on.
    ground: engine::RigidBodyHandle,
    steps: u32,
    dt_s: f64,
    /// By slot.
    bodies: Vec<Option<Body>>,
    obstacles: Vec<Obstacle>,
    touches: Touches,
}

struct Body {
    handle: engine::RigidBodyHandle,
    chassis: Chassis,
    /// What holds it to the ground: a joint whose motors are the friction of a patch, for each patch.
    patches: Vec<engine::ImpulseJointHandle>,
    rates_radps: [f64; 2],
    /// The rates that its motors aim at in this step.
    aim_radps: [f64; 2],
}

struct Obstacle {
    pieces: Vec<Capsule>,
    offset: Vector2<f64>,
    /// The body that carries its pieces, if it moves.
    carrier: Option<engine::RigidBodyHandle>,
}

impl Bodies {
    /// A world of ticks of `dt_s` with obstacles, each with its pieces as the scenario has them, its present offset, and
    /// whether it moves. No robot is in it.
    pub fn new<'a>(dt_s: f64, obstacles: impl Iterator<Item = (&'a [Capsule], Vector2<f64>, bool)>) -> Bodies {
        let mut world = engine::PhysicsWorld::new();
        world.gravity = engine::Vector::ZERO;
        let steps = (dt_s / STEP_S_MAX - 1e-9).ceil().max(1.0) as u32;
        let parameters = &mut world.integration_parameters;
        parameters.dt = dt_s / f64::from(steps);
        parameters.length_unit = SIZE_M;
        parameters.contact_softness.natural_frequency = STIFFNESS_HZ;
        parameters.static_contact_softness.natural_frequency = STIFFNESS_HZ;
        parameters.normalized_max_linear_velocity = engine::Real::MAX;
        let ground = world.insert_body(engine::RigidBodyBuilder::fixed());
        let (bodies, touches) = (Vec::new(), Touches::default());
        let mut all = Bodies { world, ground, steps, dt_s, bodies, obstacles: Vec::new(), touches };
        for (pieces, offset, moves) in obstacles {
            all.put(pieces, offset, moves);
        }
        all
    }

    fn put(&mut self, pieces: &[Capsule], offset: Vector2<f64>, moves: bool) {
        let index = self.obstacles.len() as u128;
        let builder = if moves {
            engine::RigidBodyBuilder::kinematic_position_based()
        } else {
            engine::RigidBodyBuilder::fixed()
        };
        let body = self.world.insert_body(builder.translation(out(offset)));
        for (piece, capsule) in pieces.iter().enumerate() {
            let (a, b) = (out(capsule.a.coords), out(capsule.b.coords));
            let shape = if capsule.a == capsule.b {
                engine::ColliderBuilder::ball(capsule.radius).translation(a)
            } else if capsule.radius > 0.0 {
                engine::ColliderBuilder::capsule_from_endpoints(a, b, capsule.radius)
            } else {
                engine::ColliderBuilder::segment(a, b)
            };
            let collider = shape.friction(WALL_FRICTION).friction_combine_rule(engine::CoefficientCombineRule::Min);
            self.world.insert_collider(collider.user_data(OBSTACLE_BIT | index << 32 | piece as u128), Some(body));
        }
        self.obstacles.push(Obstacle { pieces: pieces.to_vec(), offset, carrier: moves.then_some(body) });
    }

    /// Whether the robot of this slot has a body here.
    pub fn has(&self, slot: usize) -> bool {
        self.bodies.get(slot).is_some_and(Option::is_some)
    }

    /// A robot stands here from now on, at rest.
    pub fn enter(&mut self, slot: usize, chassis: Chassis, position: Point2<f64>, yaw_rad: f64) {
        self.leave(slot);
        let builder = engine::RigidBodyBuilder::dynamic().translation(out(position.coords)).rotation(yaw_rad);
        let builder = builder.can_sleep(false).soft_ccd_prediction(AHEAD_M);
        // A point keeps its heading, whatever it touches.
        let builder = if chassis.kind == BodyKind::Point { builder.lock_rotations() } else { builder };
        let handle = self.world.insert_body(builder);
        let disc = engine::ColliderBuilder::ball(chassis.radius_m)
            .mass(chassis.dynamics.mass_kg)
            .friction(chassis.dynamics.friction)
            .friction_combine_rule(engine::CoefficientCombineRule::Min)
            .user_data(slot as u128);
        self.world.insert_collider(disc, Some(handle));
        if self.bodies.len() <= slot {
            self.bodies.resize_with(slot + 1, || None);
        }
        let sides = chassis.wheels.map_or(vec![0.0], |wheels| vec![-0.5 * wheels.track_m, 0.5 * wheels.track_m]);
        let joint = |aside_m| {
            let joint = engine::GenericJointBuilder::new(engine::JointAxesMask::empty());
            joint.local_anchor2(engine::Vector::new(0.0, aside_m))
        };
        let patches = sides
            .into_iter()
            .map(|aside_m| self.world.insert_impulse_joint(self.ground, handle, joint(aside_m)))
            .collect();
        self.bodies[slot] = Some(Body { handle, chassis, patches, rates_radps: [0.0; 2], aim_radps: [0.0; 2] });
    }

    /// A robot is not here any more.
    pub fn leave(&mut self, slot: usize) {
        if let Some(body) = self.bodies.get_mut(slot).and_then(Option::take) {
            self.world.remove_body(body.handle);
            self.touches.forget(slot);
        }
    }

    /// A robot that is here has this velocity, m/s, and turns like this, rad/s, from now on: as something threw it.
    pub fn throw(&mut self, slot: usize, velocity: Vector2<f64>, turn_radps: f64) {
        if let Some(body) = self.bodies.get(slot).and_then(Option::as_ref) {
            let rigid = &mut self.world.bodies[body.handle];
            rigid.set_linvel(out(velocity), true);
            rigid.set_angvel(turn_radps, true);
        }
    }

    /// Two bodies were placed into each other, and that is told of elsewhere: it is not a new touch. Whether they did not
    /// touch before.
    pub fn overlap(&mut self, slot: usize, with: With) -> bool {
        self.touches.known(slot, with)
    }

    /// One tick: every robot here is asked to drive like this, by slot, and one that is not asked brakes; obstacles go their
    /// ways, by index.
    pub fn tick(&mut self, drives: &[Option<Drive>], ways: impl Fn(usize) -> Way) {
        self.touches.clear();
        let h_s = self.dt_s / f64::from(self.steps);
        for step in 0..self.steps {
            let share = f64::from(step + 1) / f64::from(self.steps);
            for (slot, body) in self.bodies.iter_mut().enumerate() {
                if let Some(body) = body {
                    let drive = drives.get(slot).copied().flatten();
                    body.drive(&mut self.world, drive, h_s);
                }
            }
            for (index, obstacle) in self.obstacles.iter_mut().enumerate() {
                if let Some(carrier) = obstacle.carrier {
                    let [from, to] = ways(index);
                    obstacle.offset = from + (to - from) * share;
                    self.world.bodies[carrier].set_next_kinematic_translation(out(obstacle.offset));
                }
            }
            self.world.step();
            for body in self.bodies.iter_mut().flatten().filter(|body| body.chassis.wheels.is_some()) {
                let rigid = &self.world.bodies[body.handle];
                let course = course(rigid, heading(rigid, body.chassis, 0.0));
                body.rates_radps = body.chassis.rates_after(body.aim_radps, body.rates_radps, course, h_s);
            }
            self.look(share);
        }
        self.touches.sort();
    }

    /// Who touches what at the end of a step.
    fn look(&mut self, share: f64) {
        let Bodies { world, bodies, obstacles, touches, .. } = self;
        let place = |slot: usize| {
            let body = bodies[slot].as_ref()?;
            Some((into_point(world.bodies[body.handle].translation()), body.chassis.radius_m))
        };
        for pair in world.narrow_phase.contact_pairs().filter(|pair| pair.has_any_active_contact()) {
            let [first, second] = [pair.collider1, pair.collider2].map(|collider| world.colliders[collider].user_data);
            let (slot, other) = if first & OBSTACLE_BIT != 0 { (second, first) } else { (first, second) };
            let (slot, other) =
                if other & OBSTACLE_BIT == 0 { (slot.min(other), slot.max(other)) } else { (slot, other) };
            let Some((centre, radius_m)) = place(slot as usize) else { continue };
            let (with, nearest, far_m) = if other & OBSTACLE_BIT == 0 {
                let Some((centre, radius_m)) = place(other as usize) else { continue };
                (With::Robot(other as usize), centre, radius_m)
            } else {
                let (index, piece) = ((other >> 32) as u32 as usize, other as u32 as usize);
                let obstacle = &obstacles[index];
                let piece = obstacle.pieces[piece].moved(obstacle.offset);
                (With::Obstacle(index), piece.nearest_core(centre), piece.radius)
            };
            let way = nearest - centre;
            let gap_m = way.norm() - radius_m - far_m;
            let at = if way.norm() > 0.0 { centre + way * (radius_m / way.norm()) } else { centre };
            let pressed = pair.total_impulse_magnitude() > 0.0;
            if pressed || gap_m <= PARTED_M {
                touches.near(Touch { slot: slot as usize, with, share, at }, pressed || gap_m <= 0.0);
            }
        }
        touches.part();
    }

    /// Where the robot of a slot is and how it moves, if it is here.
    pub fn state(&self, slot: usize) -> Option<State> {
        let body = self.bodies.get(slot)?.as_ref()?;
        let rigid = &self.world.bodies[body.handle];
        let yaw_rad = wrap(rigid.rotation().angle());
        let velocity = into(rigid.linvel());
        let (sin, cos) = yaw_rad.sin_cos();
        Some(State {
            position: into_point(rigid.translation()),
            yaw_rad,
            velocity,
            speed_mps: velocity.dot(&Vector2::new(cos, sin)),
            turn_radps: rigid.angvel(),
            wheels_radps: body.rates_radps,
        })
    }

    /// The touches that began in the last tick, in the order of robots.
    pub fn touched(&self) -> &[Touch] {
        &self.touches.begun
    }
}

impl Body {
    /// The ground holds it for a step as its drive asks. A body that turns is held in the middle of its turn, so that it
    /// keeps to its arc.
    fn drive(&mut self, world: &mut engine::PhysicsWorld, drive: Option<Drive>, h_s: f64) {
        let rigid = &world.bodies[self.handle];
        let ahead_rad = 0.5 * rigid.angvel() * h_s;
        let heading = heading(rigid, self.chassis, ahead_rad);
        let course = course(rigid, heading);
        self.aim_radps = self.chassis.aim(drive, self.rates_radps, h_s);
        let patches = self.chassis.patches(drive, self.aim_radps, course, h_s);
        for (handle, patch) in self.patches.iter().zip(patches.into_iter().flatten()) {
            if let Some(joint) = world.impulse_joints.get_mut(*handle, true) {
                hold(&mut joint.data, heading, patch);
            }
        }
    }
}

/// Makes the motors of a joint the friction of a patch.
fn hold(joint: &mut engine::GenericJoint, heading: Vector2<f64>, patch: Patch) {
    let Patch { forward, along, across, spin, .. } = patch;
    let forward = heading * forward.x + Vector2::new(-heading.y, heading.x) * forward.y;
    joint.set_local_axis1(out(forward));
    let motors = [
        (engine::JointAxis::LinX, Some(along)),
        (engine::JointAxis::LinY, Some(across)),
        (engine::JointAxis::AngX, spin),
    ];
    for (axis, hold) in motors {
        if let Some(Hold { velocity, most }) = hold {
            joint.set_motor_velocity(axis, velocity, FIRMNESS).set_motor_max_force(axis, most);
        }
    }
}

/// The direction that counts as forwards: a point has none, and the x axis serves.
fn heading(rigid: &engine::RigidBody, chassis: Chassis, ahead_rad: f64) -> Vector2<f64> {
    match chassis.kind {
        BodyKind::Point => Vector2::x(),
        _ => into(*rigid.rotation() * engine::Vector::from_angle(ahead_rad)),
    }
}

fn course(rigid: &engine::RigidBody, heading: Vector2<f64>) -> Course {
    let velocity = into(rigid.linvel());
    Course { velocity: Vector2::new(velocity.dot(&heading), heading.perp(&velocity)), turn_radps: rigid.angvel() }
}

fn out(v: Vector2<f64>) -> engine::Vector {
    engine::Vector::new(v.x, v.y)
}

fn into(v: engine::Vector) -> Vector2<f64> {
    Vector2::new(v.x, v.y)
}

fn into_point(v: engine::Vector) -> Point2<f64> {
    Point2::new(v.x, v.y)
}
