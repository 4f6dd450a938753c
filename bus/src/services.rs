//! Everything that a fleet shares, made once, by the daemon, before anything else is started.

use crate::board::Board;
use crate::frames::{self, FrameService};
use crate::node::Node;
use crate::{Result, Sizes, control, world_board};

/// Keeps the fleet's services alive. iceoryx2 removes a service when the last one who has it open lets go of it.
pub struct Services {
    _world: Board,
    _frames: FrameService,
    sizes: Sizes,
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
        Services::for_world(node, sizes, 0)
    }

    /// Opens what an earlier daemon has made, for this incarnation of the world.
    ///
    /// # Errors
    /// When it is not there.
    pub fn open(node: &Node, incarnation: u32) -> Result<Services> {
        let (world, frames) = (world_board::open(node, incarnation)?, frames::open(node, incarnation)?);
        Ok(Services { _world: world, _frames: frames, sizes: Sizes::of(node.address())? })
    }

    /// Makes a board and frames for the next incarnation of the world. Those of the one before are removed when the last
    /// robot has let go of them.
    ///
    /// # Errors
    /// When they do not fit.
    pub fn renew(&mut self, node: &Node, incarnation: u32) -> Result<()> {
        *self = Services::for_world(node, self.sizes, incarnation)?;
        Ok(())
    }

    fn for_world(node: &Node, sizes: Sizes, incarnation: u32) -> Result<Services> {
        let world = world_board::create(node, sizes, incarnation)?;
        Ok(Services { _world: world, _frames: frames::create(node, incarnation)?, sizes })
    }
}
