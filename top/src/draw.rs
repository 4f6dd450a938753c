//! The screen. Pure: it is drawn into cells.

use crate::app::{App, Input, Pane};
use crate::map;
use crate::rows::{Row, Sort};
use model::{Mode, ProcessState};
use ratatui::Frame;
use ratatui::layout::{Constraint, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Clear, Paragraph, Row as TableRow, Table, TableState};
use report::Verdict;

/// From this width on the table and the map stand side by side.
const WIDE: u16 = 110;
/// Below this width or height there is room for one of them.
const NARROW: u16 = 60;
const LOW: u16 = 16;
/// The widest table: more would be space.
const TABLE_WIDTH_MAX: u16 = 76;

const HELP: [(&str, &str); 13] = [
    ("arrows, j k, PgUp PgDn", "select a robot"),
    ("g", "send it to a goal: X,Y or X,Y,YAW"),
    ("x", "kill its process (then y)"),
    ("p", "stop its process, or let it go on"),
    ("m", "mute it for 5 s"),
    ("space", "pause the fleet, or let it go on"),
    ("n, N", "do one tick, ten ticks"),
    ("s, S", "sort by the next column, reverse"),
    ("/", "show robots by a part of the name"),
    ("Esc", "show all robots"),
    ("v, Tab", "table, map, events (narrow terminals)"),
    ("?", "this page"),
    ("q, Ctrl-C", "quit; the fleet goes on"),
];

/// Draws everything.
pub(crate) fn draw(app: &App, frame: &mut Frame<'_>) {
    let area = frame.area();
    let (head, body, foot) = parts(area);
    frame.render_widget(Paragraph::new(header(app, head)), head);
    if body.height > 0 {
        draw_body(app, frame, body);
    }
    frame.render_widget(Paragraph::new(footer(app)), foot);
    if app.input == Input::Help {
        draw_help(frame, area);
    }
}

/// Two lines at the top, one at the bottom, and what is between.
fn parts(area: Rect) -> (Rect, Rect, Rect) {
    let head = area.height.min(2);
    let foot = u16::from(area.height > 2);
    let body = area.height - head - foot;
    let at = |y: u16, height: u16| Rect { y: area.y + y, height, ..area };
    (at(0, head), at(head, body), at(head + body, foot))
}

fn draw_body(app: &App, frame: &mut Frame<'_>, area: Rect) {
    if area.width < NARROW || area.height < LOW {
        return match app.pane {
            Pane::Table => draw_table(app, frame, area),
            Pane::Map => map::draw(app, frame, area),
            Pane::Events => draw_events(app, frame, area),
        };
    }
    let wide = area.width >= WIDE;
    let rows = u16::try_from(app.fleet.members.len()).unwrap_or(u16::MAX).saturating_add(1);
    // The table above or on the left, map and events in the rest.
    let (table, rest) = if wide {
        let width = TABLE_WIDTH_MAX.min(area.width * 3 / 5);
        (Rect { width, ..area }, Rect { x: area.x + width + 1, width: area.width - width - 1, ..area })
    } else {
        let height = rows.min(area.height / 2);
        (Rect { height, ..area }, Rect { y: area.y + height, height: area.height - height, ..area })
    };
    let (map, events) = if wide {
        let height = rest.height * 2 / 3;
        (Rect { height, ..rest }, Rect { y: rest.y + height, height: rest.height - height, ..rest })
    } else {
        let width = rest.width / 2;
        (Rect { width, ..rest }, Rect { x: rest.x + width + 1, width: rest.width - width - 1, ..rest })
    };
    draw_table(app, frame, table);
    map::draw(app, frame, map);
    draw_events(app, frame, events);
}

// ---- the lines at the top and at the bottom

fn header(app: &App, area: Rect) -> Vec<Line<'static>> {
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let name = app.fleet.name.clone().unwrap_or_else(|| app.fleet.id.clone());
    let mut first =
        vec![Span::styled(name, bold), Span::raw(format!(" {} {}", app.fleet.scenario, app.fleet.mode.word()))];
    let Some(vitals) = &app.vitals else {
        return vec![Line::from(first), Line::from("looking at the fleet")];
    };
    let status = &vitals.status;
    let (tick, time_s) = (app.frame.tick.max(status.tick), app.frame.time_s.max(status.time_s));
    if status.paused {
        first.push(Span::styled(" PAUSED", bold.fg(Color::Yellow)));
    } else if let Some(rate) = status.rate.filter(|_| app.fleet.mode != Mode::Realtime) {
        first.push(Span::raw(format!(" x{rate}")));
    }
    let arrived = status.robots.iter().filter(|robot| robot.arrived).count();
    first.push(Span::raw(format!("  {time_s:.2} s  tick {tick}  arrived {arrived}/{}  ", status.robots.len())));
    let contacts = Style::new().fg(if app.frame.contacts > 0 { Color::LightRed } else { Color::Reset });
    first.push(Span::styled(format!("contacts {}", app.frame.contacts), contacts));
    vec![Line::from(first), second(app, area.width)]
}

