//! Who hears whom, and who sees what.
//!
//! Both lists are made sender by sender and piece by piece, in the order of their indices: each is appended to the lists
//! of those that it reaches, which come out sorted without sorting.
//!
//! A sensor sees every body in its range that its robot cannot be sure to hear: one that is silent, one beyond the range
//! of the radio, any other while the radio loses or delays poses. A robot that sees no robots
//! ([`Robot::sees_robots`](model::Robot::sees_robots)) sees the silent ones alone. Who is heard for sure is not listed
//! as seen, because its own word says more. Of an arm only the tip is heard, so its links are seen at any time, by all
//! but itself. An arm hears and sees from where its tip is.

use crate::arm::Arm;
use crate::body::Body;
use crate::grid::{Aabb, Grid};
use crate::shapes::{Placed, Shapes};
use geometry::Capsule;
use protocol::world_to_robot::NeighborRef;

/// The lists of every slot.
#[derive(Default)]
pub(crate) struct Ranges {
    heard: Lists<NeighborRef>,
    /// Those that will be heard as soon as they have spoken, which they do for the first time in this tick.
    coming: Lists<NeighborRef>,
    /// Slots whose list of heard or of coming robots is not what it was.
    hearing_changed: Vec<usize>,
    sensed: Lists<u16>,
    /// Per receiver, how far its list of the tick before has been looked through.
    cursors: Vec<usize>,
    /// By slot.
    receivers: Vec<Receiver>,
    /// By slot, whether its body is on anybody's list of what is seen.
    shown: Vec<bool>,
}

/// How far a robot hears and sees, m, negative for one that does not take part: all that the inner loops need of it,
/// close together in memory.
#[derive(Clone, Copy)]
struct Receiver {
    radio: f64,
    /// With the hysteresis.
    radio_kept: f64,
    sensor: f64,
    sees_robots: bool,
    /// A robot that it hears at all it hears in every tick.
    hears_surely: bool,
}

impl Receiver {
    fn new(body: &Body) -> Receiver {
        if !body.takes_part {
            return Receiver {
                radio: -1.0,
                radio_kept: -1.0,
                sensor: -f64::INFINITY,
                sees_robots: false,
                hears_surely: true,
            };
        }
        Receiver {
            radio: body.radio_range_m,
            radio_kept: body.radio_range_m + body.radio_hysteresis_m,
            sensor: body.sensor_range_m,
            sees_robots: body.sees_robots,
            hears_surely: body.hears_surely,
        }
    }

    /// Whether it may see a robot on the radio, of at most this radius, that it cannot be sure to hear.
    fn may_see_robots(&self, radius_m: f64) -> bool {
        self.sees_robots && !(self.hears_surely && self.radio >= self.sensor + radius_m)
    }
}

/// One list per slot, for this tick and the one before.
struct Lists<T> {
    now: Vec<Vec<T>>,
    before: Vec<Vec<T>>,
    /// Slots whose list is not what it was.
    changed: Vec<usize>,
}

impl Ranges {
    /// The robots that this one hears, sorted by slot.
    pub(crate) fn heard(&self, slot: usize) -> &[NeighborRef] {
        self.heard.now.get(slot).map_or(&[], |list| list)
    }

    /// The pieces that this one sees, sorted by index.
    pub(crate) fn sensed(&self, slot: usize) -> &[u16] {
        self.sensed.now.get(slot).map_or(&[], |list| list)
    }

    /// Whom each slot hears: what a robot hears now decides whether it still hears it in the hysteresis.
    pub(crate) fn all_heard(&self) -> &[Vec<NeighborRef>] {
        &self.heard.now
    }

    /// Goes on from these lists.
    pub(crate) fn resume(&mut self, heard: Vec<Vec<NeighborRef>>) {
        self.heard.now = heard;
    }

