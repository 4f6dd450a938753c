use super::values::parse_command;
use super::*;
use clap::CommandFactory;

#[test]
fn the_definition_is_sound() {
    Cli::command().debug_assert();
}

#[test]
fn durations() {
    let check = |text: &str, expected: Option<f64>| {
        assert_eq!(parse_duration(text).ok(), expected, "{text}");
    };
    check("60s", Some(60.0));
    check("60", Some(60.0));
    check("1.5m", Some(90.0));
    check("2min", Some(120.0));
    check("500ms", Some(0.5));
    check("2h", Some(7200.0));
    check(" 3 s ", Some(3.0));
    check("1e3", Some(1000.0));
    check("0s", None);
    check("-5s", None);
    check("nan", None);
    check("inf", None);
    check("s", None);
    check("", None);
    check("5 parsecs", None);
    check("1m30s", None);
}

#[test]
fn commands() {
    let words = |text: &str| {
        parse_command(text).map(|command| {
            [command.program()]
                .map(str::to_owned)
                .into_iter()
                .chain(command.arguments().iter().cloned())
                .collect::<Vec<_>>()
        })
    };
    let check = |text: &str, expected: &[&str]| {
        assert_eq!(words(text), Ok(expected.iter().map(|word| (*word).to_owned()).collect()), "{text}");
    };
    check("python3 my.py", &["python3", "my.py"]);
    check("  ./own  ", &["./own"]);
    check(r#"'a b' "c d"e \\f '' "\"""#, &["a b", "c de", "\\f", "", "\""]);
    check("a 'it'\\''s'", &["a", "it's"]);
    for wrong in ["", "  ", "'a", "a\\"] {
        assert!(parse_command(wrong).is_err(), "{wrong}");
    }
    // What is shown can be given again.
    let shown = parse_command("a 'it'\\''s' 'b c'").unwrap().to_string();
    assert_eq!(parse_command(&shown).unwrap().to_string(), shown);
}

#[test]
fn points() {
    assert_eq!(parse_point("4,-2.5"), Ok([4.0, -2.5]));
    assert_eq!(parse_point(" -1e0 , 0"), Ok([-1.0, 0.0]));
    assert_eq!(parse_pose("4,-2"), Ok(Pose { at_m: [4.0, -2.0], yaw_rad: None }));
    assert_eq!(parse_pose("4,-2, 1.57"), Ok(Pose { at_m: [4.0, -2.0], yaw_rad: Some(1.57) }));
    assert!(parse_pose("4,-2,").is_err() && parse_pose("4,1,1,1").is_err() && parse_pose("4").is_err());
    for wrong in ["4", "4,", "4,x", "1,2,3", "nan,0", "inf,1"] {
        assert!(parse_point(wrong).is_err(), "{wrong}");
    }
}

fn parse(line: &str) -> Result<Verb, clap::Error> {
    Cli::try_parse_from(line.split(' ').map(|word| not_an_option(word.into()))).map(|cli| cli.verb)
}

#[test]
fn run_takes_what_the_contract_says() {
    let line = "shoal run ring.toml --mode lockstep --planner apf --robots 8 --seed 7 --duration 1m \
                --filter none --set a.b=1 --set c=-2 --report out.json --format json";
    let Ok(Verb::Run(run)) = parse(line) else { panic!("{line}") };
    assert_eq!(run.scenario, "ring.toml");
    assert_eq!(run.mode, Some(ModeArg::Lockstep));
    assert_eq!(run.duration, Some(60.0));
    assert_eq!(run.changes.set, ["a.b=1", "c=-2"]);
    assert_eq!(run.format, Format::Json);
    let Ok(Verb::Run(run)) = parse("shoal run") else { panic!() };
    assert_eq!((run.scenario, run.mode, run.format), (DEFAULT_SCENARIO.into(), None, Format::Text));
}

#[test]
fn negative_places_are_values_not_options() {
    let Ok(Verb::Add(add)) = parse("shoal add --start -3,-4 --goal -1,2 --yaw -1.5") else { panic!() };
    let goal = Pose { at_m: [-1.0, 2.0], yaw_rad: None };
    assert_eq!((add.start, add.goal, add.yaw), (Some([-3.0, -4.0]), Some(goal), Some(-1.5)));
    for line in ["shoal task send r03 -4,2 --now", "shoal task send --now r03 -4,2"] {
        let Ok(Verb::Task(TaskVerb::Send(send))) = parse(line) else { panic!("{line}") };
        let goal = Pose { at_m: [-4.0, 2.0], yaw_rad: None };
        assert_eq!((send.robot_and_goals(), send.now), (Ok((Some("r03"), vec![goal])), true), "{line}");
    }
}

#[test]
fn options_behind_goals_are_options() {
    let Ok(Verb::Task(TaskVerb::Send(send))) =
        parse("shoal task send --assign optimal -4,2 1,-1,-1.5 -.5,3 --id a-1 --priority -3 --deadline 2m")
    else {
        panic!()
    };
    let (robot, goals) = send.robot_and_goals().unwrap();
    assert_eq!((robot, goals.len(), goals[1].yaw_rad, goals[2].at_m), (None, 3, Some(-1.5), [-0.5, 3.0]));
    assert_eq!((send.id.as_deref(), send.priority, send.deadline), (Some("a-1"), -3, Some(120.0)));
    for line in ["shoal task send r03", "shoal task send r03 4", "shoal task send --assign nearest r03 4,2"] {
        let Ok(Verb::Task(TaskVerb::Send(send))) = parse(line) else { panic!("{line}") };
        assert!(send.robot_and_goals().is_err(), "{line}");
    }
}

#[test]
fn usage_errors_have_code_2() {
    for line in [
        "shoal run --mode warp",
        "shoal run --robots many",
        "shoal run --duration -5s",
        "shoal run --seed -1",
        "shoal run a b",
        "shoal add --start 1,2",
        "shoal task send",
        "shoal task wait",
        "shoal task wait 3 --all",
        "shoal task list --state lost",
        "shoal up",
        "shoal logs --level loud",
        "shoal ps --format yaml",
    ] {
        assert_eq!(parse(line).map(|_| ()).unwrap_err().exit_code(), 2, "{line}");
    }
}

#[test]
fn help_shows_what_exists_and_nothing_else() {
    let help = Cli::command().render_long_help().to_string();
    for verb in [
        "run",
        "up",
        "down",
        "logs",
        "plot",
        "export",
        "reproduce",
        "sweep",
        "bench",
        "validate",
        "schema",
        "planners",
        "doctor",
        "clean",
        "ps",
        "top",
        "view",
        "replay",
        "export",
        "add",
        "task",
    ] {
        assert!(help.contains(&format!("\n  {verb} ")), "{verb}: {help}");
    }
    for verb in ["agent", "world", "guardian", "other", "inspect"] {
        assert!(!help.contains(&format!("\n  {verb} ")), "{verb}: {help}");
    }
}
