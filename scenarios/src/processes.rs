//! How the processes of a fleet are scheduled. Whether a machine allows it is for the daemon to find out.

use crate::node::{Node, Value};
use crate::problems::Report;
use model::{Class, Processes, Scheduling};

/// Reads `[processes]`.
pub(crate) fn read(root: &Node, report: &mut Report) -> Processes {
    let node = root.node("processes");
    let mut of =
        |whose: &str| node.and_then(|node| node.node(whose)).map_or_else(Scheduling::default, |node| one(node, report));
    Processes { world: of("world"), agents: of("agents") }
}

fn one(node: &Node, report: &mut Report) -> Scheduling {
    let mut cpus = node.numbers("cpus").to_vec();
    cpus.sort_unstable();
    let priority = node.int("priority").map_or(1, |priority| priority as u8);
    let class = match node.text("scheduling") {
        Some("other") => Some(Class::Other),
        Some("batch") => Some(Class::Batch),
        Some("fifo") => Some(Class::Fifo { priority }),
        Some("rr") => Some(Class::Rr { priority }),
        _ => None,
    };
    let unread = matches!(node.value("scheduling"), Some(Value::Wrong));
    if node.has("priority") && !unread && class.and_then(Class::priority).is_none() {
        let message = match class {
            Some(class) => format!("does not go with scheduling = \"{}\"", class.word()),
            None => "does not go without scheduling".to_string(),
        };
        let hint = "only the real-time classes have a priority: scheduling = \"fifo\" or \"rr\"";
        report.add_hint(node.at("priority"), &node.key("priority"), message, hint);
    }
    Scheduling { cpus, class }
}
