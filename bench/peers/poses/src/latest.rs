//! For transports that deliver: the newest pose of everybody, between the thread that receives and the loop that uses.

use crate::Pose;
use std::sync::{Arc, Mutex, PoisonError};

/// A place for the newest pose of every robot. Clones share it.
#[derive(Clone, Debug)]
pub struct Latest(Arc<[Mutex<Option<Pose>>]>);

impl Latest {
    /// Places for this many robots.
    pub fn new(robots: usize) -> Latest {
        Latest((0..robots).map(|_| Mutex::new(None)).collect())
    }

    /// A pose has come, as bytes. The process ends if they are no pose of this fleet: there is nothing to measure then.
    pub fn receive(&self, bytes: &[u8]) {
        let pose = Pose::from_bytes(bytes);
        let Some((pose, place)) = pose.and_then(|pose| Some((pose, self.0.get(pose.robot as usize)?))) else {
            eprintln!("error: received {} bytes that are no pose of this fleet", bytes.len());
            std::process::exit(1);
        };
        *place.lock().unwrap_or_else(PoisonError::into_inner) = Some(pose);
    }

    /// The newest pose of a robot.
    pub fn newest(&self, robot: usize) -> Option<Pose> {
        *self.0[robot].lock().unwrap_or_else(PoisonError::into_inner)
    }
}
