//! What an agent's process shares with others: the gate, the boards of the world and of the robots in range, statistics.

use crate::note::Notes;
use bus::{
    Address, BusError, Gate, Lease, Node, Poses, RobotReader, RobotWriter, Sizes, StatsWriter, Strips, WorldReader,
    clock,
};
use model::{Metric, RobotIndex, RobotInstance};
use protocol::robot_to_robot::{SharedBorder, SharedPose};
use protocol::world_to_robot::{Impairment, NeighborRef, Piece};
use std::time::Duration;

/// How often a robot that hears nothing of a world looks whether its fleet is still looked after, ns.
const ORPHAN_LOOK_NS: u64 = 1_000_000_000;
/// Boards of robots that went out of range are kept open until there are this many of them: ranges are crossed back
/// and forth, and an open costs a hundred microseconds.
const SPARE_BOARDS: usize = 16;

/// Why an agent cannot use what it shares with others.
#[derive(Debug, thiserror::Error)]
pub enum PortsError {
    /// Shared memory failed it.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// It cannot hear the robot in this slot, which is there.
    #[error("{1}")]
    Deaf(RobotIndex, #[source] BusError),
}

/// Everything that this process shares with others.
pub(crate) struct Ports {
    pub(crate) gate: Gate,
    pub(crate) world: WorldReader,
    /// Whose board that is.
    world_incarnation: u32,
    /// In a fleet that is left running, whether somebody looks after it.
    custody: Option<Custody>,
    pub(crate) robot: RobotWriter,
    pub(crate) stats: StatsWriter,
    /// What it notes for a replay, if the run is recorded.
    pub(crate) notes: Option<Notes>,
    /// The robots in range, as the world last listed them.
    in_range: Vec<NeighborRef>,
    /// The robots that it will list as soon as they have spoken.
    coming: Vec<NeighborRef>,
    /// What the radio and faults do to this robot, as the world last said.
    pub(crate) impairment: Impairment,
    /// Open boards, sorted by slot; more than those in range.
    boards: Vec<(NeighborRef, RobotReader)>,
    /// The pose of each robot in range that counts at this tick.
    pub(crate) heard: Vec<(NeighborRef, SharedPose)>,
    /// Whether this robot talks about borders, and what each of them says to it about theirs.
    pub(crate) has_borders: bool,
    pub(crate) borders: Vec<SharedBorder>,
    /// Indices of what is in sight, and the pieces themselves.
    in_sight: Vec<u16>,
    pub(crate) pieces: Vec<Piece>,
    instance: RobotInstance,
    node: Node,
}

impl Ports {
    pub(crate) fn open(
        address: &Address,
        gate: Gate,
        (instance, name): (RobotInstance, &str),
        sizes: Sizes,
        poses: Poses,
        has_borders: bool,
        custody: Option<Custody>,
    ) -> Result<Ports, BusError> {
        let node = Node::new(address, &format!("agent-{}-{}", instance.index, instance.incarnation))?;
        let world_incarnation = gate.world_incarnation();
        Ok(Ports {
            gate,
            world: WorldReader::open(&node, instance.index, world_incarnation)?,
            world_incarnation,
            custody,
            instance,
            robot: RobotWriter::create_as(&node, instance, sizes, poses, has_borders)?,
            has_borders,
            stats: StatsWriter::create(
                address,
                name,
                &[Metric::PoseAge, Metric::Wake, Metric::Plan, Metric::Step],
                Strips::of_agent(sizes.max_robots),
            )?,
            notes: None,
            in_range: Vec::new(),
            coming: Vec::new(),
            impairment: Impairment::default(),
            boards: Vec::new(),
            heard: Vec::new(),
            borders: Vec::new(),
            in_sight: Vec::new(),
            pieces: Vec::new(),
            node,
        })
    }

