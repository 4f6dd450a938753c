//! Plain iceoryx2 publish-subscribe: one service per robot, one publisher, everybody else subscribes, and only the newest
//! sample is kept. There is nothing to wait on in publish-subscribe, so a robot looks when it uses a pose.
//!
//! As in shoal, clean-up of dead nodes is off (it makes a start quadratic) and the root is on tmpfs.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use poses::{Args, Failure, Pose, Transport};
use std::process::ExitCode;

type Bytes = [u8; Pose::BYTES];

struct Ports {
    robots: usize,
    node: Node<ipc::Service>,
    publisher: Publisher<ipc::Service, Bytes, ()>,
    /// By robot; its own place stays empty.
    heard: Vec<Heard>,
    me: usize,
}

/// Another robot.
#[derive(Default)]
struct Heard {
    subscriber: Option<Subscriber<ipc::Service, Bytes, ()>>,
    newest: Option<Pose>,
}

fn service(
    node: &Node<ipc::Service>,
    robot: usize,
    robots: usize,
) -> Result<PortFactory<ipc::Service, Bytes, ()>, Failure> {
    let builder = node.service_builder(&ServiceName::new(&format!("pose/{robot}"))?).publish_subscribe::<Bytes>();
    let builder = builder.max_publishers(1).max_subscribers(robots).max_nodes(robots + 1);
    Ok(builder.subscriber_max_buffer_size(1).subscriber_max_borrowed_samples(1).open_or_create()?)
}

fn open(args: &Args) -> Result<Ports, Failure> {
    set_log_level(LogLevel::Error);
    let mut config = Config::default();
    config.global.prefix = FileName::new(args.prefix().as_bytes())?;
    config.global.set_root_path(&Path::new(args.directory.join("iceoryx2").as_os_str().as_encoded_bytes())?);
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    let node = NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<ipc::Service>()?;
    let publisher = service(&node, args.robot, args.robots)?.publisher_builder().max_loaned_samples(1).create()?;
    let heard = (0..args.robots).map(|_| Heard::default()).collect();
    Ok(Ports { robots: args.robots, node, publisher, heard, me: args.robot })
}

impl Transport for Ports {
    fn connect(&mut self) -> Result<(), Failure> {
        for robot in (0..self.robots).filter(|robot| *robot != self.me) {
            if self.heard[robot].subscriber.is_none() {
                let service = service(&self.node, robot, self.robots)?;
                self.heard[robot].subscriber = Some(service.subscriber_builder().create()?);
            }
        }
        Ok(())
    }

    fn publish(&mut self, pose: &Pose) -> Result<(), Failure> {
        self.publisher.loan_uninit()?.write_payload(pose.to_bytes()).send()?;
        Ok(())
    }

    fn newest(&mut self, robot: usize) -> Option<Pose> {
        let Heard { subscriber, newest } = &mut self.heard[robot];
        while let Some(sample) = subscriber.as_ref()?.receive().ok()? {
            *newest = Pose::from_bytes(sample.payload());
        }
        *newest
    }
}

fn main() -> ExitCode {
    poses::run(open)
}
