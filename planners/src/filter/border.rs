//! The line between two robots of which neither knows what the other one has heard.
//!
//! Of the two, the one with the lower slot offers lines, and the other one accepts them:
//!
//! 1. The one that offers says a new line with every word, numbered by its tick, and keeps from then on to it as well as to all
//!    lines before that the other one may still rely on.
//! 2. The one that accepts keeps to a single line: the last that it has accepted. It accepts the newest that it has heard as soon as
//!    all that it may still do fits it, and none that is older. It says both numbers.
//! 3. The one that offers hears that, and is free of all lines but the accepted one, the newest one that was heard, and later ones.
//!    So it can always offer another one, however many were not accepted.
//!
//! So at any time there is a line to which both keep, whatever was lost, late or out of order. A pair has no line at first, nor after
//! both have agreed to have none ([`Rule::Apart`]) because they are far from each other: then each stays out of the other one's reach.
//!
//! A line is offered where it gives each the share of the gap that it can use: see [`gap`](super::gap).

use super::Told;
use super::claim::Claim;
use nalgebra::{Point2, Vector2};

/// How many borders one robot talks about at a time: those that leave it the least room. Others stay as they are.
pub const WORDS_MAX: usize = 16;
/// How many offers may be open: a round trip may take this many ticks before offers are made more slowly.
const OFFERS_MAX: usize = 24;
/// A line is offered to whom is nearer than this many times what both reach within their commands; and given up beyond twice that.
const NEAR: f64 = 3.0;
/// Of the gap: what neither uses.
const SLACK: f64 = 1e-9;

/// What two robots keep to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// Each stays out of the other one's reach.
    Apart,
    /// Each stays on its side: x · `normal` ≤ `offset_m` for every point x of the one that offered it, ≥ for the other one.
    Line {
        /// Of length 1, from the one that offers to the other one.
        normal: Vector2<f64>,
        /// m.
        offset_m: f64,
    },
}

/// What one robot tells another about their border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Word {
    /// From now on it keeps to this one as well.
    Offer {
        /// The tick in which it was made; later ones count.
        number: u64,
        /// What is offered.
        rule: Rule,
    },
    /// From now on it keeps to this one alone.
    Accept {
        /// Which offer; zero before any.
        number: u64,
        /// The newest that it has heard of; it accepts none that is older any more.
        heard: u64,
    },
}

/// The robot that talks, in this tick.
pub(super) struct Me<'a> {
    pub(super) at: Point2<f64>,
    pub(super) velocity: Vector2<f64>,
    pub(super) radius_m: f64,
    /// Where it may still get to, before it gives a new command.
    pub(super) claim: &'a Claim,
    /// How far it can get with a command.
    pub(super) reach_m: f64,
    /// For how long a command may act.
    pub(super) act_s: f64,
    pub(super) dt_s: f64,
    /// Its claim keeps out of reach of the other one.
    pub(super) is_out_of_reach: bool,
}

/// What is between this robot and another one.
#[derive(Clone, Debug)]
struct Pair {
    robot: u32,
    incarnation: u32,
    /// What it keeps to, oldest first. The one that accepts has one.
    rules: Vec<(u64, Rule)>,
    /// The newest offer that the one that accepts has heard of.
    heard: u64,
    /// What it says next, if anything.
    word: Option<Word>,
    gap_m: f64,
    /// How far this robot can go towards the other one, m.
    room_m: f64,
}

/// All borders of one robot.
pub(super) struct Pairs {
    robot: u32,
    pairs: Vec<Pair>,
    /// Buffers of pairs that have ended, to be used again.
    spare: Vec<Vec<(u64, Rule)>>,
    /// Who is talked to, who leaves the least room first.
    order: Vec<usize>,
}

impl Pairs {
    pub(super) fn new(robot: u32) -> Pairs {
        Pairs { robot, pairs: Vec::new(), spare: Vec::new(), order: Vec::new() }
    }

