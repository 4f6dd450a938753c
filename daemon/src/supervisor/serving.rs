//! Operators: what they ask, and what they are answered at once.

use super::Supervisor;
use super::places::Bids;
use crate::coordinator::{Answer, Member, OpenTick};
use crate::processes::now;
use crate::status;
use model::RobotIndex;
use protocol::operator_to_daemon::{Assign, NewTasks, Reply, Request, Status};
use protocol::world_to_robot::Odometry;

/// Requests of operators that are answered before anything else is looked at again.
const REQUESTS_AT_A_TIME: usize = 32;

impl Supervisor {
    /// Answers operators: no more at a time than leaves room for everything else, however many there are. The others are
    /// waited on by the next `poll`, which returns immediately.
    pub(super) fn serve(&mut self) {
        for _ in 0..REQUESTS_AT_A_TIME {
            let Some((request, responder)) = self.operators.take() else { break };
            let answer = match &request {
                Request::Status => Answer::Now(Reply::Status(self.status())),
                // An operator who went believes that nothing was done.
                _ if !responder.is_awaited() => continue,
                request => {
                    match request {
                        Request::Task(NewTasks { assign: Assign::Auction, .. }) => {
                            self.coordinator.tell_places(self.places(Bids::Read));
                        }
                        Request::Task(NewTasks { assign: Assign::Nearest | Assign::Optimal, .. }) => {
                            self.coordinator.tell_places(self.places(Bids::Unread));
                        }
                        _ => {}
                    }
                    let (observer, robots) = (&self.observer, &self.coordinator.scenario().robots);
                    // Nothing else asks who is near.
                    let members = Some(self.coordinator.members()).filter(|_| matches!(request, Request::Add(_)));
                    let bodies: Vec<(RobotIndex, Odometry, f64)> = (members.into_iter().flatten())
                        .filter(|member| member.in_world())
                        .map(|member| member.instance.index)
                        .map(|robot| (robot, observer.odometry(robot), robots[robot.at()].radius_m))
                        .collect();
                    let near = |[x_m, y_m]: [f64; 2], radius_m: f64| {
                        let reach = |body: &(RobotIndex, Odometry, f64)| {
                            (body.1.x_m - x_m).hypot(body.1.y_m - y_m) < body.2 + radius_m
                        };
                        bodies.iter().find(|body| reach(body)).map(|body| body.0)
                    };
                    self.coordinator.request(request, &near)
                }
            };
            match answer {
                Answer::Now(reply) => responder.reply(&reply),
                Answer::Later(ticket) => self.awaiting.push((ticket, responder)),
            }
        }
        let noise = self.operators.noise();
        self.coordinator.noise(noise.count, &noise.newest, now());
    }

    /// The tick that has been open for too long, if one is.
    pub(super) fn open_tick(&self) -> Option<OpenTick> {
        let instances = self.coordinator.members().iter().map(|member| member.instance);
        status::open_tick(self.coordinator.scenario().clock.mode, &self.gate, &self.observer, instances)
    }

    fn status(&self) -> Status {
        let process = |member: &Member| status::RobotProcess {
            instance: member.instance,
            pid: member.pid.map(|started| self.children.agent_pid(started)),
            state: member.state,
            restarts: member.restarts(),
        };
        status::of(
            self.coordinator.scenario(),
            self.coordinator.members().iter().map(process),
            &self.gate,
            &self.observer,
            std::process::id(),
            self.children.world_pid().unwrap_or(0),
        )
    }
}
