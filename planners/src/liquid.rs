//! Potential descent that leaves virtual obstacles behind, like drops of a liquid that fills a hollow until it flows on.
//!
//! B. Moaveni, D. Ghanbari Gol, "Solving the Local Minimum Problem in Path Planning Algorithm based on the Virtual
//! Potential Field and the Principles of Liquid Movement" (in Persian, 2011).
//!
//! Every round asks for the potential (10) at the own place and one step away in each of `A_nsd` directions, and steps
//! to the lowest. Where none is lower, one more hill is put up: a virtual obstacle. Two methods do this:
//!
//! - [`offline`] (`liquid`): thinks. After each virtual obstacle it starts again from where the robot stands, with all
//!   of them kept; the run that gets to the goal is the path, and only that is driven.
//! - [`online`] (`liquid-online`, the paper's "modified" variant): drives. It goes on from where it is, so all its
//!   wandering is driven, but it needs no map.
//!
//! ```text
//! field    (1)-(12): the potential, the candidates, the best of them
//! search   (13), offline: runs from the start until one arrives, in slices
//! known    what the offline robot takes to be there: the map and what it has seen standing still
//! layer    what the paper does not have: keeping clear of what moves
//! common   the parameters that both methods have
//! offline  the method `liquid`             online  the method `liquid-online`
//! ```
//!
//! | paper    | here               | unit  | default     | larger means                                              |
//! |----------|--------------------|-------|-------------|-----------------------------------------------------------|
//! | Step     | `step_m`           | m     | 0.1         | coarser paths, less thinking                              |
//! | A_nsd    | `directions`       |       | 16          | smoother paths, more thinking                             |
//! | K_O      | `k_o`              | m²    | 1           | wider around obstacles                                    |
//! | K_t      | `k_t`              | 1/m   | 35          | closer to obstacles, goals near them can be reached       |
//! | K_v      | `k_v`              | m²    | 60          | fewer virtual obstacles, longer ways, closed passages     |
//! | O_r, A_r | the bodies'        | m     |             |                                                           |
//! | V_r      | `v_r_m`            | m     | 0           | blunter virtual obstacles                                 |
//! |          | `v_r_cap_steps`    | steps | 0.5         | see below                                                 |
//! |          | `tolerance_steps`  | steps | 1           | the descent ends farther from the goal                    |
//! |          | `no_jumping`       |       | true        | see below                                                 |
//! |          | `virtual_max`      |       | 300         | gives up later                                            |
//! |          | `neighbors`        |       | true        | keeps clear of robots and of what moves; false: the paper |
//! |          | `evade_gain`       | m⁴/s  | 0.1         | wider around what moves                                   |
//! |          | `evade_range_m`    | m     | 1           | evades sooner                                             |
//! |          | `heading_gain`     | 1/s   | 3           | a unicycle turns sharper                                  |
//! |          | `rounds_max`       |       | 20000       | (offline) gives up later                                  |
//! |          | `fallbacks`        |       | 2           | (offline) tries smaller K_v, down to K_v/6 and K_v/60     |
//! |          | `rounds_per_tick`  |       | 50          | (offline) thinks for fewer, longer ticks                  |
//! |          | `replan_moving`    |       | false       | (offline) plans round what moves, again and again         |
//! |          | `lookahead_m`      | m     | 0.3         | (offline) a unicycle cuts corners more                    |
//! |          | `lifetime_s`       | s     | 5           | (online) virtual obstacles made by what moves stay longer |
//!
//! The gains are the paper's. Its lengths have no units and do not fit together (a step of 10 beside obstacles of
//! radius 1.5 jumps over them); we read the step as 10 cm and the rest in metres.
//!
//! Differs from the paper, or is not in it:
//! - (7) and (12) disagree about sine and cosine, and m = 0 .. A_nsd counts a direction twice: (12) with
//!   m = 0 .. A_nsd − 1. Ties go to the smallest m. Equal potential is a minimum.
//! - (6) is printed with another name for P_t, (2) lost its division by zero: inside or on a body P is infinite.
//! - The descent ends within `tolerance_steps` of the goal, at least Step / (2 cos(π / A_nsd)), below which it could hop
//!   around the goal for ever. From there the robot drives straight to the goal.
//! - An agent that is larger than its steps would be caught inside its own virtual obstacle, so V_r' = V_r + A_r is
//!   at most `v_r_cap_steps`; 0 is the paper's law.
//! - Bodies thinner than a step could be jumped over. The paper's bound on the step is meant to prevent this; with
//!   `no_jumping`, a step that touches such a body is not a candidate.
//! - A wall's or a polygon's distance is that of its nearest piece.
//! - Other robots and what moves: see [`layer`]. Robots that have arrived count as obstacles.
//! - An arm stays where it is: these are methods for robots in the plane.
//!
//! Known limits: it is not complete. Virtual obstacles reach far, lift goal and doorways too, and can close the last
//! passage (`liquid_clogged`); online it may swing for ever (`liquid_u_resonance`).

pub mod common;
pub mod field;
pub mod known;
pub mod layer;
pub mod offline;
pub mod online;
pub mod search;

pub use field::{Candidate, Field, Law};
pub use offline::Liquid;
pub use online::LiquidOnline;
pub use search::{Budget, Progress, Search};