/// How the fleet does: what is wrong with it, or its times.
fn second(app: &App, width: u16) -> Line<'static> {
    let bad = Style::new().fg(Color::LightRed);
    if let Some(why) = &app.blind {
        return Line::styled(format!("not visible: {why}"), bad);
    }
    let Some(vitals) = &app.vitals else { return Line::default() };
    if let Some(why) = &vitals.unanswered {
        return Line::styled(format!("the daemon does not answer: {why}"), bad);
    }
    let (status, pulse) = (&vitals.status, &vitals.pulse);
    if status.world_state != ProcessState::Running {
        return Line::styled(format!("the world's process is {}", status.world_state.word()), bad);
    }
    if let Some(first) = status.waits_for.first() {
        let more = status.waits_for.len() - 1;
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        return Line::styled(format!("the tick waits for {first}{more}"), bad);
    }
    let mut spans = vec![match pulse.verdict {
        Verdict::Valid => Span::styled("valid", Style::new().fg(Color::LightGreen)),
        Verdict::Starved => Span::styled("starved", bad),
        Verdict::Impaired => Span::styled("impaired", bad),
    }];
    let missed: u64 = pulse.robots.values().map(|load| load.missed_ever).sum();
    let ms = |found: Option<[f64; 2]>| found.map_or_else(|| "-".to_owned(), |[_, p99]| time(p99));
    spans.push(Span::raw(format!(
        "  late {missed}  age p99 {}  wake p99 {}  step p99 {}  world {}",
        ms(pulse.fleet.pose_age_us),
        ms(pulse.fleet.wake_us),
        ms(pulse.fleet.step_us),
        share(pulse.world.cpu),
    )));
    let used: usize = spans.iter().map(Span::width).sum();
    if let Some(because) = pulse.because.first().filter(|_| used + 4 < usize::from(width)) {
        spans.push(Span::styled(format!("  {because}"), bad));
    }
    Line::from(spans)
}

fn footer(app: &App) -> Line<'static> {
    let strong = Style::new().add_modifier(Modifier::REVERSED);
    match &app.input {
        Input::Filter => return Line::styled(format!("robots with: {}_", app.filter), strong),
        Input::Goal(typed) => {
            let robot = app.selected().map_or_else(String::new, |row| row.id);
            return Line::styled(format!("goal of {robot}, X,Y or X,Y,YAW: {typed}_"), strong);
        }
        Input::Kill(robot) => return Line::styled(format!("kill the process of {robot}? y, or any other key"), strong),
        Input::Command | Input::Help => {}
    }
    if !app.said.words.is_empty() {
        let color = if app.said.is_good { Color::LightGreen } else { Color::LightRed };
        return Line::styled(app.said.words.clone(), Style::new().fg(color));
    }
    let filter = if app.filter.is_empty() { String::new() } else { format!("only `{}`  ", app.filter) };
    Line::styled(
        format!("{filter}? help  q quit  g goal  x kill  p stop  m mute  space pause  s sort  / filter"),
        Style::new().fg(Color::DarkGray),
    )
}

// ---- the table

/// A column: its head, its width, how much it matters when there is little room (less is more), and what is in it.
struct Column {
    head: &'static str,
    sort: Option<Sort>,
    /// Below zero: words, which begin at the left; else numbers, which end at the right.
    width: i16,
    rank: u8,
    cell: fn(&Row) -> String,
}

const COLUMNS: [Column; 8] = [
    Column { head: "robot", sort: Some(Sort::Robot), width: -10, rank: 0, cell: |row| row.id.clone() },
    Column { head: "state", sort: Some(Sort::State), width: -9, rank: 1, cell: |row| row.state().to_owned() },
    Column { head: "goal m", sort: None, width: -13, rank: 5, cell: Row::goal },
    Column { head: "lives", sort: None, width: 5, rank: 6, cell: |row| row.incarnation.to_string() },
    Column {
        head: "age p99",
        sort: Some(Sort::Age),
        width: 9,
        rank: 2,
        cell: |row| row.age_us.map_or_else(|| "-".to_owned(), time),
    },
    Column { head: "missed", sort: Some(Sort::Misses), width: 8, rank: 3, cell: |row| row.missed.to_string() },
    Column { head: "cpu", sort: Some(Sort::Cpu), width: 5, rank: 4, cell: |row| share(row.cpu) },
    Column {
        head: "memory",
        sort: Some(Sort::Memory),
        width: 8,
        rank: 7,
        cell: |row| row.resident_bytes.map_or_else(|| "-".to_owned(), memory),
    },
];

