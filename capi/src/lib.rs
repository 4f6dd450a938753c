//! Agents of shoal in C and C++: the shell of `robot-agent` behind three functions with a header, `include/shoal_agent.h`.
//!
//! No panic leaves these functions, and no exception may come out of a plan. `examples/cpp-agent` shows an agent.

pub mod types;

use robot_agent::model::random::Stream;
use robot_agent::model::{BodyKind, Drive};
use robot_agent::nalgebra::Vector2;
use robot_agent::planners::{Plan, PlanInput, Planner};
use robot_agent::shell::{self, Args};
use robot_agent::{AgentError, AgentSpec};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use types::{Lists, shoal_command, shoal_plan, shoal_view};

/// The run is over, or the robot has left.
const OK: c_int = 0;
/// The agent could not take part, or its planner failed: as an agent in Rust.
const FAILED: c_int = 3;

/// Runs this process as the agent of a robot until the robot leaves or the run ends: 0 then, and 3 when something failed, with
/// the reason on standard error. The arguments are those of `main`; shoal's own are the last ones, from `--root` on. `plan` is
/// called for every tick, with `user` as it is given here.
///
/// # Safety
/// `argv` has `argc` strings, as `main` gets them. `plan` may be called with `user` from this thread until the function returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shoal_agent_run(
    argc: c_int,
    argv: *const *mut c_char,
    plan: Option<shoal_plan>,
    user: *mut c_void,
) -> c_int {
    let result = catch_unwind(AssertUnwindSafe(|| {
        let plan = plan.ok_or("shoal_agent_run: `plan` is null")?;
        // SAFETY: the caller promises it.
        let words = unsafe { words(argc, argv) };
        let args = Args::after_own(words).map_err(|error| error.to_string())?;
        let build = &mut |spec: &AgentSpec| -> Result<Box<dyn Planner>, AgentError> {
            Ok(Box::new(Foreign::new(spec, plan, user)))
        };
        shell::run(&args, build, &mut |_, _| {}).map_err(|error| error.to_string())
    }));
    match result {
        Ok(Ok(())) => OK,
        Ok(Err(words)) => failed(&words),
        Err(panic) => match panic.downcast_ref::<PlanFailed>() {
            Some(PlanFailed(words)) => failed(words),
            // The panic has been printed.
            None => FAILED,
        },
    }
}

/// A random number, uniform in [0, 1), from the stream of a view.
///
/// # Safety
/// `random` is that of the view of a call that has not returned.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shoal_uniform(random: *mut c_void) -> f64 {
    // SAFETY: the caller promises that it is the stream that `Foreign` lends, and nothing else uses it meanwhile.
    unsafe { random.cast::<Stream>().as_mut() }.map_or(0.0, Stream::unit)
}

/// A random number, normal with mean 0 and standard deviation 1, from the stream of a view.
///
/// # Safety
/// As of `shoal_uniform`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn shoal_normal(random: *mut c_void) -> f64 {
    // SAFETY: as above.
    unsafe { random.cast::<Stream>().as_mut() }.map_or(0.0, Stream::normal)
}

/// The arguments behind the name of the program.
///
/// # Safety
/// `argv` has `argc` strings.
unsafe fn words(argc: c_int, argv: *const *mut c_char) -> Vec<String> {
    let count = if argv.is_null() { 0 } else { usize::try_from(argc).unwrap_or(0) };
    let word = |index| {
        // SAFETY: the caller promises this number of strings.
        let word = unsafe { *argv.add(index) };
        if word.is_null() {
            return String::new();
        }
        // SAFETY: it is a string.
        unsafe { CStr::from_ptr(word) }.to_string_lossy().into_owned()
    };
    (1..count).map(word).collect()
}

fn failed(words: &str) -> c_int {
    let _ = writeln!(std::io::stderr(), "error: {words}");
    FAILED
}

/// What unwinds from a plan that failed to the end of the agent.
struct PlanFailed(String);

/// A planner behind a function of C.
struct Foreign {
    name: CString,
    spec: AgentSpec,
    plan: shoal_plan,
    user: *mut c_void,
    lists: Lists,
    random: Box<Stream>,
}