    /// Makes the pairs those with the robots that are heard, in their order. A new life of a robot has agreed to nothing.
    pub(super) fn meet(&mut self, told: &[Told]) {
        let same =
            self.pairs.len() == told.len() && self.pairs.iter().zip(told).all(|(pair, other)| pair.is_with(other));
        if same {
            return;
        }
        let mut kept = std::mem::take(&mut self.pairs);
        for other in told {
            let place = kept.iter().position(|pair| pair.is_with(other));
            self.pairs.push(match place {
                Some(place) => kept.swap_remove(place),
                None => {
                    let mut rules = self.spare.pop().unwrap_or_else(|| Vec::with_capacity(OFFERS_MAX));
                    rules.clear();
                    rules.push((0, Rule::Apart));
                    Pair {
                        robot: other.robot,
                        incarnation: other.incarnation,
                        rules,
                        heard: 0,
                        word: None,
                        gap_m: 0.0,
                        room_m: 0.0,
                    }
                }
            });
        }
        self.spare.extend(kept.into_iter().map(|pair| pair.rules));
    }

    /// Takes in what the other robot says, which stands at this place among those that the robot [meets](Pairs::meet), and
    /// finds the answer.
    pub(super) fn talk(&mut self, place: usize, tick: u64, me: &Me<'_>, other: &Told) {
        let offers = self.robot < other.robot;
        let pair = &mut self.pairs[place];
        pair.gap_m = (other.seen.unwrap_or(other.at) - me.at).norm() - me.radius_m - other.radius_m;
        if offers {
            pair.hear_accepted(other.word);
            pair.offer(tick, me, other);
        } else {
            pair.accept(me, other.word);
        }
        let side = if offers { 1.0 } else { -1.0 };
        pair.room_m = pair.rules.iter().fold(pair.gap_m, |least, (_, rule)| match rule {
            Rule::Apart => least,
            Rule::Line { normal, offset_m } => least.min(side * (offset_m - me.at.coords.dot(normal)) - me.radius_m),
        });
    }

    /// What this robot keeps to with the other one at this place, and the numbers of the offers.
    pub(super) fn rules(&self, place: usize) -> &[(u64, Rule)] {
        &self.pairs[place].rules
    }

    /// What is said, to who leaves the least room first: slot, life and word.
    pub(super) fn words(&mut self) -> impl Iterator<Item = (u32, u32, Word)> + '_ {
        self.order.clear();
        self.order.extend((0..self.pairs.len()).filter(|place| self.pairs[*place].word.is_some()));
        let pairs = &self.pairs;
        self.order.sort_unstable_by(|a, b| pairs[*a].room_m.total_cmp(&pairs[*b].room_m).then(a.cmp(b)));
        self.order.iter().take(WORDS_MAX).filter_map(|place| {
            let pair = &self.pairs[*place];
            Some((pair.robot, pair.incarnation, pair.word?))
        })
    }
}

impl Pair {
    fn is_with(&self, other: &Told) -> bool {
        self.robot == other.robot && self.incarnation == other.incarnation
    }

    /// It is free of everything but what the other one keeps to, and what that one can still accept.
    fn hear_accepted(&mut self, word: Option<Word>) {
        let Some(Word::Accept { number, heard }) = word else { return };
        if self.rules.iter().any(|(known, _)| *known == number) {
            self.rules.retain(|(known, _)| *known == number || *known >= heard);
        } else if number == 0 && self.rules.len() < OFFERS_MAX {
            // The other one has forgotten what it had agreed to.
            self.rules.insert(0, (0, Rule::Apart));
        }
    }

