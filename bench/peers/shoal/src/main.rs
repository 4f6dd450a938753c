//! shoal's own bus: every robot writes its pose to its board and reads everybody's from theirs, as its agents do in
//! `realtime`.
//! There is nothing to wait for on a board, so a robot looks when it uses a pose.
//!
//! With the option `hub` this program is the one that owns the fleet's address, as shoal's daemon does.

use bus::{Address, Lease, Node, Poses, RobotReader, RobotWriter, Sizes, clean};
use poses::{Args, Failure, Pose, Transport};
use model::{RobotIndex, RobotInstance};
use protocol::robot_to_robot::SharedPose;
use std::io::Read;
use std::path::Path;
use std::process::ExitCode;

/// File in the directory of a run that says where the fleet lives.
const ADDRESS: &str = "address";

struct Boards {
    node: Node,
    mine: RobotWriter,
    /// By robot, with the robots still to be opened in [`Boards::missing`].
    theirs: Vec<Option<RobotReader>>,
    missing: Vec<usize>,
}

fn instance(robot: usize) -> RobotInstance {
    RobotInstance { index: RobotIndex::of(robot), incarnation: 0 }
}

fn open(args: &Args) -> Result<Boards, Failure> {
    let root = std::fs::read_to_string(args.directory.join(ADDRESS))?;
    let node = Node::new(&Address::at(Path::new(&root))?, &format!("agent-{}-0", args.robot))?;
    let sizes = Sizes { max_robots: args.robots as u32, shape_pieces: 0 };
    Ok(Boards {
        mine: RobotWriter::create(&node, instance(args.robot), sizes, Poses::Newest)?,
        node,
        theirs: (0..args.robots).map(|_| None).collect(),
        missing: args.others().collect(),
    })
}

impl Transport for Boards {
    fn connect(&mut self) -> Result<(), Failure> {
        while let Some(&robot) = self.missing.first() {
            // Not there yet, or just being made. They start in order: the next one is not there either.
            let Ok(reader) = RobotReader::open(&self.node, instance(robot)) else { break };
            self.theirs[robot] = Some(reader);
            self.missing.remove(0);
            if self.missing.is_empty() {
                bus::process::give_back_stack();
            }
        }
        Ok(())
    }

    fn publish(&mut self, pose: &Pose) -> Result<(), Failure> {
        self.mine.pose(|told| {
            *told = SharedPose {
                tick: pose.tick,
                stamp_ns: pose.stamp_ns,
                x_m: pose.x_m,
                y_m: pose.y_m,
                yaw_rad: pose.yaw_rad,
                vx_mps: pose.vx_mps,
                vy_mps: pose.vy_mps,
                flags: SharedPose::FLAG_SPOKEN,
                ..SharedPose::default()
            };
        });
        Ok(())
    }

    fn newest(&mut self, robot: usize) -> Option<Pose> {
        let pose = self.theirs[robot].as_ref()?.pose();
        if !pose.has(SharedPose::FLAG_SPOKEN) {
            return None;
        }
        Some(Pose {
            robot: robot as u32,
            flags: pose.flags,
            tick: pose.tick,
            stamp_ns: pose.stamp_ns,
            x_m: pose.x_m,
            y_m: pose.y_m,
            yaw_rad: pose.yaw_rad,
            vx_mps: pose.vx_mps,
            vy_mps: pose.vy_mps,
        })
    }
}

/// Owns a fleet's address until its standard input ends, and removes everything then.
fn hub(directory: &Path) -> Result<(), Failure> {
    let address = Address::create()?;
    let lease = Lease::take(&address)?;
    let draft = directory.join(".address");
    std::fs::write(&draft, address.root().as_os_str().as_encoded_bytes())?;
    std::fs::rename(&draft, directory.join(ADDRESS))?;
    std::io::stdin().read_to_end(&mut Vec::new())?;
    clean::sweep(&address);
    drop(lease);
    Ok(())
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [verb, directory] = words.as_slice() else { return poses::run(open) };
    if verb != "hub" {
        return poses::run(open);
    }
    match hub(Path::new(directory)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: hub: {failure}");
            ExitCode::FAILURE
        }
    }
}
