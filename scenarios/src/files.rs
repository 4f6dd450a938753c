//! The files that a scenario names, such as its map. The reader of a scenario says where they are.

use std::fmt;

/// Where the path of a file stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NamedIn {
    /// In the scenario: it is relative to the folder of the scenario's file.
    Scenario,
    /// In an option of the command line: it is relative to the folder in which that was given.
    Option,
}

/// Reads the files that a scenario names.
pub trait Files: fmt::Debug {
    /// The bytes of a file of at most `bytes_max` bytes.
    ///
    /// # Errors
    /// Why there are none, as what follows `file: `.
    fn read(&self, path: &str, named_in: NamedIn, bytes_max: u64) -> Result<Vec<u8>, String>;
}

/// There are no files: for scenarios that name none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Files for NoFiles {
    fn read(&self, _: &str, _: NamedIn, _: u64) -> Result<Vec<u8>, String> {
        Err("it cannot be read here: this scenario comes without files".to_owned())
    }
}

/// The path of a file that another file names: relative to the folder of that one.
pub(crate) fn beside(path: &str, named: &str) -> String {
    match path.rsplit_once('/') {
        Some((folder, _)) if !named.starts_with('/') => format!("{folder}/{named}"),
        _ => named.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_relative_to_the_file_that_names_it() {
        assert_eq!(beside("map.yaml", "map.pgm"), "map.pgm");
        assert_eq!(beside("maps/a/map.yaml", "../b.pgm"), "maps/a/../b.pgm");
        assert_eq!(beside("maps/map.yaml", "/srv/b.pgm"), "/srv/b.pgm");
    }
}
