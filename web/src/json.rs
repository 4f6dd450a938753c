//! Frames as the page reads them: lists of numbers, short because there are many.

use model::Event;
use serde_json::{Value, json};
use std::fmt::Write;
use watch::Frame;

/// An entry of the log, with the name of its robot and more about it for people.
pub(crate) fn event(event: &Event, robot: Option<&str>, detail: &str, tick_hz: f64) -> Value {
    let Event { tick, robot: slot, kind } = event;
    let at_m = kind.touch().map(|touch| touch.at_m);
    let time_s = *tick as f64 / tick_hz;
    json!({ "tick": tick, "time_s": time_s, "slot": slot, "robot": robot, "kind": kind.name(), "detail": detail, "at_m": at_m })
}

/// A frame: `{"tick", "time_s", "arrived", "contacts", "bodies": [[index, flags, x, y, yaw, goal x, goal y, joint 1, joint 2]],
/// "intents": [[index, pull x, pull y, push x, push y, command x, command y]]}`. Lengths in m to the millimetre, angles in rad. A body
/// has as many numbers as it needs: an obstacle four, a point five, with a goal seven, an arm nine. A command that is not known is null.
pub(crate) fn frame(frame: &Frame) -> String {
    let mut out = String::with_capacity(64 + 48 * frame.bodies.len());
    let Frame { tick, time_s, arrived, contacts, .. } = frame;
    let head = format!("\"tick\":{tick},\"time_s\":{time_s:.4},\"arrived\":{arrived},\"contacts\":{contacts}");
    let _ = write!(out, "{{{head},\"bodies\":[");
    for (i, body) in frame.bodies.iter().enumerate() {
        let comma = if i > 0 { "," } else { "" };
        let _ = write!(out, "{comma}[{},{}", body.index, body.flags);
        let [x, y] = body.position_m;
        for value in [x, y].into_iter().chain((!body.is_obstacle()).then_some(body.yaw_rad)) {
            number(&mut out, value);
        }
        let is_arm = body.joints_rad != [0.0; 2];
        if body.goal_m.is_some() || is_arm {
            body.goal_m.unwrap_or(body.position_m).into_iter().for_each(|value| number(&mut out, value));
        }
        if is_arm {
            body.joints_rad.into_iter().for_each(|value| number(&mut out, value));
        }
        out.push(']');
    }
    out.push_str("],\"intents\":[");
    let told =
        frame.bodies.iter().filter(|body| body.pull != [0.0; 2] || body.push != [0.0; 2] || body.command_mps.is_some());
    for (i, body) in told.enumerate() {
        let comma = if i > 0 { "," } else { "" };
        let _ = write!(out, "{comma}[{}", body.index);
        let terms = body.pull.into_iter().chain(body.push).map(f64::from);
        terms.chain(body.command_mps.unwrap_or([f64::NAN; 2])).for_each(|value| number(&mut out, value));
        out.push(']');
    }
    out.push_str("]}");
    out
}

/// A comma and a number; what is no number is null.
fn number(out: &mut String, value: f64) {
    out.push(',');
    if !value.is_finite() {
        out.push_str("null");
        return;
    }
    let from = out.len();
    let _ = write!(out, "{value:.3}");
    let short = out.trim_end_matches('0').trim_end_matches('.').len();
    out.truncate(short);
    if &out[from..] == "-0" {
        out.replace_range(from.., "0");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::world_to_observer::FrameBody;
    use watch::Body;

    #[test]
    fn a_frame_is_short_and_can_be_read() {
        let point = Body { index: 3, flags: 2, position_m: [1.0, -0.0001], yaw_rad: 0.12345, ..Body::default() };
        let heads = Body { goal_m: Some([100.0, -2.5]), pull: [0.5, 0.0], ..point };
        let arm = Body { joints_rad: [0.1, f64::NAN], ..point };
        let thing = Body { index: 1, flags: FrameBody::FLAG_OBSTACLE, position_m: [7.0, 8.25], ..Body::default() };
        let bodies = vec![point, heads, arm, thing];
        let text = frame(&Frame { tick: 50, time_s: 1.0, arrived: 1, contacts: 2, bodies });
        let head = r#"{"tick":50,"time_s":1.0000,"arrived":1,"contacts":2,"#;
        let bodies =
            r#""bodies":[[3,2,1,0,0.123],[3,2,1,0,0.123,100,-2.5],[3,2,1,0,0.123,1,0,0.1,null],[1,1,7,8.25]],"#;
        let intents = r#""intents":[[3,0.5,0,0,0,null,null]]}"#;
        assert_eq!(text, [head, bodies, intents].concat());
        assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok());
        let none = frame(&Frame::default());
        assert!(serde_json::from_str::<serde_json::Value>(&none).unwrap()["bodies"].as_array().unwrap().is_empty());
    }
}
