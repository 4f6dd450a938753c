//! What stands in docs/agent-protocol.md of layouts is what the code has, and a change of either is a new version of the page.

use crate::gate::layout::words;
use crate::world_board::Told;
use iceoryx2::prelude::ZeroCopySend;
use protocol::AGENT_PROTOCOL;
use protocol::robot_to_robot::{SharedBorder, SharedBorders, SharedIntent, SharedPose};
use protocol::robot_to_world::Command;
use protocol::world_to_robot::{Impairment, NeighborList, NeighborRef, Odometry, Piece, SensedList};
use std::any::type_name_of_val;
use std::fmt::Write;
use std::mem::offset_of;
use std::path::Path;

const BEGIN: &str = "<!-- layouts: written by the test `layout` of crate bus -->\n";
const END: &str = "<!-- end of layouts -->\n";

/// A message: its fields with their offsets, none left out.
macro_rules! message {
    ($page:expr, $type:ident from $value:expr; $($field:ident)+) => {{
        let value: $type = $value;
        let fields = [$((stringify!($field), offset_of!($type, $field), size_of_val(&value.$field), type_name_of_val(&value.$field))),+];
        // SAFETY: it only says a name.
        let name = unsafe { <$type as ZeroCopySend>::type_name() };
        let _ = writeln!($page, "\n`{name}`, {} bytes:\n\n| field | at | bytes | type |\n|---|---|---|---|", size_of::<$type>());
        let mut next = 0;
        for (field, at, bytes, of) in fields {
            assert_eq!(at, next, "{name}: a field before `{field}` is missing in this test");
            let _ = writeln!($page, "| `{field}` | {at} | {bytes} | `{}` |", short(of));
            next = at + bytes;
        }
        assert_eq!(next, size_of::<$type>(), "{name}: the last fields are missing in this test");
    }};
}

/// A type without its path.
fn short(of: &str) -> String {
    let last = of.rsplit("::").next().unwrap_or(of);
    if of.starts_with('[') && last != of { format!("[{last}") } else { last.to_owned() }
}

