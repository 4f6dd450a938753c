//! Who touches what since when. Bodies at rest against each other tremble below what a look can tell, so a touch begins
//! when two surfaces meet and ends when the engine sees them apart by more than its margin.

use nalgebra::Point2;
use std::collections::BTreeMap;

/// What a robot touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum With {
    /// Another robot, by slot; the larger one of the two.
    Robot(usize),
    /// An obstacle, by index.
    Obstacle(usize),
}

/// The beginning of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The robot, by slot.
    pub slot: usize,
    /// What it touches.
    pub with: With,
    /// When, as a share of the tick.
    pub share: f64,
    /// Where, m.
    pub at: Point2<f64>,
}

/// All touches of a world.
#[derive(Debug, Default)]
pub(crate) struct Touches {
    /// Each pair in touch, and whether it has been seen near each other since the last [`part`](Touches::part).
    lasting: BTreeMap<(usize, With), bool>,
    /// Those that began in this tick, sorted.
    pub(crate) begun: Vec<Touch>,
}

impl Touches {
    /// A tick begins.
    pub(crate) fn clear(&mut self) {
        self.begun.clear();
    }

    /// Two bodies are near each other, and touch or not.
    pub(crate) fn near(&mut self, touch: Touch, touches: bool) {
        let pair = (touch.slot, touch.with);
        match self.lasting.get_mut(&pair) {
            Some(seen) => *seen = true,
            None if touches => {
                self.lasting.insert(pair, true);
                self.begun.push(touch);
            }
            None => {}
        }
    }

    /// A touch that is told of elsewhere: bodies that were placed into each other. Whether it begins now.
    pub(crate) fn known(&mut self, slot: usize, with: With) -> bool {
        self.begun.retain(|touch| (touch.slot, touch.with) != (slot, with));
        self.lasting.insert((slot, with), true).is_none()
    }

    /// The end of a step: what has not been seen near each other in it has parted.
    pub(crate) fn part(&mut self) {
        self.lasting.retain(|_, seen| std::mem::take(seen));
    }

    /// A robot left: nothing touches it.
    pub(crate) fn forget(&mut self, slot: usize) {
        self.lasting.retain(|(a, with), _| *a != slot && *with != With::Robot(slot));
    }

    /// The tick is over: what began in it, in the order of robots.
    pub(crate) fn sort(&mut self) {
        self.begun.sort_by_key(|touch| (touch.slot, touch.with));
    }
}
