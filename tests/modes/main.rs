//! The clock modes against each other: the real processes of `lockstep` drive to the last bit as `single` does in one
//! thread, on one processor or many, busy or idle; and every mode reports what the contract says, truthfully.

mod hashes;
mod live;
mod load;
mod maps;
mod records;
mod replays;
mod report;
mod support;
mod ways;
