//! Maps that tell of more than they have: each is refused in memory that its size bounds.

use crate::counting::peak_of;
use scenarios::{Files, NamedIn, Overrides};

/// The one file that there is, but for the YAML that names it.
#[derive(Debug)]
struct Hostile(&'static str, Vec<u8>);

impl Files for Hostile {
    fn read(&self, path: &str, _: NamedIn, bytes_max: u64) -> Result<Vec<u8>, String> {
        let yaml = "image: a.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n";
        let bytes = if path == self.0 { self.1.clone() } else { yaml.as_bytes().to_vec() };
        if bytes.len() as u64 > bytes_max { Err("it is too large".to_owned()) } else { Ok(bytes) }
    }
}

fn png_of(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
    bytes.extend([width.to_be_bytes(), height.to_be_bytes()].concat());
    bytes.extend([8, 0, 0, 0, 0]);
    let sum = bytes[12..].iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| if sum & 1 != 0 { sum >> 1 ^ 0xedb8_8320 } else { sum >> 1 })
    });
    bytes.extend((!sum).to_be_bytes());
    bytes.extend(b"\0\0\0\x04IDAT\x78\x9c\x01\0");
    bytes
}

#[test]
fn sizes_that_are_told_take_no_memory() {
    let pgm = |text: &str| Hostile("a.pgm", text.as_bytes().to_vec());
    let map = |text: &str| Hostile("a.map", text.as_bytes().to_vec());
    let json = |text: String| Hostile("a.geojson", text.into_bytes());
    let nested = 100_000;
    let all = [
        ("m.yaml", pgm("P5 8192 8192 255\nx")),
        ("m.yaml", pgm("P2 8192 8192 255\n0 0")),
        ("m.yaml", pgm("P5 4294967295 4294967295 255\n")),
        ("m.yaml", pgm("P5 99999999999999999999 1 255\n")),
        ("m.yaml", pgm(&format!("P5{}1", "#\n".repeat(nested)))),
        ("m.yaml", Hostile("a.pgm", png_of(8192, 8192))),
        ("m.yaml", Hostile("a.pgm", png_of(u32::MAX, u32::MAX))),
        ("m.yaml", Hostile("a.pgm", png_of(0, 0))),
        ("m.yaml", Hostile("m.yaml", vec![b'a'; 100_000])),
        ("m.yaml", Hostile("m.yaml", "- ".repeat(30_000).into_bytes())),
        ("a.map", map("type octile\nheight 8192\nwidth 8192\nmap\n.\n")),
        ("a.map", map("type octile\nheight 4294967295\nwidth 4294967295\nmap\n.\n")),
        ("a.map", map(&"height 1\n".repeat(nested))),
        ("a.geojson", json("[".repeat(nested))),
        ("a.geojson", json(format!("{{\"type\":\"GeometryCollection\",\"geometries\":[{}]}}", "{},".repeat(nested)))),
        ("a.geojson", json("{\"type\":\"Polygon\",\"coordinates\":[[[1e400,0],[1,1],[2,0]]]}".to_owned())),
    ];
    for (path, files) in &all {
        let text = format!("[world]\nmap = \"{path}\"\n[[robot]]\nid = \"a\"\nstart_m = [0, 0]\ngoal_m = [1, 1]\n");
        let read = || scenarios::parse_with_files("hostile.toml", &text, &Overrides::default(), files);
        let (problems, peak) = peak_of(|| read().expect_err("it is refused").to_string());
        let size = files.1.len();
        assert!(peak < (1 << 20) + 60 * size, "{path}, {size} bytes: {peak} bytes\n{problems}");
        assert!(problems.contains(&format!("world.map: `{path}`")), "{problems}");
    }
}
