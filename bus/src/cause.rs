//! Why periods were late.

/// Why a period was late.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// The process was ready and had no processor.
    Scheduler,
    /// The planner took longer than its share.
    Planner,
    /// The world's own tick took longer than its share.
    World,
    /// The odometry was old: the world was late.
    Input,
    /// None of these: time stolen from the whole machine, or a late timer.
    Neither,
}

impl Cause {
    /// All of them, in the order of reports.
    pub const ALL: [Cause; 5] = [Cause::Scheduler, Cause::Planner, Cause::World, Cause::Input, Cause::Neither];

    /// The word for tables.
    pub fn word(self) -> &'static str {
        match self {
            Cause::Scheduler => "scheduler",
            Cause::Planner => "planner",
            Cause::World => "world",
            Cause::Input => "input",
            Cause::Neither => "neither",
        }
    }
}