    /// Reads the board of the world's present process: of one that was replaced, nothing new will come.
    pub(crate) fn follow_world(&mut self) -> Result<(), BusError> {
        let incarnation = self.gate.world_incarnation();
        if incarnation != self.world_incarnation {
            match WorldReader::open(&self.node, self.instance.index, incarnation) {
                Ok(world) => (self.world, self.world_incarnation) = (world, incarnation),
                // It has been replaced again.
                Err(error) if error.is_missing() => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Whether this is a process of a fleet that nobody looks after any more, and that will be cleared away.
    pub(crate) fn is_orphaned(&mut self, now_ns: u64) -> bool {
        self.custody.as_mut().is_some_and(|custody| custody.is_lost(now_ns))
    }

    /// Reads the poses of the robots in range, each from its own board: the newest before a tick, for which boards are
    /// opened at once, or the newest of those that are open.
    pub(crate) fn listen(&mut self, before: Option<u64>) -> Result<(), PortsError> {
        self.follow_list();
        self.heard.clear();
        self.borders.clear();
        for place in 0..self.in_range.len() {
            let who = self.in_range[place];
            let known = match self.board_of(who) {
                None if before.is_some() => self.open_board(who)?,
                known => known,
            };
            let Some(index) = known else { continue };
            let board = &mut self.boards[index].1;
            let pose = match before {
                Some(tick) => board.pose_before(tick),
                None => board.pose(),
            };
            if self.has_borders {
                self.borders.push(board.border(self.instance, before));
            }
            self.heard.push((who, pose));
        }
        Ok(())
    }

    /// Takes over who is in range and how well they are heard, if the world has written it again.
    pub(crate) fn follow_list(&mut self) {
        if self.world.neighbors(&mut self.in_range, &mut self.coming) {
            self.impairment = self.world.impairment();
        }
    }

    /// Opens boards of robots in range that are not open yet, until this much time has gone by, but at least one.
    pub(crate) fn open_missing(&mut self, time: Duration) -> Result<(), PortsError> {
        if self.heard.len() == self.in_range.len() {
            return Ok(());
        }
        let begun_ns = clock::now_ns();
        for place in 0..self.in_range.len() {
            let who = self.in_range[place];
            if self.board_of(who).is_none()
                && self.open_board(who)?.is_some()
                && u128::from(clock::now_ns() - begun_ns) >= time.as_nanos()
            {
                break;
            }
        }
        Ok(())
    }

    /// Opens the boards of robots that come, until this much time has gone by, but at least one. One that cannot be opened now
    /// is opened when its robot is heard.
    pub(crate) fn open_coming(&mut self, time: Duration) {
        if self.coming.is_empty() {
            return;
        }
        let begun_ns = clock::now_ns();
        for place in 0..self.coming.len() {
            let who = self.coming[place];
            if self.board_of(who).is_none()
                && matches!(self.open_board(who), Ok(Some(_)))
                && u128::from(clock::now_ns() - begun_ns) >= time.as_nanos()
            {
                break;
            }
        }
    }

    /// Opens the boards of those whom it will probably hear first, before it is ready.
    pub(crate) fn prepare(&mut self, foreseen: &[RobotInstance]) {
        self.coming.extend(foreseen.iter().map(|instance| NeighborRef::from(*instance)));
        self.open_coming(Duration::MAX);
        self.coming.clear();
    }

    /// Where among the open boards that of this robot is.
    fn board_of(&self, who: NeighborRef) -> Option<usize> {
        let found = self.boards.binary_search_by_key(&who.index, |(open, _)| open.index);
        found.ok().filter(|index| self.boards[*index].0 == who)
    }

    /// Opens the board of a robot, in place of that of an earlier life. One that died between the list and this look has
    /// no board any more: it is not heard. Boards of robots that are not in range are closed when there are too many of
    /// them, or what they take is needed.
    fn open_board(&mut self, who: NeighborRef) -> Result<Option<usize>, PortsError> {
        self.boards.retain(|(open, _)| open.index != who.index);
        if self.boards.len() >= self.in_range.len() + self.coming.len() + SPARE_BOARDS {
            self.close_spare();
        }
        let instance = RobotInstance::from(who);
        let reader = match RobotReader::open(&self.node, instance) {
            Err(error) if !error.is_missing() && self.close_spare() => RobotReader::open(&self.node, instance),
            result => result,
        };
        match reader {
            Ok(reader) => {
                let index = self.boards.partition_point(|(open, _)| open.index < who.index);
                self.boards.insert(index, (who, reader));
                Ok(Some(index))
            }
            Err(error) if error.is_missing() => Ok(None),
            Err(error) => Err(PortsError::Deaf(RobotIndex(who.index), error)),
        }
    }

    /// Closes the boards of robots that are not in range; whether there were any.
    fn close_spare(&mut self) -> bool {
        let (in_range, coming, before) = (&self.in_range, &self.coming, self.boards.len());
        self.boards.retain(|(open, _)| in_range.contains(open) || coming.contains(open));
        self.boards.len() < before
    }

    /// Reads where the pieces in sight are.
    pub(crate) fn look(&mut self) {
        self.world.sensed(&mut self.in_sight);
        self.pieces.clear();
        for index in &self.in_sight {
            self.pieces.push(self.world.piece(*index));
        }
    }
}

/// A fleet that is left running does not end with its daemon. If its world and its guardian end as well, its robots go.
pub(crate) struct Custody {
    address: Address,
    looked_ns: u64,
}

impl Custody {
    pub(crate) fn of(address: &Address) -> Custody {
        Custody { address: address.clone(), looked_ns: clock::now_ns() }
    }

    /// Looks now and then; whether nobody holds the lease of the fleet.
    fn is_lost(&mut self, now_ns: u64) -> bool {
        if now_ns.saturating_sub(self.looked_ns) < ORPHAN_LOOK_NS {
            return false;
        }
        self.looked_ns = now_ns;
        // A fleet that is not there is gone.
        Lease::is_abandoned(&self.address).unwrap_or(false) || !self.address.root().exists()
    }
}
