//! Diff-drives: their wheels, and the limits of the body that follow from them.

use crate::layers::Layered;
use crate::node::Node;
use crate::problems::Report;
use crate::table::{Body, Mobile, WheelKeys};
use model::key::Key;
use model::{BodyKind, Limits, Wheels};

/// A limit may exceed what the wheels give by this share: people round.
const ROUNDING: f64 = 1e-3;

/// The wheels that these layers describe.
pub(crate) fn wheels(body: &Layered<'_>) -> Wheels {
    Wheels {
        radius_m: body.get(WheelKeys::wheel_radius_m),
        track_m: body.get(WheelKeys::track_m),
        speed_radps_max: body.get(WheelKeys::wheel_radps_max),
        accel_radps2_max: body.get(WheelKeys::wheel_accel_radps2_max),
        torque_nm_max: body.get(WheelKeys::wheel_torque_nm_max),
    }
}

/// What a body on these wheels can do: what they give it, unless a layer asks for less. Reports a layer that asks for more.
pub(crate) fn limits(body: &Layered<'_>, wheels: &Wheels, report: &mut Report) -> Limits {
    let most = wheels.limits();
    let mut asked = |key: Key<f64>, most: f64, unit: &str, by: &str| {
        let layer = body.layer(key)?;
        let value = layer.get(key);
        let sure = body.0.iter().all(|layer| WheelKeys::KEYS.iter().all(|key| !layer.is_wrong(key)));
        if value > most * (1.0 + ROUNDING) && sure && !layer.is_wrong(key) {
            let message = format!("{value} {unit} is more than the wheels of a diff-drive give it, {most:.3} {unit}");
            report.add_hint(layer.at(key), &layer.key(key), message, format!("lower it, or change {by}"));
        }
        Some(value.min(most))
    };
    let Wheels { radius_m, track_m, speed_radps_max, .. } = wheels;
    let speed = format!("wheel_radps_max ({speed_radps_max} rad/s) or wheel_radius_m ({radius_m} m)");
    let turn =
        format!("wheel_radps_max ({speed_radps_max} rad/s), wheel_radius_m ({radius_m} m) or track_m ({track_m} m)");
    Limits {
        speed_mps_max: asked(Body::speed_mps_max, most.speed_mps_max, "m/s", &speed).unwrap_or(most.speed_mps_max),
        reverse_mps_max: asked(Mobile::reverse_mps_max, most.reverse_mps_max, "m/s", &speed)
            .unwrap_or(Mobile::reverse_mps_max.default()),
        turn_radps_max: asked(Body::turn_radps_max, most.turn_radps_max, "rad/s", &turn).unwrap_or(most.turn_radps_max),
        ..most
    }
}

/// Reports keys that say of other bodies what wheels say of a diff-drive.
pub(crate) fn check_keys(layer: &Node, wheels: &Wheels, report: &mut Report) {
    let Wheels { radius_m, track_m, .. } = wheels;
    let mut check = |key: Key<f64>, hint: &dyn Fn(f64) -> String| {
        if layer.has(key) {
            let message = format!("does not go with kind = \"{}\"", BodyKind::DiffDrive.word());
            report.add_hint(layer.at(key), &layer.key(key), message, hint(layer.get(key)));
        }
    };
    let of_wheels = |value: f64, unit: &str, share: f64| {
        let wheels = value * share;
        format!("the key for wheels is wheel_accel_radps2_max: {value} {unit} is {wheels:.3} rad/s² there")
    };
    check(Mobile::accel_mps2_max, &|value| of_wheels(value, "m/s²", 1.0 / radius_m));
    check(Body::turn_accel_radps2_max, &|value| of_wheels(value, "rad/s²", 0.5 * track_m / radius_m));
    check(Mobile::turning_radius_m_min, &|_| "it turns where it stands: leave it out, or make it a unicycle".into());
}
