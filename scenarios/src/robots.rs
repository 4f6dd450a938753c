//! Robots from their layers: the robot itself, its kind, the defaults, the declarations of the keys.

use crate::layers::Layered;
use crate::methods::{self, FleetParams};
use crate::node::{Given, Node};
use crate::problems::{Origin, Report};
use crate::table::{self, Arm, Body, KindKey, Kinds, Mobile, PlacedArm, Root, WheelKeys};
use crate::types::{FilterChoice, PlannerName, Rounds};
use crate::wheels;
use model::kind::Range;
use model::{BodyKind, Dynamics, FilterKind, Limits, Motion, ParamValues, Physics, Restart, RestartPolicy, Robot};
use nalgebra::{Point2, Vector2};

/// What all robots of a file share.
pub(crate) struct Layers<'a> {
    defaults: Option<&'a Node>,
    point: Option<&'a Node>,
    unicycle: Option<&'a Node>,
    diff_drive: Option<&'a Node>,
    /// The kind of arms.
    pub(crate) arm: Option<&'a Node>,
    fleet_params: FleetParams,
    /// A method that replaces that of every robot.
    planner: Option<&'a str>,
    /// A filter that replaces that of every robot that can have one.
    filter: Option<FilterKind>,
    physics: Physics,
    tick_hz: f64,
}

/// Where a robot comes from and where it goes.
pub(crate) struct Place {
    pub(crate) id: String,
    pub(crate) start: Point2<f64>,
    pub(crate) goals: Vec<Point2<f64>>,
    pub(crate) goal_yaw_rad: Option<f64>,
    pub(crate) goal_motion: Option<Motion>,
}

impl Place {
    /// A place with goals that stand still.
    pub(crate) fn at(id: String, start: Point2<f64>, goals: Vec<Point2<f64>>) -> Place {
        Place { id, start, goals, goal_yaw_rad: None, goal_motion: None }
    }
}

impl<'a> Layers<'a> {
    /// Checks what is shared.
    pub(crate) fn read(
        root: &'a Node,
        (planner, filter): (Option<&'a str>, Option<FilterKind>),
        physics: Physics,
        tick_hz: f64,
        report: &mut Report,
    ) -> Layers<'a> {
        let kinds = root.node(Root::kinds);
        let layers = Layers {
            defaults: root.node(Root::defaults),
            point: kinds.and_then(|kinds| kinds.node(Kinds::point)),
            unicycle: kinds.and_then(|kinds| kinds.node(Kinds::unicycle)),
            diff_drive: kinds.and_then(|kinds| kinds.node(Kinds::diff_drive)),
            arm: kinds.and_then(|kinds| kinds.node(Kinds::two_link_arm)),
            fleet_params: FleetParams::read(root.params_by_planner(Root::planners), report),
            planner,
            filter,
            physics,
            tick_hz,
        };
        layers.check_method(&[layers.defaults], report);
        layers.check_method(&[layers.point, layers.defaults], report);
        layers.check_method(&[layers.unicycle, layers.defaults], report);
        layers.check_method(&[layers.diff_drive, layers.defaults], report);
        layers.check_method(&[layers.arm, layers.defaults], report);
        layers
    }

