//! Methods and their parameters, as a file gives them.

use crate::document::{Field, RawValue};
use crate::node::Block;
use crate::problems::{Origin, Report, known, nearest};
use model::{BodyKind, ParamValue, ParamValues};
use planners::{METHODS, Method, ParamError};

/// Says so if there is no method of that name.
pub(crate) fn find(name: &str, key: &str, origin: Origin, report: &mut Report) -> Option<&'static Method> {
    let method = planners::find(name);
    if method.is_none() {
        let names: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
        let message = format!("unknown planner `{}`", name.escape_debug());
        report.add_hint(origin, key, message, known("planners", name, &names));
    }
    method
}

/// The methods that can drive a body of this kind, as a hint.
pub(crate) fn for_kind(kind: BodyKind) -> String {
    let fitting = METHODS.iter().filter(|method| method.kinds.contains(&kind));
    format!("planners that can: {}", fitting.map(|method| method.name).collect::<Vec<_>>().join(", "))
}

/// The values of a block; what has no type that a parameter can have is left out.
pub(crate) fn values(block: &Block) -> ParamValues {
    block.fields.iter().filter_map(|field| Some((field.name.clone(), value(field)?))).collect()
}

fn value(field: &Field) -> Option<ParamValue> {
    match &field.value.value {
        RawValue::Float(number) => Some(ParamValue::Float(*number)),
        RawValue::Int(number) => i64::try_from(*number).ok().map(ParamValue::Int),
        RawValue::Bool(value) => Some(ParamValue::Bool(*value)),
        RawValue::Text(word) => Some(ParamValue::Choice(word.clone())),
        RawValue::Date(_) | RawValue::List(_) | RawValue::Table(_) => None,
    }
}

/// Reports what in a block does not fit its method.
pub(crate) fn check(method: &Method, block: &Block, report: &mut Report) {
    for field in block.fields.iter().filter(|field| value(field).is_none()) {
        let message = format!("expected a number, a switch or a word, found {}", field.value.value.describe());
        report.add(field.origin, &format!("{}.{}", block.path, field.name), message);
    }
    for problem in method.check(&values(block)) {
        let name = problem.name();
        let key = format!("{}.{}", block.path, name.escape_debug());
        let origin = block.fields.iter().find(|field| field.name == name).map_or(Origin::Whole, |field| field.origin);
        add(method, &problem, &key, origin, report);
    }
}

/// Reports one problem of a parameter.
pub(crate) fn add(method: &Method, problem: &ParamError, key: &str, origin: Origin, report: &mut Report) {
    match problem {
        ParamError::Unknown { name, known: names, .. } => {
            let message = format!("unknown parameter `{}` of `{}`", name.escape_debug(), method.name);
            let hint = match METHODS.iter().find(|other| (other.params)().iter().any(|spec| spec.name == name)) {
                Some(other) if nearest(name, names.iter().copied()).is_none() => {
                    format!("`{name}` is a parameter of {}; known parameters: {}", other.name, names.join(", "))
                }
                _ if names.is_empty() => format!("`{}` has no parameters", method.name),
                _ => known("parameters", name, names),
            };
            report.add_hint(origin, key, message, hint);
        }
        ParamError::Value { problem, .. } => report.add(origin, key, problem.clone()),
    }
}

/// The table `[planners]`: parameters by method for the whole fleet.
pub(crate) struct FleetParams(Vec<(&'static str, ParamValues)>);

impl FleetParams {
    /// Checks the table and takes what is right.
    pub(crate) fn read(planners: &[(String, Origin, Block)], report: &mut Report) -> FleetParams {
        let mut fleet = Vec::new();
        for (name, origin, block) in planners {
            if let Some(method) = find(name, &block.path, *origin, report) {
                check(method, block, report);
                fleet.push((method.name, values(block)));
            }
        }
        FleetParams(fleet)
    }

    /// Those of one method.
    pub(crate) fn of(&self, method: &str) -> ParamValues {
        self.0.iter().find(|(name, _)| *name == method).map(|(_, values)| values.clone()).unwrap_or_default()
    }
}
