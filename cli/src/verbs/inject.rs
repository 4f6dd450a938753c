//! `shoal inject`: something is done to a robot of a running fleet.

use super::{fleet, unknown};
use crate::args::{Format, InjectArgs, InjectVerb, LastingArgs};
use crate::exit::Failure;
use crate::out;
use model::Fault;
use protocol::operator_to_daemon::{Reply, Request};
use serde_json::{Value, json};

/// Does it. When this returns the world has done it.
///
/// # Errors
/// When no fleet is running, its daemon does not answer or refuses, or there is no such fault.
pub fn run(verb: &InjectVerb) -> Result<(), Failure> {
    let lasting = |options: &'_ LastingArgs, fault| inject(&options.target, fault, options.for_s);
    match verb {
        InjectVerb::Kill(target) => inject(target, Fault::Kill, None),
        InjectVerb::Resume(target) => inject(target, Fault::Resume, None),
        InjectVerb::Pause(options) => lasting(options, Fault::Pause),
        InjectVerb::Mute(options) => lasting(options, Fault::Mute),
        InjectVerb::Delay(options) => lasting(&options.lasting, Fault::Delay { ticks: options.ticks }),
        InjectVerb::Drop(options) => lasting(&options.lasting, Fault::Drop { share: options.share }),
        InjectVerb::Noise(options) => lasting(&options.lasting, Fault::Noise { sigma_m: options.sigma }),
        InjectVerb::SlowCpu(options) => lasting(&options.lasting, Fault::SlowCpu { ms: options.ms }),
        InjectVerb::Other(words) => Err(unknown::refuse_inject(words)),
    }
}

fn inject(target: &InjectArgs, fault: Fault, for_s: Option<f64>) -> Result<(), Failure> {
    let address = fleet::choose(&target.fleet)?;
    let request = Request::Inject { robot: target.robot.clone(), fault, for_s };
    match fleet::ask(&address, &request)? {
        Reply::Injected { ticks } => match target.format {
            Format::Json => out::json(&in_json(address.id(), &target.robot, fault, ticks)),
            Format::Text => out::data(&in_words(&target.robot, fault, ticks)),
        },
        reply => Err(fleet::confused(&reply)),
    }
}

fn in_json(fleet: &str, robot: &str, fault: Fault, ticks: Option<u64>) -> Value {
    let mut value =
        json!({ "schema": "shoal.inject/1", "fleet": fleet, "robot": robot, "fault": fault.word(), "ticks": ticks });
    let (key, number) = match fault {
        Fault::Kill | Fault::Pause | Fault::Resume | Fault::Mute => return value,
        Fault::Delay { ticks } => ("delay_ticks", json!(ticks)),
        Fault::Drop { share } => ("drop", json!(share)),
        Fault::Noise { sigma_m } => ("noise_m", json!(sigma_m)),
        Fault::SlowCpu { ms } => ("slow_ms", json!(ms)),
    };
    value[key] = number;
    value
}

fn in_words(robot: &str, fault: Fault, ticks: Option<u64>) -> String {
    let until = match ticks {
        _ if !fault.lasts() => String::new(),
        Some(ticks) => format!(", for {ticks} ticks"),
        None => ", until resumed".to_owned(),
    };
    format!("robot `{robot}`: {fault}{until}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_done_in_words_and_in_json() {
        assert_eq!(in_words("r03", Fault::Kill, None), "robot `r03`: kill\n");
        assert_eq!(in_words("r03", Fault::Pause, None), "robot `r03`: pause, until resumed\n");
        let drop = Fault::Drop { share: 0.3 };
        assert_eq!(in_words("r03", drop, Some(125)), "robot `r03`: drop of 0.3, for 125 ticks\n");
        let expected = json!({
            "schema": "shoal.inject/1", "fleet": "abcd234", "robot": "r03", "fault": "drop", "ticks": 125, "drop": 0.3,
        });
        assert_eq!(in_json("abcd234", "r03", drop, Some(125)), expected);
    }
}