    /// The defaults of a kind.
    fn of_kind(&self, kind: BodyKind) -> Option<&'a Node> {
        match kind {
            BodyKind::Point => self.point,
            BodyKind::Unicycle => self.unicycle,
            BodyKind::DiffDrive => self.diff_drive,
            BodyKind::TwoLinkArm => self.arm,
        }
    }

    /// The robot that a node describes; without a node the one that the defaults describe.
    pub(crate) fn robot(&self, node: Option<&Node>, place: Place, report: &mut Report) -> Robot {
        let kind = Layered([node, self.defaults].into_iter().flatten().collect()).get(KindKey::kind);
        self.of_this_kind(kind, node, place, report)
    }

    /// What the defaults make of robots of the kinds that drive about, but for this one; those that they do not fit are
    /// left out.
    pub(crate) fn templates_but(&self, kind: BodyKind) -> Vec<Robot> {
        let template = |kind: &BodyKind| {
            let mut report = Report::new(String::new(), Vec::new());
            let place = Place::at(String::new(), Point2::origin(), Vec::new());
            let robot = self.of_this_kind(*kind, None, place, &mut report);
            report.finish().is_ok().then_some(robot)
        };
        BodyKind::MOBILE.iter().filter(|other| **other != kind).filter_map(template).collect()
    }

    fn of_this_kind(&self, kind: BodyKind, node: Option<&Node>, place: Place, report: &mut Report) -> Robot {
        let layers = [node, self.of_kind(kind), self.defaults];
        let (planner, params) = self.method(&layers, kind);
        if let Some(node) = node {
            self.check_method(&layers, report);
            check_kind(&layers, kind, &planner, (&node.key(Body::planner), node.origin), report);
            check_keys(node, kind, report);
        }
        let body = Layered(layers.into_iter().flatten().collect());
        let wheels = (kind == BodyKind::DiffDrive).then(|| wheels::wheels(&body));
        let limits = match &wheels {
            Some(wheels) => {
                // Defaults of robots of another kind may have keys that are for those.
                let defaults = self.defaults.filter(|defaults| defaults.get(KindKey::kind) == kind);
                for layer in [node, self.of_kind(kind), defaults].into_iter().flatten() {
                    wheels::check_keys(layer, wheels, report);
                }
                wheels::limits(&body, wheels, report)
            }
            None => Limits {
                speed_mps_max: body.get(Body::speed_mps_max),
                reverse_mps_max: body.get(Mobile::reverse_mps_max),
                turning_radius_m_min: body.get(Mobile::turning_radius_m_min),
                turn_radps_max: body.get(Body::turn_radps_max),
                accel_mps2_max: body.get(Mobile::accel_mps2_max),
                turn_accel_radps2_max: body.get(Body::turn_accel_radps2_max),
            },
        };
        let filter = self.filter(&body, kind, &planner, report);
        let towards = place.goals.first().map_or(Vector2::zeros(), |goal| goal - place.start);
        Robot {
            id: place.id,
            kind,
            limits,
            arm: None,
            wheels,
            dynamics: Dynamics {
                mass_kg: body.get(Mobile::mass_kg),
                friction: body.get(Body::friction),
                grip: body.get(Mobile::grip),
            },
            radius_m: body.get(Mobile::radius_m),
            start: place.start,
            start_yaw_rad: body.get(Mobile::start_yaw_rad).unwrap_or_else(|| geometry::heading(towards)),
            goals: place.goals,
            goal_yaw_rad: place.goal_yaw_rad,
            goal_yaw_tolerance_rad: body.get(Body::goal_yaw_tolerance_rad),
            rounds: node.map_or(Rounds(Some(1)), |node| node.get(table::Robot::rounds)).0,
            goal_motion: place.goal_motion,
            goal_tolerance_m: body.get(Body::goal_tolerance_m),
            planner,
            params,
            filter,
            sensor_range_m: body.get(Body::sensor_range_m),
            radio_range_m: body.get(Body::radio_range_m),
            radio_hysteresis_m: body.get(Body::radio_hysteresis_m),
            sees_robots: body.get(Body::sees_robots),
            knows_map: body.get(Body::knows_map),
            restart: self.restart(&body),
            agent: body.get(Body::agent),
        }
    }

    /// The filter of a robot with these layers. One that is asked for and that the body cannot have is reported.
    fn filter(&self, body: &Layered<'_>, kind: BodyKind, planner: &str, report: &mut Report) -> FilterKind {
        let fits = self.physics == Physics::Kinematic && BodyKind::MOBILE.contains(&kind);
        match (self.filter, body.get(Body::filter)) {
            (Some(filter), _) if fits => filter,
            (Some(_), _) | (None, FilterChoice::None) => FilterKind::None,
            (None, FilterChoice::SharedGap) => {
                if !fits && let Some(node) = body.0.iter().find(|node| node.has(Body::filter)) {
                    let message = if self.physics == Physics::Kinematic {
                        "an arm cannot have a filter, because its body is not a disc"
                    } else {
                        "bodies that have weight cannot have a filter: they do not go where their commands say"
                    };
                    report.add_hint(
                        node.at(Body::filter),
                        &node.key(Body::filter),
                        message,
                        "leave it out, or write \"none\"",
                    );
                }
                FilterKind::SharedGap
            }
            (None, FilterChoice::Auto) => filter_for(planner, kind, self.physics),
        }
    }

    /// What happens when the process of a robot with these layers ends.
    fn restart(&self, body: &Layered<'_>) -> Restart {
        if body.get(Body::restart) == RestartPolicy::Never {
            return Restart::NEVER;
        }
        // An infinite time is the last tick.
        let ticks = |seconds: f64| ((seconds * self.tick_hz).round() as u64).max(1);
        Restart {
            policy: body.get(Body::restart),
            limit: body.get(Body::restart_limit),
            window_ticks: body.get(Body::restart_window_s).map(ticks),
            delay_ticks: ticks(body.get(Body::restart_delay_s)),
            backoff: body.get(Body::restart_backoff),
            delay_ticks_max: ticks(body.get(Body::restart_delay_max_s)),
        }
    }

    /// Reports a method that cannot drive the robots of a layout.
    pub(crate) fn check_layout(&self, template: &Robot, node: &Node, report: &mut Report) {
        let of_kind = self.of_kind(template.kind);
        let place = (node.path.as_str(), node.origin);
        check_kind(&[of_kind, self.defaults], template.kind, &template.planner, place, report);
    }

    /// The method of a robot with these layers, strongest first, and its parameters. Parameters belong to the method
    /// that is in force in the layer where they stand; those of other methods do not count. A method that replaces all
    /// others replaces those of the kinds that it can drive.
    fn method(&self, layers: &[Option<&Node>], kind: BodyKind) -> (String, ParamValues) {
        let in_force = in_force(layers);
        let replaces =
            self.planner.filter(|name| planners::find(name).is_none_or(|method| method.kinds.contains(&kind)));
        let chosen = replaces.unwrap_or(in_force.last().map_or("", |(_, method)| method.as_str()));
        let mut params = self.fleet_params.of(chosen);
        for (layer, method) in &in_force {
            if let (Some(block), true) = (layer.and_then(|layer| layer.params(Body::params)), *method == chosen) {
                params.extend(methods::values(block));
            }
        }
        (chosen.to_string(), params)
    }

    /// Reports what is wrong with the method that the first of these layers names, or with its parameters.
    fn check_method(&self, layers: &[Option<&Node>], report: &mut Report) {
        let Some(node) = layers.first().copied().flatten() else { return };
        let Some((_, name)) = in_force(layers).pop() else { return };
        if let Given::Value(_) = node.given(Body::planner)
            && methods::find(&name, &node.key(Body::planner), node.at(Body::planner), report).is_none()
        {
            return;
        }
        if let (Some(block), Some(method)) = (node.params(Body::params), planners::find(&name)) {
            methods::check(method, block, report);
        }
    }
}