    /// Offers what would be best now.
    fn offer(&mut self, tick: u64, me: &Me<'_>, other: &Told) {
        let (newest, rule) = *self.rules.last().expect("there is always a rule");
        let both_m = me.reach_m + other.speed_mps_max * me.act_s + other.brake_m;
        let far_m = NEAR * both_m * if matches!(rule, Rule::Apart) { 1.0 } else { 2.0 };
        // Whatever it offers, its last command has to keep to it as well.
        let wanted =
            if self.gap_m > far_m && me.is_out_of_reach { Some(Rule::Apart) } else { best_line(me, other, tick) };
        if let Some(wanted) = wanted
            && wanted != rule
            && newest < tick
            && self.rules.len() < OFFERS_MAX
        {
            self.rules.push((tick, wanted));
        }
        let (number, rule) = *self.rules.last().expect("there is always a rule");
        self.word = (number > 0).then_some(Word::Offer { number, rule });
    }

    /// Accepts what was offered, if all that it may still do fits it.
    fn accept(&mut self, me: &Me<'_>, word: Option<Word>) {
        let (accepted, _) = self.rules[0];
        if let Some(Word::Offer { number, rule }) = word
            && number > accepted
            && number >= self.heard
        {
            self.heard = number;
            let fits = match rule {
                Rule::Apart => me.is_out_of_reach,
                Rule::Line { normal, offset_m } => {
                    me.claim.most_m(-normal) <= me.at.coords.dot(&normal) - me.radius_m - offset_m
                }
            };
            if fits {
                self.rules[0] = (number, rule);
            }
        }
        // A robot that offers nothing gets no answer.
        self.word = word.map(|_| Word::Accept { number: self.rules[0].0, heard: self.heard });
    }
}