impl Column {
    /// A text in this column.
    fn aligned(&self, text: &str) -> String {
        let width = usize::from(self.width.unsigned_abs());
        if self.width < 0 { text.to_owned() } else { format!("{text:>width$}") }
    }
}

fn draw_table(app: &App, frame: &mut Frame<'_>, area: Rect) {
    let rows = app.rows();
    let columns = fitting(area.width);
    let arrow = if app.reversed { '↑' } else { '↓' };
    let head = columns.iter().map(|column| {
        let sorted = column.sort == Some(app.sort);
        let head = if sorted { format!("{} {arrow}", column.head) } else { column.head.to_owned() };
        Span::styled(column.aligned(&head), Style::new().add_modifier(Modifier::BOLD))
    });
    let cells = |row: &Row| {
        let style = Style::new().fg(map::color(row));
        TableRow::new(columns.iter().map(|column| column.aligned(&(column.cell)(row))).collect::<Vec<_>>()).style(style)
    };
    let widths = columns.iter().map(|column| Constraint::Length(column.width.unsigned_abs()));
    let table = Table::new(rows.iter().map(cells), widths)
        .header(TableRow::new(head.collect::<Vec<_>>()))
        .row_highlight_style(Style::new().add_modifier(Modifier::REVERSED));
    let mut state = TableState::default().with_selected(app.selected_in(&rows));
    frame.render_stateful_widget(table, area, &mut state);
}

/// The columns that there is room for.
fn fitting(width: u16) -> Vec<&'static Column> {
    let mut fitting: Vec<&Column> = COLUMNS.iter().collect();
    let needed = |columns: &[&Column]| {
        columns.iter().map(|column| column.width.unsigned_abs() + 1).sum::<u16>().saturating_sub(1)
    };
    while fitting.len() > 1 && needed(&fitting) > width {
        let last = fitting.iter().enumerate().max_by_key(|(_, column)| column.rank).map_or(0, |(index, _)| index);
        fitting.remove(last);
    }
    fitting
}

/// A time that is given in us, with three digits.
fn time(us: f64) -> String {
    match us {
        us if us < 999.5 => format!("{us:.0} us"),
        us if us < 99_950.0 => format!("{:.1} ms", us * 1e-3),
        us if us < 999_500.0 => format!("{:.0} ms", us * 1e-3),
        us => format!("{:.1} s", us * 1e-6),
    }
}

fn share(cpu: Option<f64>) -> String {
    cpu.map_or_else(|| "-".to_owned(), |share| format!("{:.1}%", share * 100.0))
}

fn memory(bytes: u64) -> String {
    format!("{:.1}M", bytes as f64 / f64::from(1 << 20))
}

// ---- events and help

fn draw_events(app: &App, frame: &mut Frame<'_>, area: Rect) {
    let room = usize::from(area.height.saturating_sub(1));
    let newest = app.events.iter().skip(app.events.len().saturating_sub(room));
    let head = Line::styled("       s  event", Style::new().add_modifier(Modifier::BOLD));
    let lines: Vec<Line<'_>> = std::iter::once(head).chain(newest.map(|event| Line::raw(event.as_str()))).collect();
    frame.render_widget(Paragraph::new(lines), area);
}

fn draw_help(frame: &mut Frame<'_>, area: Rect) {
    let keys = HELP.iter().map(|(key, _)| key.len()).max().unwrap_or_default();
    let longest = HELP.iter().map(|(_, what)| keys + 4 + what.len()).max().unwrap_or_default();
    let width = u16::try_from(longest + 2).unwrap_or(u16::MAX).min(area.width);
    let height = (HELP.len() as u16 + 2).min(area.height);
    let page = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height };
    let narrow = usize::from(width) < longest;
    let line = |(key, what): &(&str, &str)| match narrow {
        true => Line::raw(format!("{}: {what}", key.split(',').next().unwrap_or(key))),
        false => Line::raw(format!(" {key:<keys$}  {what}")),
    };
    let head = Line::styled(" keys (any key closes this)", Style::new().add_modifier(Modifier::BOLD));
    let lines: Vec<Line<'_>> = std::iter::once(head).chain(HELP.iter().map(line)).collect();
    frame.render_widget(Clear, page);
    frame.render_widget(Paragraph::new(lines).style(Style::new().bg(Color::Black).fg(Color::White)), page);
}
