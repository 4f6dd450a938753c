//! The bodies of a world with forces: they are as solid as the engine makes them, and go where it lets them.

use crate::body::Body;
use crate::contact::Contact;
use crate::shapes::Shapes;
use crate::touch::First;
use dynamics::{Bodies, Chassis, Touch, With};
use model::kinematics::Pose;
use model::{Drive, Robot};

/// A world's bodies in the engine, and what they are asked.
pub(crate) struct Solid {
    bodies: Bodies,
    /// By slot: what each robot is asked to do in this tick; nothing brakes it.
    asked: Vec<Option<Drive>>,
}

impl Solid {
    /// Obstacles as they are at time 0, and no robots.
    pub(crate) fn new(dt_s: f64, shapes: &Shapes) -> Solid {
        let obstacles = shapes.obstacles.iter().map(|obstacle| {
            let pieces = shapes.base(obstacle);
            (pieces, obstacle.offset, obstacle.moves())
        });
        Solid { bodies: Bodies::new(dt_s, obstacles), asked: Vec::new() }
    }

    /// A tick opens: robots in the world have a body here, the others do not, and no robot has been asked yet.
    pub(crate) fn open(&mut self, bodies: &[Body], robots: &[Option<Robot>]) {
        self.asked.clear();
        self.asked.resize(bodies.len(), None);
        for (slot, (body, robot)) in bodies.iter().zip(robots).enumerate() {
            match robot {
                Some(robot) if body.in_world => {
                    if !self.bodies.has(slot) {
                        self.bodies.enter(slot, Chassis::of(robot), body.pose.position, body.pose.yaw_rad);
                    }
                }
                _ => self.bodies.leave(slot),
            }
        }
    }

    /// The robot of this slot goes, and another one may come before the next tick opens.
    pub(crate) fn leave(&mut self, slot: usize) {
        self.bodies.leave(slot);
    }

    /// A robot asks its body for this.
    pub(crate) fn ask(&mut self, slot: usize, drive: Option<Drive>) {
        self.asked[slot] = drive;
    }

    /// A tick passes; obstacles are where they are at its end already.
    pub(crate) fn pass(&mut self, bodies: &mut [Body], shapes: &Shapes) {
        self.bodies.tick(&self.asked, |index| {
            let obstacle = &shapes.obstacles[index];
            [obstacle.offset_before, obstacle.offset]
        });
        for (slot, body) in bodies.iter_mut().enumerate() {
            if let Some(state) = self.bodies.state(slot) {
                body.pose = Pose {
                    position: state.position,
                    yaw_rad: state.yaw_rad,
                    velocity: state.velocity,
                    speed_mps: state.speed_mps,
                    turn_radps: state.turn_radps,
                    wheel_radps: state.wheels_radps,
                };
            }
        }
    }

    /// What came into contact in the last tick.
    pub(crate) fn touched(&self) -> impl Iterator<Item = Contact> + '_ {
        self.bodies.touched().iter().map(|touch| contact(touch.slot, touch.with))
    }

    /// Bodies that were placed into each other touch already; whether that is news.
    pub(crate) fn overlap(&mut self, contact: Contact) -> bool {
        match contact {
            Contact::Robots(slot, other) => self.bodies.overlap(slot, With::Robot(other)),
            Contact::Obstacle(slot, index) => self.bodies.overlap(slot, With::Obstacle(index)),
            // Worlds of bodies with weight have no map.
            Contact::Map(_) => true,
        }
    }

    /// Where and when a contact of the last tick began.
    pub(crate) fn first(&self, what: Contact) -> Option<First> {
        let found = self.bodies.touched().iter().find(|touch| contact(touch.slot, touch.with) == what);
        found.map(|Touch { share, at, .. }| First { share: *share, at: *at })
    }
}

fn contact(slot: usize, with: With) -> Contact {
    match with {
        With::Robot(other) => Contact::Robots(slot, other),
        With::Obstacle(index) => Contact::Obstacle(slot, index),
    }
}
