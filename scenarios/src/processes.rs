//! How the processes of a fleet are scheduled, and what they may use. Whether a machine allows it is for the daemon to find out.

use crate::node::Node;
use crate::problems::Report;
use crate::table::{self, AgentLimits, Root, Scheduling as Keys};
use model::{Class, ClassName, ProcessLimits, Processes, Scheduling};

/// Reads `[processes]`.
pub(crate) fn read(root: &Node, report: &mut Report) -> Processes {
    let node = root.node(Root::processes);
    let mut of =
        |whose| node.and_then(|node| node.node(whose)).map_or_else(Scheduling::default, |node| one(node, report));
    let (world, agents) = (of(table::Processes::world), of(table::Processes::agents));
    let agent_limits = node.and_then(|node| node.node(table::Processes::agents)).map(|node| ProcessLimits {
        memory_mib: node.get(AgentLimits::memory_mib_max),
        files: node.get(AgentLimits::files_max),
    });
    Processes { world, agents, agent_limits: agent_limits.unwrap_or_default() }
}

fn one(node: &Node, report: &mut Report) -> Scheduling {
    let mut cpus = node.get(Keys::cpus).unwrap_or_default();
    cpus.sort_unstable();
    let priority = node.get(Keys::priority).unwrap_or(1);
    let class = node.get(Keys::scheduling).map(|class| match class {
        ClassName::Other => Class::Other,
        ClassName::Batch => Class::Batch,
        ClassName::Fifo => Class::Fifo { priority },
        ClassName::Rr => Class::Rr { priority },
    });
    if node.has(Keys::priority) && !node.is_wrong(Keys::scheduling) && class.and_then(Class::priority).is_none() {
        let message = match class {
            Some(class) => format!("does not go with scheduling = \"{}\"", class.word()),
            None => "does not go without scheduling".to_string(),
        };
        let hint = "only the real-time classes have a priority: scheduling = \"fifo\" or \"rr\"";
        report.add_hint(node.at(Keys::priority), &node.key(Keys::priority), message, hint);
    }
    Scheduling { cpus, class }
}
