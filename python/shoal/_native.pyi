"""The native part. `shoal` exports what users need of it; arrays are new ones each time they are asked for."""

from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str

class Limits:
    """What a body can do."""

    @property
    def speed_mps_max(self) -> float:
        """Greatest speed, m/s; of an arm, that of its tip."""
    @property
    def reverse_mps_max(self) -> float:
        """Greatest reverse speed of a unicycle or a diff-drive, m/s; zero: it cannot drive backwards."""
    @property
    def turning_radius_m_min(self) -> float:
        """Smallest turning radius of a unicycle, m; zero: it can turn where it stands."""
    @property
    def turn_radps_max(self) -> float:
        """Greatest turn rate, and of an arm the greatest rate of each joint, rad/s."""
    @property
    def accel_mps2_max(self) -> float:
        """Greatest change of speed (unicycle) or of velocity (point), m/s²."""
    @property
    def turn_accel_radps2_max(self) -> float:
        """Greatest change of the turn rate, rad/s²."""

class Robot:
    """What is known of a robot from the beginning: the argument of a planner's constructor."""

    @property
    def name(self) -> str:
        """Its name."""
    @property
    def index(self) -> int:
        """Its index in the fleet, from 0."""
    @property
    def incarnation(self) -> int:
        """How often its process was started before."""
    @property
    def kind(self) -> str:
        """How its body moves: ``point``, ``unicycle``, ``diff-drive`` or ``two-link-arm``."""
    @property
    def radius_m(self) -> float:
        """Body radius, m."""
    @property
    def limits(self) -> Limits:
        """What its body can do."""
    @property
    def seed(self) -> int:
        """Seed of the run."""
    @property
    def dt_s(self) -> float:
        """Length of a tick, s."""
    @property
    def planner(self) -> str:
        """The planner that the scenario names for it."""
    @property
    def params(self) -> Dict[str, Any]:
        """The parameters that the scenario gives for that planner."""
    @property
    def map(self) -> Obstacles:
        """The fixed obstacles and all walls of the world, if the robot knows the map (``knows_map``)."""
    @property
    def random(self) -> np.random.Generator:
        """Its stream of random numbers; see :attr:`View.random`."""

class Obstacles:
    """Obstacles, with a row for each collider: a capsule from ``a`` to ``b`` with a radius. A disc has ``a == b``; the edges of
    a polygon share their ``id``."""

    def __len__(self) -> int: ...
    @property
    def id(self) -> NDArray[np.uint32]:
        """Names the obstacle: the edges of one polygon share it, each wall of a map has its own. Shape (n,)."""
    @property
    def a(self) -> NDArray[np.float64]:
        """One end of the core, m. Shape (n, 2)."""
    @property
    def b(self) -> NDArray[np.float64]:
        """The other end, m. Shape (n, 2)."""
    @property
    def radius_m(self) -> NDArray[np.float64]:
        """Distance from the core to the surface, m. Shape (n,)."""
    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity, m/s. Shape (n, 2)."""

class Neighbors:
    """The robots that are heard on the radio, as their newest messages describe them, with a row for each, by index."""

    def __len__(self) -> int: ...
    @property
    def id(self) -> NDArray[np.uint32]:
        """Index of the robot in the fleet. Shape (n,)."""
    @property
    def position(self) -> NDArray[np.float64]:
        """Position when it spoke, m. Shape (n, 2)."""
    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity when it spoke, m/s. Shape (n, 2)."""
    @property
    def yaw_rad(self) -> NDArray[np.float64]:
        """Heading when it spoke, rad. Shape (n,)."""
    @property
    def radius_m(self) -> NDArray[np.float64]:
        """Body radius, m. Shape (n,)."""
    @property
    def age_s(self) -> NDArray[np.float64]:
        """Age of the message, s: one tick in ``single`` and ``lockstep`` without radio faults. Shape (n,)."""
    @property
    def remaining_m(self) -> NDArray[np.float64]:
        """Distance to its goal, m. Shape (n,)."""
    @property
    def arrived(self) -> NDArray[np.bool_]:
        """Whether it has reached its last goal. Shape (n,)."""
    @property
    def stopped(self) -> NDArray[np.bool_]:
        """Whether it stands still on purpose. Shape (n,)."""
    @property
    def next(self) -> NDArray[np.float64]:
        """Where its command takes it within a tick after it spoke, m; NaN where it does not say. Shape (n, 2)."""

