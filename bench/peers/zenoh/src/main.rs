//! zenoh, as its documentation says to set it up for low latency: peers, one unix stream between each two of them, no
//! scouting, the low-latency transport, express publishers that drop rather than wait. Its own threads receive, blocked
//! in the kernel, and call back; the callback keeps the newest pose of everybody.
//!
//! With the option `shm` every pose is written into zenoh's shared memory and only its place is sent. Without it zenoh's
//! shared memory is switched off in its configuration.

use poses::{Args, Failure, Latest, Pose, Transport};
use std::process::ExitCode;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Locality, Sample};
use zenoh::shm::{GarbageCollect, PosixShmProviderBackend, ShmProvider, ShmProviderBuilder};
use zenoh::{Config, Session, Wait};

/// Memory for poses on their way, bytes.
const POOL_BYTES: usize = 64 * 1024;

struct Peer {
    latest: Latest,
    pool: Option<ShmProvider<PosixShmProviderBackend>>,
    publisher: Publisher<'static>,
    _subscriber: Subscriber<()>,
    _session: Session,
}

fn config(args: &Args, shm: bool) -> Result<Config, Failure> {
    let endpoint = |robot| format!("unixsock-stream/{}", args.directory.join(format!("zenoh-{robot}")).display());
    // Everybody dials those who started before.
    let earlier: Vec<String> = (0..args.robot).map(endpoint).collect();
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"peer\"".to_owned()),
        ("listen/endpoints", format!("{:?}", [endpoint(args.robot)])),
        ("connect/endpoints", format!("{earlier:?}")),
        // Those who are not there yet are tried again after 10 ms instead of a second.
        ("connect/retry", "{ period_init_ms: 10, period_max_ms: 100, period_increase_factor: 2 }".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("open/return_conditions/connect_scouted", "false".to_owned()),
        ("open/return_conditions/declares", "false".to_owned()),
        ("transport/unicast/qos/enabled", "false".to_owned()),
        ("transport/unicast/lowlatency", "true".to_owned()),
        ("transport/shared_memory/enabled", shm.to_string()),
    ] {
        config.insert_json5(key, &value).map_err(|e| format!("zenoh: {key}: {e}"))?;
    }
    Ok(config)
}

fn open(args: &Args) -> Result<Peer, Failure> {
    let shm = args.options.iter().any(|option| option == "shm");
    let session = zenoh::open(config(args, shm)?).wait()?;
    let latest = Latest::new(args.robots);
    let received = latest.clone();
    let subscriber = session
        .declare_subscriber("pose/*")
        .allowed_origin(Locality::Remote)
        .callback(move |sample: Sample| received.receive(&sample.payload().to_bytes()))
        .wait()?;
    let publisher = session
        .declare_publisher(format!("pose/{}", args.robot))
        .allowed_destination(Locality::Remote)
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::RealTime)
        .express(true)
        .wait()?;
    let pool = if shm { Some(ShmProviderBuilder::default_backend(POOL_BYTES).wait()?) } else { None };
    Ok(Peer { latest, pool, publisher, _subscriber: subscriber, _session: session })
}

impl Transport for Peer {
    fn publish(&mut self, pose: &Pose) -> Result<(), Failure> {
        let bytes = pose.to_bytes();
        let Some(pool) = &self.pool else { return self.publisher.put(bytes).wait() };
        let mut buffer = pool.alloc(Pose::BYTES).with_policy::<GarbageCollect>().wait()?;
        buffer.as_mut().copy_from_slice(&bytes);
        self.publisher.put(buffer).wait()
    }

    fn newest(&mut self, robot: usize) -> Option<Pose> {
        self.latest.newest(robot)
    }
}

fn main() -> ExitCode {
    poses::run(open)
}