    /// The robots that this one will hear from the next tick on, sorted by slot.
    pub(crate) fn coming(&self, slot: usize) -> &[NeighborRef] {
        self.coming.now.get(slot).map_or(&[], |list| list)
    }

    /// Whether anybody sees the body of this slot, the links of an arm apart.
    pub(crate) fn is_shown(&self, slot: usize) -> bool {
        self.shown.get(slot).is_some_and(|shown| *shown)
    }

    /// Slots whose list of heard robots, or of those that come, changed in the last update, sorted.
    pub(crate) fn heard_changed(&self) -> &[usize] {
        if self.coming.changed.is_empty() { &self.heard.changed } else { &self.hearing_changed }
    }

    /// Slots whose list of seen pieces changed in the last update, sorted.
    pub(crate) fn sensed_changed(&self) -> &[usize] {
        &self.sensed.changed
    }

    /// Both lists of everyone that takes part, for the bodies in the grid; all others hear and see nothing.
    pub(crate) fn update(&mut self, bodies: &[Body], arms: &[Arm], shapes: &Shapes, grid: &Grid) {
        self.heard.begin(bodies.len());
        self.coming.begin(bodies.len());
        self.sensed.begin(bodies.len());
        self.cursors.clear();
        self.cursors.resize(bodies.len(), 0);
        self.receivers.clear();
        self.receivers.extend(bodies.iter().map(Receiver::new));
        let radio_max = self.receivers.iter().fold(0.0, |most: f64, receiver| most.max(receiver.radio_kept));
        let sensor_max = self.receivers.iter().fold(0.0, |most: f64, receiver| most.max(receiver.sensor));
        let radius_max = bodies.iter().fold(0.0, |most: f64, body| most.max(body.radius_m));
        let robots_are_seen = self.receivers.iter().any(|receiver| receiver.may_see_robots(radius_max));
        self.shown.clear();
        self.shown.resize(bodies.len(), false);

        for obstacle in &shapes.obstacles {
            self.show_obstacle(obstacle, shapes, grid, sensor_max);
        }
        let mut arms = arms.iter().peekable();
        let mut piece = shapes.len();
        for sender in bodies {
            if sender.on_radio {
                self.send(sender, grid, radio_max);
            } else if sender.speaks_first {
                self.herald(sender, grid, radio_max);
            }
            let arm = arms.next_if(|arm| arm.slot == sender.instance.index.at());
            match arm {
                Some(arm) if sender.in_world => {
                    for (index, link) in (piece..).zip(arm.links()) {
                        self.show_link(arm.slot, index, &link, grid, sensor_max);
                    }
                }
                None if sender.in_world && (!sender.on_radio || robots_are_seen) => {
                    self.show_body(sender, piece, grid, sensor_max);
                }
                _ => {}
            }
            piece += if arm.is_some() { 2 } else { 1 };
        }
        self.heard.finish();
        self.coming.finish();
        self.sensed.finish();
        if !self.coming.changed.is_empty() {
            self.hearing_changed.clear();
            self.hearing_changed.extend(self.heard.changed.iter().chain(&self.coming.changed));
            self.hearing_changed.sort_unstable();
            self.hearing_changed.dedup();
        }
    }

    /// Puts a robot that speaks for the first time on the lists of those that will hear it.
    fn herald(&mut self, sender: &Body, grid: &Grid, radio_max: f64) {
        let here = sender.pose.position;
        grid.visit(Aabb::around([here]).grown(radio_max), |item| {
            let slot = item.robot.at();
            let distance = (item.position - here).norm();
            if distance <= self.receivers[slot].radio && item.robot != sender.instance.index {
                self.coming.now[slot].push(NeighborRef::from(sender.instance));
            }
        });
    }

