//! Maps of all formats: what becomes of their cells, and what is refused.

use model::Scenario;
use nalgebra::Point2;
use shoal_scenarios::{Files, NamedIn, Overrides, Problems, parse_with_files};
use std::collections::BTreeMap;

/// Files in memory.
#[derive(Debug, Default)]
struct Disk(BTreeMap<String, Vec<u8>>);

impl Disk {
    fn with(mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Disk {
        self.0.insert(path.to_owned(), bytes.into());
        self
    }
}

impl Files for Disk {
    fn read(&self, path: &str, named_in: NamedIn, bytes_max: u64) -> Result<Vec<u8>, String> {
        let path = if named_in == NamedIn::Option { format!("here/{path}") } else { path.to_owned() };
        let bytes = self.0.get(&path).ok_or_else(|| format!("file not found (`{path}`)"))?;
        if bytes.len() as u64 > bytes_max { Err("it is too large".to_owned()) } else { Ok(bytes.clone()) }
    }
}

const YAML: &str =
    "image: a.pgm\nresolution: 0.5\norigin: [1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n";
/// Four columns, three rows: black, grey and white. The lower left is black.
const SHADES: [[u8; 4]; 3] = [[255, 255, 255, 255], [255, 128, 255, 255], [0, 255, 255, 255]];

fn p2() -> Vec<u8> {
    let rows = SHADES.map(|row| row.map(|shade| shade.to_string()).join(" "));
    format!("P2\n# a comment\n4 3 # and one more\n255\n{}\n", rows.join("\n")).into_bytes()
}

fn p5() -> Vec<u8> {
    [b"P5 4 3 255\n".as_slice(), &SHADES.concat()].concat()
}

fn png(color: png::ColorType, pixel: impl Fn(u8) -> Vec<u8>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4, 3);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    let data: Vec<u8> = SHADES.concat().into_iter().flat_map(pixel).collect();
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    bytes
}

fn text(world: &str) -> String {
    format!(
        "[world]\n{world}\n[defaults]\nradius_m = 0.1\n[[robot]]\nid = \"a\"\nstart_m = [2.25, 3.25]\ngoal_m = [2.75, 2.25]\n"
    )
}

fn read(world: &str, disk: &Disk) -> Result<Scenario, Problems> {
    parse_with_files("folder/test.toml", &text(world), &Overrides::default(), disk)
}

/// Which cells are solid, row by row from below: `#`, else `.`.
fn drawn(scenario: &Scenario) -> Vec<String> {
    let walls = scenario.walls().expect("it has a map");
    let raster = walls.raster().expect("it has cells");
    let cell = |column: u32, row: u32| {
        if walls.is_solid(raster.at(f64::from(column) + 0.5, f64::from(row) + 0.5)) { '#' } else { '.' }
    };
    (0..raster.rows).map(|row| (0..raster.columns).map(|column| cell(column, row)).collect()).collect()
}

#[test]
fn one_picture_in_four_files_is_one_map() {
    let grey = png(png::ColorType::Grayscale, |shade| vec![shade]);
    let rgba = png(png::ColorType::Rgb, |shade| vec![shade; 3]);
    let mut checksums = Vec::new();
    for picture in [p2(), p5(), grey, rgba] {
        let disk = Disk::default().with("maps/m.yaml", YAML).with("maps/a.pgm", picture);
        let scenario = read("map = \"maps/m.yaml\"", &disk).unwrap();
        // Unknown is solid, and nothing is left of the grey cell but its outline.
        assert_eq!(drawn(&scenario), ["#...", ".#..", "...."]);
        let map = scenario.map.as_ref().unwrap();
        assert_eq!((map.file.as_str(), map.walls as usize), ("maps/m.yaml", scenario.walls().unwrap().len()));
        assert_eq!((scenario.bounds.x_m, scenario.bounds.y_m), ([1.0, 3.0], [2.0, 3.5]));
        assert!(scenario.walls().unwrap().is_solid(Point2::new(0.9, 3.0)), "outside of the picture nothing can be");
        checksums.push(map.checksum);
    }
    assert!(checksums.windows(2).all(|pair| pair[0] == pair[1]), "{checksums:x?}");
}