class View:
    """Everything that a planner may look at in a tick, in the world frame. It keeps its values; arrays are copies."""

    @property
    def name(self) -> str:
        """The robot's name."""
    @property
    def index(self) -> int:
        """The robot's index in the fleet, from 0."""
    @property
    def tick(self) -> int:
        """The tick that is planned, from 0 at the start of the run."""
    @property
    def time_s(self) -> float:
        """Simulated time of this tick, s."""
    @property
    def dt_s(self) -> float:
        """Length of a tick, s."""
    @property
    def position(self) -> NDArray[np.float64]:
        """Own position, m; of an arm, that of its tip. Shape (2,)."""
    @property
    def yaw_rad(self) -> float:
        """Own heading, rad. A point keeps the heading it started with."""
    @property
    def velocity(self) -> NDArray[np.float64]:
        """Own velocity, m/s. Shape (2,)."""
    @property
    def turn_radps(self) -> float:
        """Own turn rate, rad/s."""
    @property
    def radius_m(self) -> float:
        """Own body radius, m."""
    @property
    def kind(self) -> str:
        """How the body moves: ``point``, ``unicycle``, ``diff-drive`` or ``two-link-arm``."""
    @property
    def limits(self) -> Limits:
        """What the body can do."""
    @property
    def goal(self) -> NDArray[np.float64]:
        """Where the robot heads now, m. Shape (2,)."""
    @property
    def goal_tolerance_m(self) -> float:
        """The goal counts as reached within this distance, m."""
    @property
    def goal_yaw_rad(self) -> Optional[float]:
        """The heading that the robot is to have at its goal, rad; ``None`` is any. The body turns to it by itself."""
    @property
    def goal_yaw_tolerance_rad(self) -> float:
        """That heading counts as reached within this angle, rad."""
    @property
    def arrived(self) -> bool:
        """Whether the last goal has been reached."""
    @property
    def joints_rad(self) -> Optional[NDArray[np.float64]]:
        """Joint angles of an arm, the one at the base first, rad; ``None`` for other bodies. Shape (2,)."""
    @property
    def neighbors(self) -> Neighbors:
        """The robots that are heard on the radio."""
    @property
    def obstacles(self) -> Obstacles:
        """What the sensors see: obstacles, walls of the map, and the bodies of robots that are not heard."""
    @property
    def map(self) -> Obstacles:
        """The fixed obstacles and all walls of the world, if the robot knows the map (``knows_map``); the same in every tick."""
    @property
    def allowed(self) -> NDArray[np.float64]:
        """The velocities that the filter allows, as rows (nx, ny, bound): ``nx * vx + ny * vy <= bound``; without a filter there
        are no rows. Shape (n, 3)."""
    @property
    def random(self) -> np.random.Generator:
        """The robot's stream of random numbers: the same numbers for the same seed, robot and incarnation, in ``simulate`` as in
        processes, with one version of NumPy."""

class Plan:
    """An answer with more than a command."""

    def __init__(
        self, command: ArrayLike, *, wheels: bool = False, stopped: bool = False, state: str = "ready"
    ) -> None:
        """
        Args:
            command: two numbers, as a planner returns them.
            wheels: they are the rates of the left and the right wheel of a diff-drive, rad/s.
            stopped: the robot stands still on purpose; the others are told.
            state: ``ready``; ``planning``: it still looks for a plan; ``gave-up``: it found none. For the report.
        """
    @property
    def command(self) -> Tuple[float, float]: ...
    @property
    def wheels(self) -> bool: ...
    @property
    def stopped(self) -> bool: ...
    @property
    def state(self) -> str: ...

class Scenario:
    def __init__(
        self,
        name: str,
        text: str,
        lined: bool,
        folder: str,
        *,
        mode: Optional[str],
        planner: Optional[str],
        filter: Optional[str],
        robots: Optional[int],
        seed: Optional[int],
        duration_s: Optional[float],
        set: List[str],
    ) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def mode(self) -> str: ...
    @property
    def tick_hz(self) -> float: ...
    @property
    def seed(self) -> int: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def robots(self) -> List[str]: ...
    @property
    def warnings(self) -> List[Dict[str, Any]]: ...

def catalog() -> List[Tuple[str, str]]: ...
def find_catalog(name: str) -> str: ...
def load(path: str) -> Dict[str, Any]: ...
def run_agent(arguments: List[str], make: Optional[Callable[[Robot], Any]], place: str) -> None: ...
def simulate(
    scenario: Scenario, make: Optional[Callable[[Robot], Any]], trajectories: bool
) -> Dict[str, Any]: ...
