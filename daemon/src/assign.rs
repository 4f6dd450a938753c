//! Which robots do which goals: the cost of a goal is the way that a robot has left before it, and the way to it. Pure.

use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Costs are compared in this unit, m.
const UNIT_M: f64 = 1e-3;
/// What stands for a goal that a robot cannot do, in units: more than all real costs of a batch together.
const IMPOSSIBLE: i64 = 1 << 40;
/// No way is longer than this, in units: a world is smaller, and sums stay exact.
const LONGEST: i64 = 1 << 30;

/// A robot that may be given goals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Where it will be when it has done what it has to do, m.
    pub ends_m: [f64; 2],
    /// The length of the way until then, m.
    pub left_m: f64,
}

impl Candidate {
    /// The length of its way until it has done this goal as well, m.
    fn cost_m(&self, goal_m: [f64; 2]) -> f64 {
        self.left_m + (goal_m[0] - self.ends_m[0]).hypot(goal_m[1] - self.ends_m[1])
    }

    /// It is given this goal.
    pub fn take(&mut self, goal_m: [f64; 2]) {
        *self = Candidate { left_m: self.cost_m(goal_m), ends_m: goal_m };
    }
}

/// Whether a candidate may do a goal, both by their places in the lists.
pub type May<'a> = dyn Fn(usize, usize) -> bool + 'a;

/// One goal after the other, to the candidate with the shortest way to its end; of equal ones the first. A goal that no
/// candidate may do has none.
pub fn nearest(mut candidates: Vec<Candidate>, goals_m: &[[f64; 2]], may: &May<'_>) -> Vec<Option<usize>> {
    let assigned = goals_m.iter().enumerate().map(|(goal, &goal_m)| {
        let able = (0..candidates.len()).filter(|&robot| may(robot, goal));
        let cost = |robot: &usize| candidates[*robot].cost_m(goal_m);
        let best = able.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        candidates[best].take(goal_m);
        Some(best)
    });
    assigned.collect()
}

/// The least sum of the ways (Kuhn 1955, Munkres 1957), with at most one goal for each candidate. Where there are more goals
/// than candidates, as many as there are candidates are given out in this way, those of the least sum, and the others in
/// further rounds. A goal that no candidate may do has none.
pub fn optimal(mut candidates: Vec<Candidate>, goals_m: &[[f64; 2]], may: &May<'_>) -> Vec<Option<usize>> {
    let mut assigned = vec![None; goals_m.len()];
    let mut open: Vec<usize> = (0..goals_m.len()).collect();
    while !open.is_empty() && !candidates.is_empty() {
        let cost = |robot: usize, goal: usize| match may(robot, goal) {
            true => ((candidates[robot].cost_m(goals_m[goal]) / UNIT_M).round() as i64).clamp(0, LONGEST),
            false => IMPOSSIBLE,
        };
        // The algorithm wants no more rows than columns, and finds a column for each row.
        let pairs: Vec<(usize, usize)> = if open.len() <= candidates.len() {
            let costs = Matrix::from_fn(open.len(), candidates.len(), |(row, robot)| cost(robot, open[row]));
            kuhn_munkres_min(&costs).1.into_iter().enumerate().map(|(row, robot)| (robot, open[row])).collect()
        } else {
            let costs = Matrix::from_fn(candidates.len(), open.len(), |(robot, column)| cost(robot, open[column]));
            kuhn_munkres_min(&costs).1.into_iter().enumerate().map(|(robot, column)| (robot, open[column])).collect()
        };
        let able: Vec<(usize, usize)> = pairs.into_iter().filter(|(robot, goal)| may(*robot, *goal)).collect();
        if able.is_empty() {
            break;
        }
        for (robot, goal) in able {
            assigned[goal] = Some(robot);
            candidates[robot].take(goals_m[goal]);
        }
        open.retain(|goal| assigned[*goal].is_none());
    }
    assigned
}