// SAFETY: the pointer is only handed to the plan, on the thread that called `shoal_agent_run`: the shell plans there.
unsafe impl Send for Foreign {}

impl Foreign {
    fn new(spec: &AgentSpec, plan: shoal_plan, user: *mut c_void) -> Foreign {
        let instance = spec.instance;
        Foreign {
            name: CString::new(spec.robot.id.as_str()).unwrap_or_default(),
            random: Box::new(Stream::new(spec.clock.seed, instance.index.0, instance.incarnation, "capi")),
            spec: spec.clone(),
            plan,
            user,
            lists: Lists::default(),
        }
    }

    /// Ends the agent.
    fn fail(&self, tick: u64, problem: &str) -> ! {
        resume_unwind(Box::new(PlanFailed(format!("robot `{}`: plan at tick {tick} {problem}", self.spec.robot.id))))
    }
}

impl Planner for Foreign {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        self.lists.take(input);
        let mut view = shoal_view {
            name: self.name.as_ptr(),
            tick: input.tick,
            seed: self.spec.clock.seed,
            time_s: input.tick as f64 * input.dt_s,
            dt_s: input.dt_s,
            position: <[f64; 2]>::from(input.position).into(),
            velocity: <[f64; 2]>::from(input.velocity).into(),
            yaw_rad: input.yaw_rad,
            turn_radps: input.turn_radps,
            radius_m: input.radius_m,
            limits: input.limits.into(),
            goal: <[f64; 2]>::from(input.goal).into(),
            goal_tolerance_m: input.goal_tolerance_m,
            goal_yaw_rad: input.goal_yaw_rad.unwrap_or(0.0),
            joints_rad: input.arm.map_or([0.0; 2], |arm| arm.joints_rad),
            neighbors: std::ptr::null(),
            neighbor_count: 0,
            obstacles: std::ptr::null(),
            obstacle_count: 0,
            map: std::ptr::null(),
            map_count: 0,
            allowed: std::ptr::null(),
            allowed_count: 0,
            random: std::ptr::from_mut(&mut *self.random).cast(),
            index: self.spec.instance.index.0,
            incarnation: self.spec.instance.incarnation,
            kind: kind(input.kind),
            has_goal_yaw: input.goal_yaw_rad.is_some(),
            arrived: input.arrived,
        };
        self.lists.fill(&mut view);
        let mut command = shoal_command::default();
        // SAFETY: the view, its lists and the command live until the call returns; `user` is what the plan was given with.
        let code = unsafe { (self.plan)(self.user, &raw const view, &raw mut command) };
        if code != 0 {
            self.fail(input.tick, &format!("returned {code}, which says that it failed"));
        }
        let shoal_command { first, second, form, stopped } = command;
        if !first.is_finite() || !second.is_finite() {
            self.fail(input.tick, &format!("asks for ({first}, {second}): a command must be finite"));
        }
        let drive = match (form, input.kind) {
            (types::SHOAL_FORM_DEFAULT, BodyKind::Point) => Drive::Velocity(Vector2::new(first, second)),
            (types::SHOAL_FORM_DEFAULT, BodyKind::Unicycle | BodyKind::DiffDrive) => {
                Drive::Twist { speed_mps: first, turn_radps: second }
            }
            (types::SHOAL_FORM_DEFAULT, BodyKind::TwoLinkArm) => Drive::Joints { rate_radps: [first, second] },
            (types::SHOAL_FORM_WHEELS, BodyKind::DiffDrive) => Drive::Wheels { rate_radps: [first, second] },
            _ => self.fail(input.tick, &format!("asks for form {form}, which a {} does not take", input.kind.word())),
        };
        Plan { stopped, ..Plan::only(drive) }
    }
}

fn kind(kind: BodyKind) -> u32 {
    match kind {
        BodyKind::Point => types::SHOAL_KIND_POINT,
        BodyKind::Unicycle => types::SHOAL_KIND_UNICYCLE,
        BodyKind::DiffDrive => types::SHOAL_KIND_DIFF_DRIVE,
        BodyKind::TwoLinkArm => types::SHOAL_KIND_TWO_LINK_ARM,
    }
}