#[test]
fn shades_mean_what_the_file_says() {
    let check = |change: (&str, &str), world: &str, picture: Vec<u8>, cells: [&str; 3]| {
        let disk = Disk::default().with("m.yaml", YAML.replace(change.0, change.1)).with("a.pgm", picture);
        let scenario =
            read(&format!("map = \"m.yaml\"\n{world}"), &disk).unwrap_or_else(|problems| panic!("{problems}"));
        assert_eq!(drawn(&scenario), cells, "{change:?} {world}");
    };
    check(("", ""), "map_unknown = \"free\"", p5(), ["#...", "....", "...."]);
    check(("", ""), "map_unknown = \"obstacle\"", p5(), ["#...", ".#..", "...."]);
    check(("0.65", "0.4"), "map_unknown = \"free\"", p5(), ["#...", ".#..", "...."]);
    let inverted: Vec<u8> =
        [b"P5 4 3 255\n".as_slice(), &SHADES.concat().iter().map(|shade| 255 - shade).collect::<Vec<_>>()].concat();
    check(("negate: 0", "negate: 1"), "", inverted, ["#...", ".#..", "...."]);
    // A transparent cell is unknown in `scale`; in `trinary` it is darker.
    let transparent = |opacity: u8| {
        png(png::ColorType::GrayscaleAlpha, move |shade| {
            vec![if shade == 128 { 255 } else { shade }, if shade == 128 { opacity } else { 255 }]
        })
    };
    check(("negate: 0", "negate: 0\nmode: scale"), "", transparent(0), ["#...", ".#..", "...."]);
    check(("negate: 0", "negate: 0\nmode: scale"), "map_unknown = \"free\"", transparent(0), ["#...", "....", "...."]);
    check(
        ("negate: 0", "negate: 0\nmode: trinary"),
        "map_unknown = \"free\"",
        transparent(0),
        ["#...", "....", "...."],
    );
    check(
        ("0.65\nfree_thresh: 0.25", "0.2\nfree_thresh: 0.1"),
        "map_unknown = \"free\"",
        transparent(0),
        ["#...", ".#..", "...."],
    );
    // `raw`: percent; what is above 100 is unknown.
    let raw: Vec<u8> = [b"P5 4 3 255\n".as_slice(), &[0, 0, 0, 0, 0, 200, 0, 0, 100, 0, 0, 0]].concat();
    check(("negate: 0", "negate: 0\nmode: raw"), "", raw.clone(), ["#...", ".#..", "...."]);
    check(("negate: 0", "negate: 0\nmode: raw"), "map_unknown = \"free\"", raw, ["#...", "....", "...."]);
    // Sixteen bits, and a scale of its own.
    let deep: Vec<u8> = [
        b"P5 4 3 1000\n".as_slice(),
        &SHADES.concat().iter().flat_map(|shade| u16::to_be_bytes(u16::from(*shade) * 3)).collect::<Vec<_>>(),
    ]
    .concat();
    check(("", ""), "map_unknown = \"free\"", deep, ["#...", "....", "...."]);
}

#[test]
fn a_turned_map_lies_where_its_origin_says() {
    let yaml = YAML.replace("[1.0, 2.0, 0.0]", "[1.0, 2.0, 1.5707963267948966]");
    let disk = Disk::default().with("m.yaml", yaml).with("a.pgm", p5());
    let text = "[world]\nmap = \"m.yaml\"\n[defaults]\nradius_m = 0.1\n[[robot]]\nid = \"a\"\nstart_m = [-0.25, 2.25]\ngoal_m = [0.25, 3.75]\n";
    let scenario = parse_with_files("test.toml", text, &Overrides::default(), &disk).unwrap_or_else(|p| panic!("{p}"));
    let walls = scenario.walls().unwrap();
    // A quarter turn to the left: columns go up, rows go to the left.
    assert!(walls.is_solid(Point2::new(0.75, 2.25)) && !walls.is_solid(Point2::new(0.75, 2.75)));
    assert!(walls.is_solid(Point2::new(0.25, 2.75)) && !walls.is_solid(Point2::new(-0.25, 2.25)));
    let [low, high] = scenario.walls().unwrap().bounds_m();
    assert!((low - Point2::new(-0.5, 2.0)).norm() < 1e-9 && (high - Point2::new(1.0, 4.0)).norm() < 1e-9);
}

