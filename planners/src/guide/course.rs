//! A way over a map to one goal: searched for over some ticks, followed from corner to corner, searched for again by a robot that
//! has been pushed off.

use super::Heading;
use crate::planner::PlanInput;
use crate::way::Ahead;
use geometry::route::{Ground, Progress, Route, Search, is_open, keeps_at};
use nalgebra::{Point2, distance};

/// Steps of the search in a tick: some milliseconds.
const STEPS: usize = 4096;
/// A robot that has lost its way looks at this many corners before and behind the one that it heads for.
const AROUND: usize = 8;
/// It searches again at most this often, ticks.
const PAUSE: u64 = 25;
/// A corner counts as reached after this many ticks near it: what comes next need not be in sight then for a while, ticks.
const NEAR: u32 = 4;
const BLIND: u64 = 20;
/// Near is this share of the radius, and the distance driven in this number of ticks.
const NEAR_SHARE: f64 = 0.5;
const NEAR_TICKS: f64 = 1.5;

/// The way to a goal.
pub(super) struct Course {
    goal: Point2<f64>,
    search: Option<Search>,
    /// The tick at which that began.
    begun: u64,
    route: Option<Route>,
    /// The corner that it heads for.
    next: usize,
    /// For how many ticks it has been near that.
    near: u32,
    /// Until this tick it heads for that whether it sees it or not.
    blind: u64,
}

impl Course {
    fn new(input: &PlanInput<'_>) -> Course {
        let search = Some(Search::new(input.radius_m, input.position, input.goal));
        Course { goal: input.goal, search, begun: input.tick, route: None, next: 0, near: 0, blind: 0 }
    }

    /// What to head for; `course` is what is known of the way to the present goal.
    pub(super) fn follow(course: &mut Option<Course>, ground: Ground<'_>, input: &PlanInput<'_>) -> Heading {
        let course = match course {
            Some(course) if course.goal == input.goal => course,
            other => other.insert(Course::new(input)),
        };
        course.search(ground, input);
        match &course.route {
            None if course.search.is_some() => Heading::Searching,
            None => Heading::Nowhere,
            Some(_) => course.ahead(ground, input),
        }
    }

    /// Goes on with the search, if there is one.
    fn search(&mut self, ground: Ground<'_>, input: &PlanInput<'_>) {
        let Some(search) = &mut self.search else { return };
        match search.go_on(ground, STEPS) {
            Progress::Searching => {}
            Progress::Found(route) => (self.search, self.route, self.next) = (None, Some(route), 0),
            // From where it has been pushed to there may be none: the way that it has leads there all the same.
            Progress::None => (self.search, self.begun) = (None, input.tick),
        }
    }

    fn ahead(&mut self, ground: Ground<'_>, input: &PlanInput<'_>) -> Heading {
        let from = input.position;
        let Some(route) = &self.route else { return Heading::Nowhere };
        let last = route.corners.len() - 1;
        let keeps_m = keeps_at(ground, from, route.keeps_m);
        let goal_keeps_m = keeps_at(ground, self.goal, route.keeps_m);
        let sees = |index: usize| {
            let keeps_m = if index == last { keeps_m.min(goal_keeps_m) } else { keeps_m };
            is_open(ground, [from, route.corners[index]], keeps_m)
        };
        let mut next = self.next;
        // A way turns where there is just enough room, and a body that is a little beside it may not see the next leg: it slides
        // along the wall then.
        let near_m = (NEAR_SHARE * input.radius_m).max(NEAR_TICKS * input.limits.speed_mps_max * input.dt_s);
        let is_near = next < last && distance(&from, &route.corners[next]) <= near_m;
        self.near = if is_near { self.near + 1 } else { 0 };
        let is_lost = if next < last && sees(next + 1) {
            next += 1;
            false
        } else if self.near >= NEAR {
            (next, self.near, self.blind) = (next + 1, 0, input.tick + BLIND);
            false
        } else if input.tick < self.blind || sees(next) {
            false
        } else {
            let around = next.saturating_sub(AROUND)..=(next + AROUND).min(last);
            let whole_m = |index: &usize| distance(&from, &route.corners[*index]) + route.left_m[*index];
            let found = around.filter(|index| sees(*index)).min_by(|a, b| whole_m(a).total_cmp(&whole_m(b)));
            next = found.unwrap_or(next);
            found.is_none()
        };
        let (at, rest_m) = (route.corners[next], route.left_m[next]);
        self.next = next;
        if is_lost && self.search.is_none() && input.tick >= self.begun + PAUSE {
            (self.search, self.begun) = (Some(Search::new(input.radius_m, from, self.goal)), input.tick);
        }
        Heading::To(Ahead { at, is_goal: next == last, left_m: distance(&from, &at) + rest_m })
    }

    /// Whether nothing of the ground is in the way that is left.
    pub(super) fn is_open(&self, ground: Ground<'_>) -> bool {
        let Some(route) = &self.route else { return self.search.is_none() };
        let last = route.corners.len() - 1;
        (self.next..last).all(|index| {
            let line = [route.corners[index], route.corners[index + 1]];
            let ends = line.map(|p| keeps_at(ground, p, route.keeps_m));
            is_open(ground, line, ends[0].min(ends[1]))
        })
    }
}
