//! The words of the gate, for docs/agent-protocol.md.

use super::*;

/// Name, offset, bytes, meaning. Words of a slot begin with `slot.`, and count from the beginning of the slot.
pub(crate) fn words() -> Vec<(&'static str, usize, usize, &'static str)> {
    vec![
        ("magic", 0, 8, "`shoalGt1`: written last when the gate is made"),
        ("max_robots", MAX_ROBOTS, 4, "number of slots"),
        ("turn", TURN, 4, "futex: agents sleep on it; changes with every tick, the rendezvous, the start and the stop"),
        ("stop", STOP, 4, "1: the run is over"),
        ("tick", TICK, 8, "the open tick plus one; 0 before the first"),
        ("stamp_even", STAMPS[0], 8, "when the newest even tick was opened, monotonic clock, ns"),
        ("stamp_odd", STAMPS[1], 8, "when the newest odd tick was opened, monotonic clock, ns"),
        ("start", START, 8, "time base of `realtime`, monotonic clock, ns; 0 before it is known"),
        ("over", OVER, 4, "1: the last tick is over, and nothing counts any more"),
        ("meeting", MEETING, 4, "1: agents of `realtime` may open the boards of those whom they will hear"),
        ("world", WORLD, 4, "incarnation of the world whose board counts"),
        ("paused", PAUSED, 4, "1: no tick opens without an operator"),
        ("rate", RATE, 8, "bits of the factor of real time, a double; 0: as fast as possible"),
        (
            "counter",
            COUNTER,
            8,
            "upper half: lower half of the open tick; bit 31: ring for every answer; below: answers that are missing",
        ),
        ("bell", BELL, 4, "futex: the world sleeps on it"),
        ("calls", CALLS, 4, "counts calls of the world"),
        ("progress", PROGRESS, 32, "tick; robots and arrived (32 bits each); contacts; stamp, ns: for observers"),
        ("slots", SLOTS, SLOT_SIZE, "one line of 64 bytes for each robot, by index"),
        ("slot.ready", READY, 8, "incarnation that is ready, plus one"),
        ("slot.answer", ANSWER, 8, "upper half: incarnation; lower half: lower half of the tick that is answered"),
        ("slot.signs", SIGNS, 8, "counts signs of life of an agent that no tick waits for"),
        (
            "slot.heard",
            HEARD,
            8,
            "incarnation (32 bits), version of the list of neighbours (16), neighbours heard (16)",
        ),
        ("slot.met", MET, 8, "incarnation that has opened the boards of its neighbours, plus one"),
        ("slot.process", PROCESS, 8, "upper half: incarnation; lower half: process id of the agent"),
        ("slot.deaf", DEAF, 8, "upper half: incarnation plus one; lower half: index of the robot that cannot be heard"),
    ]
}