const MOVING: &str = "type octile\nheight 3\nwidth 4\nmap\n....\n.@..\n.T..\n";
const SCEN: &str = "version 1\n0\tm.map\t4\t3\t0\t0\t3\t0\t3\n0\tm.map\t4\t3\t0\t2\t3\t2\t4.41421356\n";

#[test]
fn a_moving_ai_map_and_its_problems() {
    let disk = Disk::default().with("maps/m.map", MOVING).with("maps/m.scen", SCEN);
    let text = |cell: &str, robots: usize| {
        format!(
            "[world]\nmap = \"maps/m.map\"\n{cell}\n[defaults]\nradius_m = 0.2\n[layout]\nkind = \"scen\"\nscen = \"maps/m.scen\"\nrobots = {robots}\n"
        )
    };
    let read = |text: &str| parse_with_files("test.toml", text, &Overrides::default(), &disk);
    let scenario = read(&text("", 2)).unwrap_or_else(|problems| panic!("{problems}"));
    assert_eq!(drawn(&scenario), [".#..", ".#..", "...."]);
    let ends: Vec<_> = scenario.robots.iter().map(|robot| (robot.start, robot.goals[0])).collect();
    let at = |x: f64, y: f64| Point2::new(x, y);
    assert_eq!(ends, [(at(0.5, 2.5), at(3.5, 2.5)), (at(0.5, 0.5), at(3.5, 0.5))]);
    let scenario = read(&text("map_cell_m = 2.0", 1)).unwrap();
    assert_eq!((scenario.robots[0].start, scenario.bounds.x_m), (at(1.0, 5.0), [0.0, 8.0]));
    let told = |text: &str| read(text).unwrap_err().to_string();
    assert!(told(&text("", 3)).contains("layout.scen: `maps/m.scen`: it has 2 problems, and the layout 3 robots"));
    assert!(
        told(&text("", 1).replace("map = \"maps/m.map\"", ""))
            .contains("layout.scen: its places are cells, and there is no map")
    );
    assert!(told(&text("", 1).replace("m.scen", "n.scen")).contains("`maps/n.scen`: file not found (`maps/n.scen`)"));
}

#[test]
fn polygons_in_metres() {
    let square = r#"{"type":"Polygon","coordinates":[[[0,0],[2,0],[2,2],[0,2],[0,0]]]}"#;
    let disk = Disk::default().with("m.geojson", square);
    let scenario = read("map = \"m.geojson\"\nx_m = [-5, 5]\ny_m = [-5, 5]", &disk).unwrap_or_else(|p| panic!("{p}"));
    assert_eq!((scenario.walls().unwrap().len(), scenario.walls().unwrap().raster()), (4, None));
    let inside =
        read("map = \"m.geojson\"\nx_m = [-5, 5]\ny_m = [-5, 5]", &disk.with("m.geojson", square.replace('2', "4")));
    let told = inside.unwrap_err().to_string();
    assert!(told.contains("the start of `a`, [2.25, 3.25], overlaps the map by 0.850 m"), "{told}");
}

