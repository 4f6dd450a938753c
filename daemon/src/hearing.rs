//! Whether a newcomer and its neighbours hear each other: what the world told each of them, beside what each of them says. Pure.

use bus::ToldNeighbors;
use model::{RobotIndex, RobotInstance};
use protocol::world_to_robot::{NeighborRef, Odometry};

/// The number of neighbours that a newcomer hears, once it hears all of them and is heard by all that are to hear it.
/// `told` is what the world told a robot, `heard_of` how many neighbours of such a list a robot heard in its newest step.
pub fn mutual(
    newcomer: RobotInstance,
    entered: u64,
    robots: impl Iterator<Item = RobotIndex>,
    told: &dyn Fn(RobotIndex) -> Option<ToldNeighbors>,
    heard_of: &dyn Fn(RobotInstance, u32) -> Option<usize>,
) -> Option<u32> {
    let hears_all = |who: RobotInstance, told: &ToldNeighbors| {
        // In the tick in which it enters nobody has been told of it.
        told.odometry.tick > entered && heard_of(who, told.version) == Some(told.neighbors.len())
    };
    let own = told(newcomer.index).filter(|own| own.odometry.incarnation == newcomer.incarnation)?;
    if !hears_all(newcomer, &own) {
        return None;
    }
    let wanted = NeighborRef::from(newcomer);
    for index in robots.filter(|index| *index != newcomer.index) {
        let other = told(index)?;
        // One that does not take part hears nobody, and is not heard.
        let hears = !other.odometry.has(Odometry::FLAG_PRESENT)
            || other.odometry.tick > entered && !other.neighbors.contains(&wanted)
            || hears_all(RobotInstance { index, incarnation: other.odometry.incarnation }, &other);
        if !hears {
            return None;
        }
    }
    Some(own.neighbors.len() as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENTERED: u64 = 10;

    fn instance(slot: u32, incarnation: u32) -> RobotInstance {
        RobotInstance { index: RobotIndex(slot), incarnation }
    }

    /// What robot 2, in its second life, is told of itself and of robots 0 and 1, and they of it.
    fn scene() -> Vec<ToldNeighbors> {
        let told = |incarnation, neighbors: &[(u32, u32)]| ToldNeighbors {
            odometry: Odometry { tick: ENTERED + 1, incarnation, flags: Odometry::FLAG_PRESENT, ..Odometry::default() },
            neighbors: neighbors.iter().map(|(slot, incarnation)| instance(*slot, *incarnation).into()).collect(),
            version: 3,
        };
        vec![told(0, &[(1, 0), (2, 1)]), told(0, &[(0, 0), (2, 1)]), told(1, &[(0, 0), (1, 0)])]
    }

    fn joined(told: &[ToldNeighbors], heard: [usize; 3], version: u32) -> Option<u32> {
        mutual(instance(2, 1), ENTERED, (0..3).map(RobotIndex), &|index| told.get(index.at()).cloned(), &|who, of| {
            (of == version).then_some(heard[who.index.at()])
        })
    }

    #[test]
    fn a_newcomer_has_joined_when_everybody_hears_everybody() {
        assert_eq!(joined(&scene(), [2, 2, 2], 3), Some(2));
        for heard in [[2, 2, 1], [1, 2, 2], [2, 1, 2]] {
            assert_eq!(joined(&scene(), heard, 3), None, "{heard:?}");
        }
        assert_eq!(joined(&scene(), [2, 2, 2], 2), None, "what they heard is of an older list");
        for slot in 0..3 {
            let mut early = scene();
            early[slot].odometry.tick = ENTERED;
            assert_eq!(joined(&early, [2, 2, 2], 3), None, "robot {slot} has not been told of the tick after");
        }
        let mut other_life = scene();
        other_life[2].odometry.incarnation = 2;
        assert_eq!(joined(&other_life, [2, 2, 2], 3), None);
    }

    #[test]
    fn who_does_not_take_part_or_is_far_away_does_not_matter() {
        let mut held = scene();
        (held[0].odometry.flags, held[0].odometry.tick) = (0, 4);
        held[2].neighbors.remove(0);
        assert_eq!(joined(&held, [0, 2, 1], 3), Some(1));
        let mut far = scene();
        far[0].neighbors = vec![instance(1, 0).into()];
        far[2].neighbors.remove(0);
        assert_eq!(joined(&far, [0, 2, 1], 3), Some(1), "what else it hears is not the newcomer's business");
        let mut alone = scene();
        alone[0].neighbors.clear();
        alone[1].neighbors.clear();
        alone[2].neighbors.clear();
        assert_eq!(joined(&alone, [9, 9, 0], 3), Some(0));
    }
}
