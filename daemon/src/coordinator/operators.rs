//! What operators ask of a fleet, and what they are answered.

use super::{Action, Coordinator, Member, State};
use planners::{Kind, ParamValues};
use protocol::daemon_to_world::Order;
use protocol::operator_to_daemon::{NewRobot, Reply, Request};

impl Coordinator {
    /// An operator asks for something. `near` says whether a robot of that radius would overlap a body at a place.
    /// Status needs measurements and is the shell's to answer.
    pub fn request(&mut self, request: &Request, near: &dyn Fn([f64; 2], f64) -> Option<u32>) -> Reply {
        match request {
            Request::Status => refused("status is not the coordinator's to give", None),
            Request::Add(new) => self.add(new, near),
            Request::Task { robot, goal_m, now } => self.task(robot, *goal_m, *now),
        }
    }

    fn add(&mut self, new: &NewRobot, near: &dyn Fn([f64; 2], f64) -> Option<u32>) -> Reply {
        let slots = self.scenario.fleet.max_robots;
        if self.scenario.robots.len() >= slots {
            return refused(
                &format!("the fleet is full: {slots} robots"),
                Some("start it with a larger `fleet.max_robots` (`--set fleet.max_robots=N`)"),
            );
        }
        let kind = match new.kind.as_deref() {
            None => None,
            Some("point") => Some(Kind::Point),
            Some("unicycle") => Some(Kind::Unicycle),
            Some("two-link-arm") => Some(Kind::TwoLinkArm), // refused below, with the reason
            Some(other) => {
                return refused(&format!("unknown kind `{other}`"), Some("known kinds: point, unicycle"));
            }
        };
        let wish = scenarios::NewRobot {
            id: new.id.clone(),
            kind,
            radius_m: None,
            start: new.start_m.into(),
            start_yaw_rad: new.start_yaw_rad,
            goals: vec![new.goal_m.into()],
            planner: new.planner.clone(),
            params: ParamValues::new(),
        };
        let robot = match scenarios::add_robot(&self.scenario, &wish) {
            Ok(robot) => robot,
            Err(problems) => return refused(problems.to_string().trim_end(), None),
        };
        if let Some(slot) = near([robot.start.x, robot.start.y], robot.radius_m) {
            let name = self.name(slot).to_owned();
            return refused(
                &format!("start: robot `{name}` is there"),
                Some("choose another start, or try again later"),
            );
        }
        let slot = self.scenario.robots.len() as u32;
        let reply = Reply::Added { robot: robot.id.clone(), slot };
        self.actions.push(Action::Order(Order::Admit { slot, robot: Box::new(robot.clone()) }));
        self.scenario.robots.push(robot);
        self.members.push(Member::new(slot));
        reply
    }

    fn task(&mut self, name: &str, goal_m: [f64; 2], now: bool) -> Reply {
        let robots = &self.scenario.robots;
        let Some(slot) = robots.iter().position(|robot| robot.id == name) else {
            let known: Vec<&str> = robots.iter().map(|robot| robot.id.as_str()).collect();
            return refused(
                &format!("there is no robot `{name}`"),
                Some(&format!("known robots: {}", known.join(", "))),
            );
        };
        if let Some(problem) = scenarios::goal_problem(&self.scenario, &robots[slot], goal_m.into()) {
            return refused(&problem, Some("choose a goal in free space inside the world"));
        }
        if self.members[slot].state == State::Left {
            return refused(&format!("robot `{name}` has left"), None);
        }
        let task = self.tasks;
        self.tasks += 1;
        self.actions.push(Action::Order(Order::Task { task, slot: slot as u32, goal_m, now }));
        Reply::Tasked { task }
    }
}

fn refused(problem: &str, hint: Option<&str>) -> Reply {
    Reply::Refused { problem: problem.to_owned(), hint: hint.map(str::to_owned) }
}
