//! Before anything starts: are open files enough for the fleet?
//!
//! What is certain is refused: the world opens the board of every robot, an agent those of the robots that it hears at
//! the start. What may come later, when robots meet that are apart now, is found then, and said (event `deaf`).

use crate::error::{Error, Kind};
use bus::descriptors::{PER_BOARD, of_agent, of_daemon, of_world, open_now, raise_limit};
use model::Scenario;
use world_sim::World;

/// Raises the limit as far as it goes, and refuses a fleet that is too large for it.
///
/// # Errors
/// Names the need, the limit and the ways out.
pub fn check(scenario: &Scenario) -> Result<(), Error> {
    let limit = raise_limit();
    let robots = scenario.robots.len();
    let inherited = open_now().unwrap_or(3);
    let mut needs = vec![
        ("the daemon".to_owned(), of_daemon() + inherited),
        (format!("the world, with {robots} robots,"), of_world(robots)),
    ];
    if of_agent(robots.saturating_sub(1)) > limit
        && let Some((id, heard)) = hears_most(scenario)
    {
        needs.push((format!("robot `{id}`, which hears {heard} others,"), of_agent(heard)));
    }
    refuse(&needs, limit)
}

/// The robot that hears most others at the start, and how many; `None` where nobody hears anybody.
pub(crate) fn hears_most(scenario: &Scenario) -> Option<(String, usize)> {
    let heard = World::new(scenario).foreseen().into_iter().map(|(slot, neighbors)| (neighbors.len(), slot));
    heard.max().map(|(heard, slot)| (scenario.robots[slot].id.clone(), heard))
}

fn refuse(needs: &[(String, u64)], limit: u64) -> Result<(), Error> {
    let Some((who, need)) = needs.iter().max_by_key(|(_, need)| *need).filter(|(_, need)| *need > limit) else {
        return Ok(());
    };
    Err(Error::new(Kind::Limits, format!("open files: {who} needs {need}, the hard limit for a process is {limit}")).hint(
        format!(
            "`ulimit -n {need}` (`LimitNOFILE=` of systemd, `--ulimit nofile=` of a container); fewer robots or a smaller \
             radio_range_m need {PER_BOARD} less per robot; `--mode single` needs none"
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_needs_most_is_named() {
        let needs = [("the daemon".to_owned(), 43), ("robot `a`, which hears 9 others,".to_owned(), 70)];
        assert_eq!(refuse(&needs, 70), Ok(()));
        let failure = refuse(&needs, 69).unwrap_err();
        assert_eq!(failure.kind, Kind::Limits);
        let text = &failure.message;
        assert!(text.starts_with("open files: robot `a`, which hears 9 others, needs 70, the hard"), "{text}");
        assert!(text.ends_with("is 69") && failure.hints[0].starts_with("`ulimit -n 70`"), "{failure:?}");
    }
}
