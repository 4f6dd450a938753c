//! Operators, the coordinator and the world in one thread, with messages under way for any time and processes that die:
//! every request gets one answer, and what was acknowledged is in the world.

use daemon::coordinator::{Action, Answer, Coordinator, Ending, Signal};
use model::Seat;
use model::random::Stream;
use protocol::daemon_to_world::{Order, Ticket};
use protocol::operator_to_daemon::{NewRobot, Reply, Request};
use protocol::world_to_daemon::Notice;
use shoal_tests::{scenario, seeds};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;
use world_sim::World;

const KILLED: Ending = Ending { signal: Some(9), code: None };

struct Fleet {
    world: World,
    coordinator: Coordinator,
    /// Under way to the world, and from it.
    orders: VecDeque<Order>,
    notices: VecDeque<Notice>,
    processes: BTreeSet<Seat>,
    /// Processes that were killed and have not been reaped.
    dying: VecDeque<Seat>,
    asked: BTreeMap<Ticket, Vec<Reply>>,
    /// Robots that the world knows.
    expected: BTreeSet<u32>,
    now: Duration,
}

impl Fleet {
    fn new() -> Fleet {
        let text = r#"
            [world]
            x_m = [-40, 40]
            y_m = [-40, 40]
            [clock]
            tick_hz = 10
            duration_s = 10000
            stop = "duration"
            [fleet]
            max_robots = 8
            [defaults]
            planner = "straight"
            restart = "on-failure"
            restart_limit = 2
            restart_delay_s = 0.3
            [[robot]]
            id = "a"
            start_m = [0, 0]
            goal_m = [30, 0]
            [[robot]]
            id = "b"
            start_m = [0, 5]
            goal_m = [30, 5]
        "#;
        let scenario = scenario(text);
        let mut coordinator = Coordinator::new(scenario.clone());
        coordinator.begin();
        let mut fleet = Fleet {
            world: World::new(&scenario),
            coordinator,
            orders: VecDeque::new(),
            notices: VecDeque::new(),
            processes: BTreeSet::new(),
            dying: VecDeque::new(),
            asked: BTreeMap::new(),
            expected: BTreeSet::new(),
            now: Duration::from_secs(1000),
        };
        fleet.act();
        fleet
    }

    fn ask(&mut self, request: &Request) {
        if let Answer::Later(ticket) = self.coordinator.request(request, &|_, _| None) {
            assert!(self.asked.insert(ticket, Vec::new()).is_none(), "{ticket:?} was handed out before");
        }
    }

    fn act(&mut self) {
        for action in self.coordinator.take_actions() {
            match action {
                Action::Spawn(seat) => {
                    self.processes.insert(seat);
                    self.coordinator.spawned(seat, 1000 + seat.slot, self.now);
                }
                Action::Signal(seat, Signal::Kill) => self.kill(seat),
                Action::Signal(..) | Action::Say(_) | Action::News { .. } | Action::KillFleet => {}
                Action::Order(order) => self.orders.push_back(order),
                Action::Reply(ticket, reply) => self.asked.get_mut(&ticket).expect("somebody asked").push(reply),
            }
        }
    }

    fn kill(&mut self, seat: Seat) {
        if self.processes.remove(&seat) {
            self.dying.push_back(seat);
        }
    }

    fn reap(&mut self) {
        while let Some(seat) = self.dying.pop_front() {
            self.coordinator.exited(seat, KILLED, None, None);
            self.act();
        }
    }

    fn deliver_orders(&mut self, most: usize) {
        for _ in 0..most.min(self.orders.len()) {
            let order = self.orders.pop_front().expect("there is one");
            self.world.order(order);
        }
    }

    fn tick(&mut self) {
        let processes = &self.processes;
        self.world.open(&mut |seat| processes.contains(&seat));
        self.world.close(&mut |_| None);
        self.hear();
    }

    fn hear(&mut self) {
        let notices = self.world.take_notices();
        self.expected.extend(notices.iter().filter_map(|notice| match notice {
            Notice::Expect { seat, .. } => Some(seat.slot),
            _ => None,
        }));
        self.notices.extend(notices);
    }

    fn deliver_notices(&mut self, most: usize) {
        for _ in 0..most.min(self.notices.len()) {
            let notice = self.notices.pop_front().expect("there is one");
            self.coordinator.notice(notice);
            self.act();
        }
    }
}