/// The line between what this robot may still do and what the other one probably does until it has heard of the line.
fn best_line(me: &Me<'_>, other: &Told, tick: u64) -> Option<Rule> {
    let (far, beside_m) = me.claim.as_segment();
    let (near, far) = (me.at, me.at + far);
    // What has been heard is as old as this, what is said takes as long to be heard.
    let since_s = tick.saturating_sub(other.tick).max(1) as f64 * me.dt_s;
    let their_claim = other.promise.map_or(Vector2::zeros(), |promise| promise.far - other.at);
    let spare_m = other.promise.map_or(0.0, |promise| f64::from(promise.spare_m));
    let now = other.seen.unwrap_or(other.at + other.velocity * since_s);
    let between = geometry::between_segments(near, far, now, now + their_claim);
    let distance_m = between.norm();
    if distance_m <= 0.0 {
        return None;
    }
    let normal = between / distance_m;
    // If it goes away, the line may follow it.
    let leaves_m = other.velocity.dot(&normal).max(0.0) * since_s;
    let gap_m = distance_m - me.radius_m - other.radius_m - beside_m - spare_m + leaves_m;
    if gap_m <= 0.0 {
        return None;
    }
    let approach = (me.velocity + other.velocity).dot(&normal) * (since_s + me.act_s);
    let share = (0.5 + approach / (2.0 * gap_m)).clamp(0.0, 1.0) * (1.0 - SLACK);
    let front_m = me.at.coords.dot(&normal) + me.claim.most_m(normal) + me.radius_m;
    Some(Rule::Line { normal, offset_m: front_m + share * gap_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(robot: u32, x: f64, word: Option<Word>) -> Told {
        Told {
            robot,
            incarnation: 0,
            is_heard: true,
            tick: 9,
            at: Point2::new(x, 0.0),
            next: None,
            seen: None,
            velocity: Vector2::zeros(),
            radius_m: 0.2,
            speed_mps_max: 1.0,
            brake_m: 0.0,
            promise: None,
            word,
        }
    }

    /// A robot that stands here.
    fn me(at: Point2<f64>, claim: &Claim, is_out_of_reach: bool) -> Me<'_> {
        let velocity = Vector2::zeros();
        Me { at, velocity, radius_m: 0.2, claim, reach_m: 0.1, act_s: 0.1, dt_s: 0.1, is_out_of_reach }
    }

    /// What the robot in slot 1, at the origin, says in tick 10 to another one, and what it keeps to from then on.
    fn talk(pairs: &mut Pairs, tick: u64, other: &Told, is_out_of_reach: bool) -> (Option<Word>, Vec<Rule>) {
        let claim = Claim::default();
        let me = me(Point2::origin(), &claim, is_out_of_reach);
        pairs.meet(std::slice::from_ref(other));
        pairs.talk(0, tick, &me, other);
        let word = pairs.words().map(|(_, _, word)| word).next();
        (word, pairs.rules(0).iter().map(|(_, rule)| *rule).collect())
    }

    #[test]
    fn lines_are_kept_to_until_the_other_one_has_left_them() {
        let mut pairs = Pairs::new(1);
        let (word, rules) = talk(&mut pairs, 10, &told(2, 1.0, None), true);
        let Some(Word::Offer { number: 10, rule: first }) = word else { panic!("{word:?}") };
        assert_eq!(rules, [Rule::Apart, first]);
        let Rule::Line { normal, offset_m } = first else { panic!("{first:?}") };
        assert!((normal - Vector2::x()).norm() < 1e-12 && (offset_m - 0.5).abs() < 1e-6, "half of the gap");
        // It has moved on; what was heard of it is still that it has accepted nothing.
        let (word, rules) = talk(&mut pairs, 11, &told(2, 1.2, Some(Word::Accept { number: 0, heard: 0 })), true);
        let Some(Word::Offer { number: 11, rule: second }) = word else { panic!("{word:?}") };
        assert_eq!(rules, [Rule::Apart, first, second]);
        let (_, rules) = talk(&mut pairs, 12, &told(2, 1.2, Some(Word::Accept { number: 10, heard: 10 })), true);
        assert_eq!(rules[..2], [first, second]);
    }

    #[test]
    fn only_robots_that_are_out_of_reach_give_up_their_line() {
        for out_of_reach in [true, false] {
            let mut pairs = Pairs::new(1);
            talk(&mut pairs, 10, &told(2, 1.0, None), true);
            let far = told(2, 9.0, Some(Word::Accept { number: 10, heard: 10 }));
            let (_, rules) = talk(&mut pairs, 11, &far, out_of_reach);
            assert_eq!(rules.last() == Some(&Rule::Apart), out_of_reach, "{rules:?}");

            let mut pairs = Pairs::new(1);
            let line = Rule::Line { normal: Vector2::x(), offset_m: -0.5 };
            let offer = |number, rule| Some(Word::Offer { number, rule });
            let (_, rules) = talk(&mut pairs, 10, &told(0, -1.0, offer(9, line)), true);
            assert_eq!(rules, [line]);
            let (word, rules) = talk(&mut pairs, 11, &told(0, -9.0, offer(10, Rule::Apart)), out_of_reach);
            assert_eq!((rules[0] == Rule::Apart, rules.len()), (out_of_reach, 1));
            assert_eq!(word, Some(Word::Accept { number: if out_of_reach { 10 } else { 9 }, heard: 10 }));
        }
    }

    #[test]
    fn a_line_that_does_not_fit_is_not_accepted() {
        let mut pairs = Pairs::new(1);
        // It would go through the robot.
        let line = Rule::Line { normal: Vector2::x(), offset_m: -0.1 };
        let (word, rules) = talk(&mut pairs, 10, &told(0, -1.0, Some(Word::Offer { number: 9, rule: line })), true);
        assert_eq!((word, rules), (Some(Word::Accept { number: 0, heard: 9 }), vec![Rule::Apart]));
    }

    #[test]
    fn a_new_life_has_agreed_to_nothing() {
        let mut pairs = Pairs::new(1);
        talk(&mut pairs, 10, &told(2, 1.0, None), true);
        let again = Told { incarnation: 1, ..told(2, 1.0, Some(Word::Accept { number: 10, heard: 10 })) };
        let (_, rules) = talk(&mut pairs, 11, &again, true);
        assert_eq!((rules.len(), rules[0]), (2, Rule::Apart));
    }

    #[test]
    fn lines_that_are_past_are_forgotten_and_not_accepted() {
        let mut pairs = Pairs::new(1);
        for tick in 10..14 {
            talk(&mut pairs, tick, &told(2, 0.1 * tick as f64, Some(Word::Accept { number: 0, heard: 0 })), true);
        }
        assert_eq!(pairs.rules(0).iter().map(|(number, _)| *number).collect::<Vec<_>>(), [0, 10, 11, 12, 13]);
        // What the other one may still accept, and what it keeps to, are left.
        talk(&mut pairs, 14, &told(2, 1.4, Some(Word::Accept { number: 0, heard: 12 })), true);
        assert_eq!(pairs.rules(0).iter().map(|(number, _)| *number).collect::<Vec<_>>(), [0, 12, 13, 14]);

        let mut pairs = Pairs::new(1);
        let offer =
            |number, offset_m| Some(Word::Offer { number, rule: Rule::Line { normal: Vector2::x(), offset_m } });
        // The newer one does not fit, the older one would: it comes too late.
        for (number, offset_m) in [(9, -0.1), (8, -0.5)] {
            let (word, rules) = talk(&mut pairs, 10, &told(0, -1.0, offer(number, offset_m)), true);
            assert_eq!((word, rules), (Some(Word::Accept { number: 0, heard: 9 }), vec![Rule::Apart]));
        }
    }

    #[test]
    fn an_old_line_that_is_in_the_way_comes_before_robots_that_are_near() {
        let claim = Claim::default();
        let me = me(Point2::origin(), &claim, true);
        // With the farthest one there is a line that leaves no room, from a time when it was near.
        let line = Word::Offer { number: 5, rule: Rule::Line { normal: Vector2::x(), offset_m: 0.2 } };
        for robot in [1, 40] {
            let offers = robot < 20;
            let mut told: Vec<Told> = (2..22).map(|other| told(other, 0.1 * f64::from(other) + 0.3, None)).collect();
            let last = told.last_mut().expect("there are some");
            last.word = if offers { Some(Word::Accept { number: 5, heard: 5 }) } else { Some(line) };
            let mut pairs = Pairs::new(robot);
            pairs.meet(&told);
            if let Word::Offer { number, rule } = line
                && offers
            {
                pairs.pairs.last_mut().expect("there are some").rules.push((number, rule));
            }
            for (place, other) in told.iter().enumerate() {
                pairs.talk(place, 10, &me, other);
            }
            assert_eq!(pairs.words().next().map(|(robot, ..)| robot), Some(21), "{robot}");
        }
    }

    /// Two robots that hear of each other some ticks late. The one that accepts goes round the other one faster than lines come;
    /// then it stands.
    #[test]
    fn however_many_offers_were_not_accepted_another_one_is() {
        const LATE: usize = 4;
        let place = |tick: usize| {
            let angle = 0.5 * tick.min(70) as f64;
            Point2::new(0.5 * angle.cos(), 0.5 * angle.sin())
        };
        let claim = Claim::default();
        let mut pairs = [Pairs::new(0), Pairs::new(1)];
        let mut words = [[None; 90]; 2];
        for tick in 10 + LATE..90 {
            let now = [Point2::origin(), place(tick)];
            for robot in 0..2 {
                let (other, heard) = (1 - robot, tick - LATE);
                let (at, seen) = (now[other], Some(now[other]));
                let other = Told { tick: heard as u64, at, seen, ..told(other as u32, 0.0, words[other][heard]) };
                pairs[robot].meet(std::slice::from_ref(&other));
                pairs[robot].talk(0, tick as u64, &me(now[robot], &claim, false), &other);
                words[robot][tick] = pairs[robot].words().map(|(_, _, word)| word).next();
            }
            assert!(pairs[0].rules(0).len() <= 2 * LATE + 3, "{:?}", pairs[0].rules(0));
        }
        let (number, rule) = pairs[1].rules(0)[0];
        assert!(number >= 70 && matches!(rule, Rule::Line { .. }), "{number} {rule:?}");
    }
}
