//! A dora node: its inputs are the poses of all others, of which dora keeps the newest one each (`queue_size: 1`). A
//! thread blocks on the event stream. Nodes are started by dora's own command line, see the driver.

use dora_node_api::dora_core::config::DataId;
use dora_node_api::{DoraNode, Event, MetadataParameters, into_vec};
use poses::{Args, Failure, Latest, Pose, Transport};
use std::process::ExitCode;

struct Outputs {
    node: DoraNode,
    latest: Latest,
}

fn open(args: &Args) -> Result<Outputs, Failure> {
    let (node, mut events) = DoraNode::init_from_env_force()?;
    let latest = Latest::new(args.robots);
    let received = latest.clone();
    std::thread::Builder::new().name("receive".into()).spawn(move || {
        while let Some(event) = events.recv() {
            match event {
                Event::Input { data, .. } => received.receive(&into_vec::<u8>(&data).unwrap_or_default()),
                Event::Error(error) => {
                    eprintln!("error: dora: {error}");
                    std::process::exit(1);
                }
                _ => {}
            }
        }
    })?;
    Ok(Outputs { node, latest })
}

impl Transport for Outputs {
    fn publish(&mut self, pose: &Pose) -> Result<(), Failure> {
        let id = DataId::from("pose".to_owned());
        Ok(self.node.send_output_bytes(id, MetadataParameters::default(), Pose::BYTES, &pose.to_bytes())?)
    }

    fn newest(&mut self, robot: usize) -> Option<Pose> {
        self.latest.newest(robot)
    }
}

fn main() -> ExitCode {
    poses::run(open)
}
