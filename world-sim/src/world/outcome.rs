//! What a run came to, by ground truth.

use super::World;
use crate::presence::{Presence, State};
use crate::progress::Scale;
use crate::referee::Referee;
use crate::shortest::Map;
use model::{Gone, Outcome, PlanState, Robot, RobotOutcome, Stall};
use nalgebra::Point2;

impl World {
    /// The outcome so far; for the end of a run, since shortest paths are searched for here.
    ///
    /// Besides the robots that were in the world it lists those that should have been and never entered, as gone:
    /// a robot whose process could not start must not look like a robot that was never asked for.
    pub fn outcome(&self) -> Outcome {
        let mut map = Map::new(&self.shapes, self.walls.as_ref());
        let robots =
            self.robots.iter().zip(&self.presences).zip(&self.referees).filter_map(|((robot, presence), referee)| {
                Some(self.robot_outcome(robot.as_ref()?, presence, referee.as_ref()?, &mut map))
                    .filter(|_| presence.joined.is_some() || presence.gone().is_some() || presence.due(self.tick))
            });
        let goals_here = self.referees.iter().flatten().map(|referee| u64::from(referee.goals_done));
        Outcome {
            ticks: self.tick,
            trajectory_hash: self.trajectory_hash(),
            robots: robots.collect(),
            robot_contacts: self.contacts.robots,
            obstacle_contacts: self.contacts.obstacles,
            min_clearance_m: Some(self.contacts.clearance_m).filter(|clearance| clearance.is_finite()),
            min_obstacle_clearance_m: Some(self.contacts.obstacle_clearance_m)
                .filter(|clearance| clearance.is_finite()),
            crossings: self.crossings.passed,
            right_of_way_violations: self.crossings.violations,
            filter: self.filter,
            goals_done: self.goals_before + goals_here.sum::<u64>(),
            events: self.journal.events.clone(),
            events_lost: self.journal.events_lost,
        }
    }

    fn robot_outcome(&self, robot: &Robot, presence: &Presence, referee: &Referee, map: &mut Map) -> RobotOutcome {
        let instance = presence.instance();
        let slot = instance.index.at();
        let joined_tick = presence.joined.or(presence.entry()).unwrap_or(self.tick);
        let arrival = referee.arrival;
        let path_length_m = arrival.map_or(referee.path_m, |arrival| arrival.path_m);
        // The shortest way of a tip would have to be searched for among the poses of its arm.
        let drives = robot.arm.is_none() && robot.goal_motion.is_none() && robot.rounds == Some(1);
        // Nor does a path through an obstacle compare with one past it.
        let comparable = !referee.tasked && !referee.trespassed && drives;
        let shortest_m = arrival
            .filter(|_| comparable)
            .and_then(|_| map.shortest(robot.start, &robot.goals, robot.radius_m, robot.goal_tolerance_m));
        let ratio = |shortest_m: f64| Some(arrival?.path_to_edge_m / shortest_m);
        let time_s = arrival.map(|arrival| (arrival.tick - joined_tick) as f64 * self.clock.dt_s());
        // Limits of acceleration and turning are no part of the free time: it is the least that any robot could take.
        let time_lost = |shortest_m: f64| Some(time_s? - shortest_m / robot.limits.speed_mps_max);
        let is_under_way = arrival.is_none() && matches!(presence.state, State::Present { .. });
        let never_entered = presence.joined.is_none().then_some(Gone::NeverJoined);
        RobotOutcome {
            robot: instance.index,
            incarnation: instance.incarnation,
            arrived: arrival.is_some(),
            time_s,
            arrived_tick: arrival.map(|arrival| arrival.tick),
            joined_tick,
            path_length_m,
            path_ratio: shortest_m.filter(|shortest_m| *shortest_m > 0.0).and_then(ratio),
            time_lost_s: shortest_m.and_then(time_lost).filter(|lost_s| lost_s.is_finite()),
            reversals: referee.reversals(),
            contacts: self.contacts.per_robot.get(slot).copied().unwrap_or(0),
            tasks_done: referee.tasks_done,
            goals_done: referee.goals_done,
            rounds_done: referee.rounds_done,
            final_distance_m: presence.joined.map(|_| referee.distance_m(self.bodies[slot].pose.position)),
            stall: Some(referee)
                .filter(|_| is_under_way)
                // A method that is still looking for a way waits on purpose.
                .filter(|_| self.plans[slot] != PlanState::Planning)
                .and_then(|referee| self.stall(robot, slot, referee, map)),
            end_speed_mps: referee.speed_mps(self.tick).filter(|_| is_under_way),
            plan: self.plans[slot],
            ldj: referee.ldj(),
            gone: presence.gone().or(never_entered),
        }
    }

    /// Whether a robot gets nowhere. Of the tip of an arm the way to its goal is straight.
    fn stall(&self, robot: &Robot, slot: usize, referee: &Referee, map: &mut Map) -> Option<Stall> {
        let scale = Scale { speed_mps: robot.limits.speed_mps_max, size_m: robot.radius_m.max(referee.tolerance_m()) };
        let mut remaining_m = |from: Point2<f64>| {
            let known = robot
                .arm
                .is_none()
                .then(|| map.shortest(from, &[referee.goal()], robot.radius_m, referee.tolerance_m()))
                .flatten();
            known.unwrap_or_else(|| referee.distance_m(from))
        };
        referee.stall(self.tick, self.bodies[slot].pose.position, scale, &mut remaining_m)
    }
}
