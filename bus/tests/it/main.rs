//! The bus as its callers see it: services and boards, operators, what a fleet takes, and what only processes can show.

mod home;
mod operators;
mod processes;
mod scale;
mod services;