/// A sequential single-item auction (Koenig et al., "The power of sequential single-item auctions for agent coordination", AAAI
/// 2006, section 4, bids of the rule MiniMax): in each round every candidate bids for every goal that is left, with the length of
/// its way until it has done that goal as well. The lowest bid of all wins its goal; of equal ones that for the first goal, and of
/// these that of the first candidate. A goal that no candidate may do has none.
pub fn auction(mut candidates: Vec<Candidate>, goals_m: &[[f64; 2]], may: &May<'_>) -> Vec<Option<usize>> {
    let mut assigned = vec![None; goals_m.len()];
    loop {
        let left = (0..goals_m.len()).filter(|goal| assigned[*goal].is_none());
        let bids = left.flat_map(|goal| (0..candidates.len()).map(move |robot| (goal, robot)));
        let bids = bids.filter(|(goal, robot)| may(*robot, *goal));
        let bids = bids.map(|(goal, robot)| (candidates[robot].cost_m(goals_m[goal]), goal, robot));
        let Some((_, goal, winner)) = bids.min_by(|a, b| a.0.total_cmp(&b.0)) else { return assigned };
        assigned[goal] = Some(winner);
        candidates[winner].take(goals_m[goal]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64) -> Candidate {
        Candidate { ends_m: [x_m, 0.0], left_m: 0.0 }
    }

    fn places(xs_m: &[f64]) -> Vec<[f64; 2]> {
        xs_m.iter().map(|x_m| [*x_m, 0.0]).collect()
    }

    const ALL: &May<'static> = &|_, _| true;

    #[test]
    fn the_optimum_is_not_always_the_nearest() {
        // The first goal is nearest to the robot that is the only one near the second.
        let robots = vec![at(0.0), at(4.0)];
        let goals = places(&[3.0, 9.0]);
        assert_eq!(nearest(robots.clone(), &goals, ALL), [Some(1), Some(1)]);
        assert_eq!(optimal(robots, &goals, ALL), [Some(0), Some(1)]);
    }

    #[test]
    fn what_a_robot_has_to_do_counts() {
        let busy = Candidate { ends_m: [1.0, 0.0], left_m: 10.0 };
        assert_eq!(nearest(vec![busy, at(-5.0)], &places(&[1.0]), ALL), [Some(1)]);
        assert_eq!(optimal(vec![busy, at(-5.0)], &places(&[1.0]), ALL), [Some(1)]);
        // A goal that has just been given is something to do.
        assert_eq!(nearest(vec![at(0.0), at(9.0)], &places(&[1.0, 5.0, 9.0]), ALL), [Some(0), Some(1), Some(1)]);
    }

    /// By hand: robots at 0 and at 10, goals at 4, 7 and 1.
    ///
    /// | round | bids of the first | bids of the second | lowest |
    /// |---|---|---|---|
    /// | 1 | 4, 7, 1 | 6, 3, 9 | the first, 1 for the goal at 1 |
    /// | 2 | 1+3 = 4, 1+6 = 7 | 6, 3 | the second, 3 for the goal at 7 |
    /// | 3 | 1+3 = 4 | 3+3 = 6 | the first, 4 for the goal at 4 |
    #[test]
    fn the_lowest_bid_of_each_round_wins_its_goal() {
        let goals = places(&[4.0, 7.0, 1.0]);
        assert_eq!(auction(vec![at(0.0), at(10.0)], &goals, ALL), [Some(0), Some(1), Some(0)]);
        // What a robot has to do counts: with 2.5 m left where it stands, the first bids 6.5 for the goal at 4 in the third
        // round, against the second robot's 6.
        let busy = Candidate { left_m: 2.5, ..at(0.0) };
        assert_eq!(auction(vec![busy, at(10.0)], &goals, ALL), [Some(1), Some(1), Some(0)]);
        assert_eq!(auction(Vec::new(), &goals, ALL), [None; 3]);
    }

    #[test]
    fn of_equal_bids_the_first_goal_and_then_the_first_robot_win() {
        // Both goals are 1 m from both robots.
        let goals = places(&[1.0, -1.0]);
        assert_eq!(auction(vec![at(0.0), at(0.0)], &goals, ALL), [Some(0), Some(1)]);
        // An auction does not go in the order of the goals: that at -1 is sold first, for 1, and makes that at 6 dearer for the
        // first robot: 1 + 7 = 8 against 6.5.
        let (robots, goals) = (vec![at(0.0), at(12.5)], places(&[6.0, -1.0]));
        assert_eq!(auction(robots.clone(), &goals, ALL), [Some(1), Some(0)]);
        assert_eq!(nearest(robots, &goals, ALL), [Some(0), Some(0)]);
    }

    #[test]
    fn more_goals_than_robots_are_given_out_in_rounds() {
        let goals = places(&[1.0, 9.0, 2.0, 8.0, 5.5]);
        let assigned = optimal(vec![at(0.0), at(10.0)], &goals, ALL);
        assert_eq!(assigned, [Some(0), Some(1), Some(0), Some(1), Some(1)]);
        assert_eq!(optimal(Vec::new(), &goals, ALL), [None; 5]);
        assert_eq!(nearest(Vec::new(), &goals, ALL), [None; 5]);
    }

    #[test]
    fn a_goal_that_no_robot_may_do_stays_and_costs_the_others_nothing() {
        let may: &May<'_> = &|robot, goal| goal != 1 && !(robot == 0 && goal == 0);
        let goals = places(&[0.0, 5.0, 9.0]);
        assert_eq!(optimal(vec![at(0.0), at(9.0)], &goals, may), [Some(1), None, Some(0)]);
        assert_eq!(nearest(vec![at(0.0), at(9.0)], &goals, may), [Some(1), None, Some(0)]);
        assert_eq!(auction(vec![at(0.0), at(9.0)], &goals, may), [Some(1), None, Some(1)]);
    }

    /// Against every permutation, for up to five of each.
    #[test]
    fn no_other_assignment_is_shorter() {
        let mut stream = model::random::Stream::new(7, 0, 0, "assign");
        let mut place = || [stream.between(0.0, 20.0), stream.between(0.0, 20.0)];
        for round in 0..200 {
            let (robots, goals) = (1 + round % 5, 1 + round / 5 % 5);
            let candidates: Vec<Candidate> = (0..robots)
                .map(|_| {
                    let [left_m, _] = place();
                    Candidate { ends_m: place(), left_m }
                })
                .collect();
            let goals_m: Vec<[f64; 2]> = (0..goals).map(|_| place()).collect();
            if goals > robots {
                continue;
            }
            let sum = |assigned: &[usize]| -> f64 {
                assigned.iter().zip(&goals_m).map(|(robot, goal_m)| candidates[*robot].cost_m(*goal_m)).sum()
            };
            let found: Vec<usize> = optimal(candidates.clone(), &goals_m, ALL).into_iter().flatten().collect();
            let mut least = f64::INFINITY;
            each_choice(robots, goals, &mut Vec::new(), &mut |choice| least = least.min(sum(choice)));
            assert!(found.len() == goals && sum(&found) < least + goals as f64 * UNIT_M, "{} {least}", sum(&found));
        }
    }

    fn each_choice(robots: usize, goals: usize, chosen: &mut Vec<usize>, visit: &mut dyn FnMut(&[usize])) {
        if chosen.len() == goals {
            return visit(chosen);
        }
        for robot in 0..robots {
            if !chosen.contains(&robot) {
                chosen.push(robot);
                each_choice(robots, goals, chosen, visit);
                chosen.pop();
            }
        }
    }
}