/// The tables of the page.
fn tables() -> String {
    let mut page = String::from("\n### The gate\n\n| word | at | bytes | meaning |\n|---|---|---|---|\n");
    for (name, at, bytes, meaning) in words() {
        let _ = writeln!(page, "| `{name}` | {at} | {bytes} | {meaning} |");
    }
    page += "\n### Entries of the world's board\n";
    message!(page, Told from Told::default(); odometry neighbors_written sensed_written);
    message!(page, Odometry from Odometry::default(); tick stamp_ns x_m y_m yaw_rad vx_mps vy_mps turn_radps joints_rad
        goal_x_m goal_y_m goal_yaw_rad incarnation goals_done goals_left flags);
    message!(page, NeighborList from NeighborList::EMPTY; len coming entries);
    message!(page, NeighborRef from NeighborRef::default(); index incarnation);
    message!(page, SensedList from SensedList::EMPTY; len reserved pieces);
    message!(page, Piece from Piece::default(); ax_m ay_m bx_m by_m radius_m vx_mps vy_mps obstacle robot);
    message!(page, Impairment from Impairment::default(); drop noise_m delay_ticks slow_us);
    page += "\n### Entries of a robot's board\n";
    message!(page, SharedPose from SharedPose::default(); tick stamp_ns x_m y_m yaw_rad vx_mps vy_mps radius_m joints_rad
        remaining_m next_x_m next_y_m far_x_m far_y_m spare_m brake_m intent pull push flags speed_mps_max);
    message!(page, SharedIntent from SharedIntent::default(); wish_x_mps wish_y_mps left_m rank corner_x_m corner_y_m slow lag);
    message!(page, Command from Command::default(); tick stamp_ns odometry_stamp_ns form incarnation first second plan hold_ticks
        filtered reserved);
    message!(page, SharedBorders from SharedBorders::default(); tick borders);
    message!(page, SharedBorder from SharedBorder::default(); number normal_x normal_y offset_m robot incarnation form heard_after);
    page += "\n### Flags and forms\n\n| of | values |\n|---|---|\n";
    let mut flags = |of: &str, values: &[(u32, &str)]| {
        let values: Vec<String> = values.iter().map(|(value, name)| format!("{value} {name}")).collect();
        let _ = writeln!(page, "| {of} | {} |", values.join(", "));
    };
    flags(
        "`Odometry`",
        &[
            (Odometry::FLAG_PRESENT, "PRESENT"),
            (Odometry::FLAG_ARRIVED, "ARRIVED"),
            (Odometry::FLAG_LEFT, "LEFT"),
            (Odometry::FLAG_GOAL_YAW, "GOAL_YAW"),
        ],
    );
    flags(
        "`SharedPose`",
        &[
            (SharedPose::FLAG_ARRIVED, "ARRIVED"),
            (SharedPose::FLAG_STOPPED, "STOPPED"),
            (SharedPose::FLAG_SPOKEN, "SPOKEN"),
            (SharedPose::FLAG_NEXT, "NEXT"),
            (SharedPose::FLAG_INTENT, "INTENT"),
            (SharedPose::FLAG_CORNER, "CORNER"),
            (SharedPose::FLAG_PROMISE, "PROMISE"),
            (SharedPose::FLAG_YIELDS, "YIELDS"),
        ],
    );
    flags(
        "`Command`, `form`",
        &[
            (Command::FORM_NONE, "none"),
            (Command::FORM_VELOCITY, "velocity"),
            (Command::FORM_TWIST, "twist"),
            (Command::FORM_JOINTS, "joints"),
            (Command::FORM_WHEELS, "wheels"),
        ],
    );
    flags(
        "`Command`, `plan`",
        &[(Command::PLAN_READY, "ready"), (Command::PLAN_PLANNING, "planning"), (Command::PLAN_GAVE_UP, "gave up")],
    );
    flags(
        "`SharedBorder`, `form`",
        &[
            (SharedBorder::FORM_NONE, "none"),
            (SharedBorder::FORM_LINE, "line"),
            (SharedBorder::FORM_APART, "apart"),
            (SharedBorder::FORM_ACCEPTED, "accepted"),
        ],
    );
    page.push('\n');
    page
}

/// FNV-1a, 32 bits.
fn checksum(text: &str) -> u32 {
    text.bytes().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

#[test]
#[expect(clippy::disallowed_methods, reason = "it reads and writes a page")]
fn the_page_has_the_layouts_of_the_code_and_a_change_is_a_new_version() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/agent-protocol.md");
    let mut page = std::fs::read_to_string(&path).expect("the page is there");
    let tables = tables();
    let between = |page: &str| -> (usize, usize) {
        let begin = page.find(BEGIN).expect("the page says where the layouts begin") + BEGIN.len();
        (begin, page.find(END).expect("the page says where the layouts end"))
    };
    if std::env::var_os("UPDATE_DOCS").is_some() {
        let (begin, end) = between(&page);
        page.replace_range(begin..end, &tables);
        std::fs::write(&path, &page).expect("the page can be written");
    }
    let (begin, end) = between(&page);
    assert!(
        page[begin..end] == tables,
        "docs/agent-protocol.md has other layouts: UPDATE_DOCS=1 cargo test writes them"
    );
    // The list of versions keeps a checksum of the layouts of each: the tables cannot change under one version.
    let row = format!("| {AGENT_PROTOCOL} | `{:08x}` |", checksum(&tables));
    assert!(
        page.contains(&row),
        "the layouts have changed: raise protocol::AGENT_PROTOCOL, and add the row `{row}` and what changed to \
         docs/agent-protocol.md"
    );
    assert!(page.contains(&format!("**Version {AGENT_PROTOCOL}**")), "the page says another version");
}