#[test]
fn what_is_wrong_with_a_map_is_told_with_its_file() {
    let good = || Disk::default().with("m.yaml", YAML).with("a.pgm", p5()).with("m.map", MOVING);
    let told = |world: &str, disk: &Disk| read(world, disk).unwrap_err().to_string();
    for (world, disk, cause) in [
        ("map = \"n.yaml\"", good(), "line 2: world.map: `n.yaml`: file not found (`n.yaml`)"),
        ("map = \"m.yaml\"", good().with("a.pgm", ""), "`m.yaml`: `a.pgm`: the file is empty"),
        ("map = \"m.yaml\"", good().with("a.pgm", "GIF89a"), "`a.pgm`: it is neither a PGM (P2, P5) nor a PNG"),
        ("map = \"m.yaml\"", good().with("a.pgm", "P5 4 3 255\n123"), "`a.pgm`: it ends before its last pixel"),
        (
            "map = \"m.yaml\"",
            good().with("a.pgm", "P5 60000 60000 255\n1"),
            "60000 x 60000 pixels, and a map has at most",
        ),
        ("map = \"m.yaml\"", good().with("a.pgm", "P5 0 3 255\n"), "it says that it has 0 x 3 pixels"),
        ("map = \"m.yaml\"", good().with("a.pgm", "P2 2 1 255\n12 300"), "a pixel of row 0 is 300"),
        ("map = \"m.yaml\"", good().with("a.pgm", "P5 4 x"), "its header has no height"),
        ("map = \"m.yaml\"", good().with("a.pgm", "P5 2 2 255\n\0\0\0\0"), "it has no free cell"),
        (
            "map = \"m.yaml\"",
            good().with("a.pgm", b"\x89PNG\r\n\x1a\nnothing".to_vec()),
            "it is not a PNG that can be read",
        ),
        ("map = \"m.yaml\"", good().with("m.yaml", b"\xff".to_vec()), "`m.yaml`: it is not a text in UTF-8"),
        ("map = \"a.pgm\"", good(), "a picture alone does not say where it lies"),
        ("map = \"m.txt\"", good(), "its ending says nothing of its format"),
        ("map = \"m.yaml\"\nmap_cell_m = 2.0", good(), "`map_cell_m` is for MovingAI maps"),
        ("map_unknown = \"free\"", good(), "world.map_unknown: there is no map"),
        ("map = \"m.yaml\"\nphysics = \"rapier\"", good(), "world.physics: `rapier` has no maps yet"),
        ("map = \"m.yaml\"\nx_m = [2.0, 2.5]", good(), "the goal of `a`, [2.75, 2.25], is outside the world"),
    ] {
        let told = told(world, &disk);
        assert!(told.contains(cause), "{cause}\n{told}");
    }
    // A path in an option is relative to where the command runs.
    let overrides = Overrides { set: vec!["world.map=\"m.yaml\"".to_owned()], ..Overrides::default() };
    let disk = Disk::default().with("here/m.yaml", YAML).with("here/a.pgm", p5());
    assert!(parse_with_files("folder/test.toml", &text(""), &overrides, &disk).is_ok());
}

/// Whatever becomes of a byte, a file is a map or is refused.
#[test]
fn damaged_files_are_maps_or_are_refused() {
    let mut seed = 7_u64;
    let mut next = |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    let files: [(&str, &str, Vec<u8>); 6] = [
        ("m.yaml", "a.pgm", p5()),
        ("m.yaml", "a.pgm", p2()),
        ("m.yaml", "a.pgm", png(png::ColorType::Grayscale, |shade| vec![shade])),
        ("m.yaml", "m.yaml", YAML.as_bytes().to_vec()),
        ("m.map", "m.map", MOVING.as_bytes().to_vec()),
        ("m.geojson", "m.geojson", br#"{"type":"Polygon","coordinates":[[[0,0],[2,0],[2,2],[0,2]]]}"#.to_vec()),
    ];
    for (map, path, whole) in &files {
        for _ in 0..400 {
            let mut bytes = whole.clone();
            for _ in 0..=next(3) {
                let at = next(bytes.len());
                match next(3) {
                    0 => bytes[at] = next(256) as u8,
                    1 => bytes.truncate(at.max(1)),
                    _ => bytes.insert(at, b"0159 \n[]{}.-"[next(12)]),
                }
            }
            let disk = Disk::default().with("m.yaml", YAML).with("a.pgm", p5()).with(path, bytes);
            let _ = read(&format!("map = \"{map}\""), &disk);
        }
    }
}
