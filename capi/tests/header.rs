//! The header says what the sources have: compilers of C and C++ check each name, offset and size.

use shoal_agent::types::*;
use std::fmt::Write as _;
use std::io::Write as _;
use std::mem::offset_of;
use std::path::Path;
use std::process::{Command, Stdio};

/// Assertions about a struct: each field's offset and size, and the size of the whole. The pattern names all fields, so that none
/// is forgotten here.
macro_rules! check {
    ($out:expr, $type:ident { $($field:ident),+ }) => {{
        let _ = |$type { $($field: _),+ }: $type| {};
        $(
            let (at, bytes) = (offset_of!($type, $field), size_of_field(|of: &$type| &of.$field));
            let _ = writeln!($out, "ASSERT(offsetof({0}, {1}) == {at} && sizeof((({0} *)0)->{1}) == {bytes}, \"{0}.{1}\");",
                stringify!($type), stringify!($field));
        )+
        let _ = writeln!($out, "ASSERT(sizeof({0}) == {1}, \"{0}\");", stringify!($type), size_of::<$type>());
    }};
}

fn size_of_field<T, F>(_: fn(&T) -> &F) -> usize {
    size_of::<F>()
}

fn source() -> String {
    let mut out = String::from(
        "#include \"shoal_agent.h\"\n#ifdef __cplusplus\n#define ASSERT static_assert\n#else\n#define ASSERT _Static_assert\n#endif\n",
    );
    check!(out, shoal_vec2 { x, y });
    check!(
        out,
        shoal_limits {
            speed_mps_max,
            reverse_mps_max,
            turning_radius_m_min,
            turn_radps_max,
            accel_mps2_max,
            turn_accel_radps2_max
        }
    );
    check!(
        out,
        shoal_neighbor {
            position,
            velocity,
            next,
            yaw_rad,
            radius_m,
            age_s,
            remaining_m,
            id,
            has_next,
            arrived,
            stopped
        }
    );
    check!(out, shoal_obstacle { a, b, velocity, radius_m, id });
    check!(out, shoal_half_plane { normal, bound });
    check!(
        out,
        shoal_view {
            name,
            tick,
            seed,
            time_s,
            dt_s,
            position,
            velocity,
            yaw_rad,
            turn_radps,
            radius_m,
            limits,
            goal,
            goal_tolerance_m,
            goal_yaw_rad,
            joints_rad,
            neighbors,
            neighbor_count,
            obstacles,
            obstacle_count,
            map,
            map_count,
            allowed,
            allowed_count,
            random,
            index,
            incarnation,
            kind,
            has_goal_yaw,
            arrived
        }
    );
    check!(out, shoal_command { first, second, form, stopped });
    for (name, value) in [
        ("SHOAL_KIND_POINT", SHOAL_KIND_POINT),
        ("SHOAL_KIND_UNICYCLE", SHOAL_KIND_UNICYCLE),
        ("SHOAL_KIND_DIFF_DRIVE", SHOAL_KIND_DIFF_DRIVE),
        ("SHOAL_KIND_TWO_LINK_ARM", SHOAL_KIND_TWO_LINK_ARM),
        ("SHOAL_FORM_DEFAULT", SHOAL_FORM_DEFAULT),
        ("SHOAL_FORM_WHEELS", SHOAL_FORM_WHEELS),
    ] {
        let _ = writeln!(out, "ASSERT({name} == {value}, \"{name}\");");
    }
    out += "int (*const run)(int, char *const *, shoal_plan, void *) = shoal_agent_run;\n";
    out += "double (*const uniform)(void *) = shoal_uniform;\ndouble (*const normal)(void *) = shoal_normal;\n";
    out
}

#[test]
fn compilers_agree_with_the_sources() {
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    for (compiler, language, standard) in [("cc", "c", "-std=c11"), ("c++", "c++", "-std=c++17")] {
        let mut command = Command::new(compiler);
        command
            .args(["-x", language, standard, "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I"])
            .arg(&include)
            .arg("-");
        let mut child = command.stdin(Stdio::piped()).spawn().unwrap_or_else(|error| panic!("{compiler}: {error}"));
        child.stdin.take().expect("it is piped").write_all(source().as_bytes()).expect("the compiler reads");
        assert!(child.wait().expect("it ends").success(), "{compiler}: the header is not what the sources say");
    }
}
