//! Everything that a fleet shares, made once, by the daemon, before anything else is started.

use crate::board::Board;
use crate::frames::{self, FrameService};
use crate::node::Node;
use crate::{Result, Sizes, control, world_board};

/// Keeps the fleet's services alive. iceoryx2 removes a service when the last one who has it open lets go of it.
pub struct Services {
    _world: Board,
    _frames: FrameService,
}

impl Services {
    /// Makes the world's board, the frames, orders and notices. The gate is made by
    /// [`Gate::create`](crate::Gate::create), the boards of robots by the robots.
    ///
    /// # Errors
    /// When they exist already, or do not fit ([`Sizes::check_space`]).
    pub fn create(node: &Node, sizes: Sizes) -> Result<Services> {
        sizes.check_space(node.address())?;
        sizes.store(node.address())?;
        control::create(node.address())?;
        Ok(Services { _world: world_board::create(node, sizes)?, _frames: frames::create(node)? })
    }
}