    /// Puts a sender on the lists of those in radio range.
    fn send(&mut self, sender: &Body, grid: &Grid, radio_max: f64) {
        let here = sender.pose.position;
        let entry = NeighborRef::from(sender.instance);
        grid.visit(Aabb::around([here]).grown(radio_max), |item| {
            let slot = item.robot.at();
            let receiver = self.receivers[slot];
            let distance = (item.position - here).norm();
            if distance > receiver.radio_kept || item.robot == sender.instance.index {
                return;
            }
            let heard = distance <= receiver.radio || {
                // Senders come in the order of the list, so that one pass over it serves them all.
                let (list, cursor) = (&self.heard.before[slot], &mut self.cursors[slot]);
                *cursor += list[*cursor..].iter().take_while(|known| known.index < entry.index).count();
                list.get(*cursor) == Some(&entry)
            };
            if heard {
                self.heard.now[slot].push(entry);
            }
        });
    }

    /// Puts the pieces of an obstacle on the lists of those that see them.
    fn show_obstacle(&mut self, obstacle: &Placed, shapes: &Shapes, grid: &Grid, sensor_max: f64) {
        grid.visit(shapes.bounds(obstacle).grown(sensor_max), |item| {
            let range = self.receivers[item.robot.at()].sensor;
            let inside = range >= 0.0 && shapes.inside(obstacle, item.position);
            for index in obstacle.pieces.clone() {
                if inside || shapes.distance(obstacle, index, item.position) <= range {
                    self.sensed.now[item.robot.at()].push(index as u16);
                }
            }
        });
    }

    /// Puts the body of a robot on the lists of those that see it and are not sure to hear it. Who hears it has just been
    /// listed.
    fn show_body(&mut self, body: &Body, index: usize, grid: &Grid, sensor_max: f64) {
        let (here, robot) = (body.pose.position, body.instance.index);
        grid.visit(Aabb::around([here]).grown(sensor_max + body.radius_m), |item| {
            let receiver = self.receivers[item.robot.at()];
            let distance = (item.position - here).norm() - body.radius_m;
            if distance > receiver.sensor || item.robot == robot {
                return;
            }
            let is_heard = || self.heard.now[item.robot.at()].last().is_some_and(|last| last.index == robot.0);
            if !body.on_radio || receiver.sees_robots && !(receiver.hears_surely && is_heard()) {
                self.sensed.now[item.robot.at()].push(index as u16);
                self.shown[robot.at()] = true;
            }
        });
    }

    /// Puts a link of an arm on the lists of those others that see it.
    fn show_link(&mut self, slot: usize, index: usize, link: &Capsule, grid: &Grid, sensor_max: f64) {
        grid.visit(Aabb::around([link.a, link.b]).grown(sensor_max + link.radius), |item| {
            let receiver = item.robot.at();
            if receiver != slot && link.distance(item.position) <= self.receivers[receiver].sensor {
                self.sensed.now[receiver].push(index as u16);
            }
        });
    }
}

impl<T: PartialEq> Lists<T> {
    /// What was the present is the past; the present is empty.
    fn begin(&mut self, slots: usize) {
        self.now.resize_with(slots, Vec::new);
        self.before.resize_with(slots, Vec::new);
        std::mem::swap(&mut self.now, &mut self.before);
        self.now.iter_mut().for_each(Vec::clear);
    }

    fn finish(&mut self) {
        self.changed.clear();
        let pairs = self.now.iter().zip(&self.before).enumerate();
        // Comparing two empty lists is slow: glibc's `memcmp` faults on the address of nothing, and the processor
        // takes a microcode assist to find that no byte of it was wanted.
        let differ = |now: &Vec<T>, before: &Vec<T>| now.len() != before.len() || !now.is_empty() && now != before;
        self.changed.extend(pairs.filter(|(_, (now, before))| differ(now, before)).map(|(slot, _)| slot));
    }
}

// Derived, it would ask `T` for a default.
impl<T> Default for Lists<T> {
    fn default() -> Self {
        Lists { now: Vec::new(), before: Vec::new(), changed: Vec::new() }
    }
}