/// The filter of a robot that asks for none in particular: that of its planner, if the body can have one.
pub(crate) fn filter_for(planner: &str, kind: BodyKind, physics: Physics) -> FilterKind {
    let fits = physics == Physics::Kinematic && BodyKind::MOBILE.contains(&kind);
    if fits && planners::find(planner).is_some_and(|method| method.wants_filter) {
        FilterKind::SharedGap
    } else {
        FilterKind::None
    }
}

/// Reports a method that cannot drive a robot of this kind, where it is named, else at `place`. An agent of one's own
/// brings its own method.
pub(crate) fn check_kind(
    layers: &[Option<&Node>],
    kind: BodyKind,
    planner: &str,
    place: (&str, Origin),
    report: &mut Report,
) {
    let mut layers = layers.iter().copied().flatten();
    let Some(method) = planners::find(planner).filter(|method| !method.kinds.contains(&kind)) else { return };
    if layers.clone().any(|layer| layer.has(Body::agent)) {
        return;
    }
    let (key, origin) = match layers.find(|layer| layer.has(Body::planner)) {
        Some(layer) => (layer.key(Body::planner), layer.at(Body::planner)),
        None => (place.0.to_string(), place.1),
    };
    let message = format!("`{}` cannot drive a {}", method.name, kind.word());
    report.add_hint(origin, &key, message, methods::for_kind(kind));
}

/// The layers that are there, weakest first, each with the method in force in it. The first is the key table.
fn in_force<'a>(layers: &[Option<&'a Node>]) -> Vec<(Option<&'a Node>, String)> {
    let PlannerName(mut method) = Body::planner.default();
    let mut result = vec![(None, method.clone())];
    for layer in layers.iter().rev().copied().flatten() {
        if let Given::Value(PlannerName(name)) = layer.given(Body::planner) {
            method = name;
        }
        result.push((Some(layer), method.clone()));
    }
    result
}

/// Reports keys of a robot that do not go with its kind.
fn check_keys(node: &Node, kind: BodyKind, report: &mut Report) {
    let groups: [(&[_], &[BodyKind]); 4] = [
        (Mobile::KEYS, BodyKind::MOBILE),
        (WheelKeys::KEYS, &[BodyKind::DiffDrive]),
        (PlacedArm::KEYS, &[BodyKind::TwoLinkArm]),
        (Arm::KEYS, &[BodyKind::TwoLinkArm]),
    ];
    for (keys, owners) in groups.into_iter().filter(|(_, owners)| !owners.contains(&kind)) {
        for key in keys.iter().filter(|key| node.has(*key)) {
            let owners: Vec<&str> = owners.iter().map(|kind| kind.word()).collect();
            let message = format!("does not go with kind = \"{}\"", kind.word());
            report.add_hint(node.at(key), &node.key(key), message, format!("it belongs to {}", owners.join(", ")));
        }
    }
}

/// Reports a heading that a body cannot turn to.
pub(crate) fn check_goal_yaw(robot: &Robot, yaw_rad: Option<f64>, key: &str, origin: Origin, report: &mut Report) {
    if yaw_rad.is_some() && !BodyKind::ROLLING.contains(&robot.kind) {
        let message = format!("a {} does not turn: it has no heading at its goal", robot.kind.word());
        report.add_hint(origin, key, message, "leave the third number out, or make it a unicycle or a diff-drive");
    }
    if let Some(yaw_rad) = yaw_rad.filter(|yaw_rad| !Range::ANY.contains(*yaw_rad)) {
        report.add(origin, key, format!("the heading there is to be a number of rad, is {yaw_rad}"));
    }
}

/// Reports rounds that lead nowhere.
pub(crate) fn check_rounds(robot: &Robot, node: &Node, report: &mut Report) {
    if robot.rounds == Some(1) {
        return;
    }
    let (key, origin) = (node.key(table::Robot::rounds), node.at(table::Robot::rounds));
    if robot.goals.len() < 2 {
        report.add_hint(origin, &key, "there is only one goal to go round", "add waypoints_m");
    }
    if robot.goal_motion.is_some() {
        report.add_hint(
            origin,
            &key,
            "a goal that moves is followed, not gone round",
            "leave goal_motion or rounds out",
        );
    }
}