fn run(seed: u64) -> (usize, usize, usize) {
    let mut stream = Stream::new(seed, 0, 0, "test-operators");
    let mut below = |n: usize| (stream.between(0.0, n as f64) as usize).min(n - 1);
    let mut fleet = Fleet::new();
    let ids = ["a", "b", "c0", "c1", "c2", "c3", "c4", "c5", "nobody"];
    // In some runs the world stands still now and then, in some messages take long.
    let (still, slow) = (below(4), 1 + below(3));
    let mut added = 0;
    for step in 0..600 {
        fleet.now += Duration::from_millis(100);
        match below(10) {
            0..6 => {
                let (robot, now) = (ids[below(ids.len())].to_owned(), below(20) == 0);
                let goal_m = [10.0 + below(20) as f64, below(30) as f64];
                fleet.ask(&Request::Task { robot, goal_m, yaw_rad: None, now });
            }
            6 if added < 6 => {
                let place = 10.0 + 3.0 * added as f64;
                let (id, start_m, goal_m) = (Some(format!("c{added}")), [-20.0, place], [20.0, place]);
                fleet.ask(&Request::Add(NewRobot { id, start_m, goal_m, ..NewRobot::default() }));
                added += 1;
            }
            7 if below(8) == 0 => {
                let victims: Vec<Seat> = fleet.processes.iter().copied().collect();
                if !victims.is_empty() {
                    fleet.kill(victims[below(victims.len())]);
                }
            }
            _ => {}
        }
        fleet.act();
        let stands = still == 0 && step % 200 > 120;
        if below(slow) == 0 && !stands {
            fleet.deliver_orders(1 + below(6));
            fleet.tick();
        }
        if below(slow) == 0 {
            fleet.deliver_notices(1 + below(30));
        }
        if below(3) == 0 {
            fleet.reap();
        }
        fleet.coordinator.time(fleet.now, &|_| true, &|_| Duration::ZERO);
        fleet.act();
    }
    // The end, as the shells have it: the world refuses what has no effect any more, the daemon what never got there.
    let some = below(5);
    fleet.deliver_orders(some);
    fleet.world.refuse_orders();
    fleet.hear();
    fleet.deliver_notices(usize::MAX);
    fleet.coordinator.stopping();
    fleet.coordinator.refuse_waiting();
    fleet.act();

    let events = fleet.world.outcome().events;
    let taken = |task: u32| {
        let mark = format!("task {task}: ");
        events.iter().filter(|event| event.kind == "task" && event.detail.starts_with(&mark)).count()
    };
    let (mut acknowledged, mut refused, mut unknown) = (0, 0, 0);
    for (ticket, replies) in &fleet.asked {
        assert_eq!(replies.len(), 1, "{ticket:?}: {replies:?}");
        match (ticket, &replies[0]) {
            (Ticket::Task(task), Reply::Tasked { task: told }) => {
                assert_eq!((taken(*task), task), (1, told), "task {task} was acknowledged");
                acknowledged += 1;
            }
            (Ticket::Task(task), Reply::Refused { .. }) => {
                assert_eq!(taken(*task), 0, "task {task} was refused");
                refused += 1;
            }
            (Ticket::Admit(slot), Reply::Added { .. }) => {
                assert!(fleet.expected.contains(slot), "the world knows robot {slot}");
                assert!(fleet.coordinator.scenario().robots.len() > *slot as usize);
            }
            (Ticket::Admit(slot), Reply::Refused { .. }) => {
                assert!(fleet.coordinator.scenario().robots.len() <= *slot as usize, "robot {slot} was never there");
            }
            (_, Reply::Unconfirmed { .. }) => unknown += 1,
            (ticket, reply) => panic!("{ticket:?}: {reply:?}"),
        }
    }
    (acknowledged, refused, unknown)
}

#[test]
fn every_request_gets_one_answer_and_what_is_acknowledged_is_there() {
    let (mut acknowledged, mut refused, mut unknown) = (0, 0, 0);
    seeds(0..200, |seed| {
        let (taken, not, open) = run(seed);
        (acknowledged, refused, unknown) = (acknowledged + taken, refused + not, unknown + open);
    });
    // All three happen: none of the rows above is empty.
    assert!(acknowledged > 10_000 && refused > 500 && unknown > 500, "{acknowledged} {refused} {unknown}");
}
