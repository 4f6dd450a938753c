//! A file that appears whole or not at all.
//!
//! It has no name while it is written, so a process that is killed leaves nothing behind: the kernel makes such files
//! (`O_TMPFILE`), and on a file system that cannot, a file loses its name right after it was made and is copied at the
//! end. A finished file takes the place of an older one in one step. A mount point cannot be replaced, and neither can a
//! file in a directory that is not writable: there the content is kept in memory until it is whole, and then written into
//! the file that is there, once room for it has been reserved.

use rustix::fs::{
    AtFlags, CWD, FallocateFlags, MemfdFlags, Mode, OFlags, StatxAttributes, StatxFlags, fallocate, linkat,
    memfd_create, openat, statx,
};
use rustix::io::Errno;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, Write};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

/// A file that is being written.
#[derive(Debug)]
pub struct WholeFile {
    target: PathBuf,
    content: File,
    end: End,
}

/// How the content comes to its place.
#[derive(Debug)]
enum End {
    /// The nameless file gets a name.
    Link,
    /// The content is copied to a new file, which gets the name.
    Copy,
    /// The content is copied into the file that is there.
    Into(File),
}

impl WholeFile {
    /// Begins a file that will be `target`. If `target` is a symbolic link, the link is replaced.
    ///
    /// # Errors
    /// When the file can neither be made nor, if it exists, be written.
    pub fn begin(target: &Path) -> io::Result<WholeFile> {
        WholeFile::begin_where(target, true)
    }

    /// The same on a file system that has files without a name, or has none.
    fn begin_where(target: &Path, tmpfile: bool) -> io::Result<WholeFile> {
        let file = |content, end| WholeFile { target: target.to_path_buf(), content, end };
        let existing = || OpenOptions::new().write(true).open(target);
        if is_mount_point(target) {
            return Ok(file(in_memory()?, End::Into(existing()?)));
        }
        match nameless(target, tmpfile) {
            Ok((content, end)) => Ok(file(content, end)),
            // The directory may not be writable where the file in it is.
            Err(error) => match existing() {
                Ok(place) => Ok(file(in_memory()?, End::Into(place))),
                Err(_) => Err(error),
            },
        }
    }

    /// Gives the file its name, or puts the content into the file that is there.
    ///
    /// # Errors
    /// When that fails. An older file of the name stays then, unless it had to be overwritten: it is empty if that broke
    /// off.
    pub fn finish(self) -> io::Result<()> {
        let WholeFile { target, mut content, end } = self;
        let linked = match end {
            End::Into(mut place) => return overwrite(&mut content, &mut place),
            End::Link => true,
            End::Copy => false,
        };
        // An older file keeps its permissions.
        let permissions = fs::metadata(&target).ok().filter(fs::Metadata::is_file).map(|old| old.permissions());
        let hidden = hidden(&target);
        let _ = fs::remove_file(&hidden);
        let named = if linked { link(&content, &hidden) } else { copy(&mut content, &hidden) };
        let named = named.and_then(|file| match permissions {
            Some(permissions) => file.set_permissions(permissions),
            None => Ok(()),
        });
        named.and_then(|()| fs::rename(&hidden, &target)).or_else(|error| {
            let _ = fs::remove_file(&hidden);
            match Errno::from_io_error(&error) {
                Some(Errno::BUSY | Errno::XDEV) => {
                    overwrite(&mut content, &mut OpenOptions::new().write(true).open(&target)?)
                }
                _ => Err(error),
            }
        })
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.content.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.content.flush()
    }
}

fn is_mount_point(path: &Path) -> bool {
    // Kernels before 5.8 do not tell; there the attempt to replace it does.
    statx(CWD, path, AtFlags::SYMLINK_NOFOLLOW, StatxFlags::empty())
        .is_ok_and(|found| found.stx_attributes.contains(StatxAttributes::MOUNT_ROOT))
}

/// A file without a name in the directory of `target`.
fn nameless(target: &Path, tmpfile: bool) -> io::Result<(File, End)> {
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if tmpfile {
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        if let Ok(file) = openat(CWD, folder, flags, Mode::from_raw_mode(0o666)) {
            return Ok((file.into(), End::Link));
        }
    }
    let hidden = hidden(target);
    let _ = fs::remove_file(&hidden);
    let file = OpenOptions::new().read(true).write(true).create_new(true).open(&hidden)?;
    fs::remove_file(&hidden)?;
    Ok((file, End::Copy))
}

fn in_memory() -> io::Result<File> {
    Ok(memfd_create("shoal", MemfdFlags::CLOEXEC)?.into())
}

fn link(content: &File, name: &Path) -> io::Result<File> {
    // What the disk has no room for shows here, while the older file is still there.
    content.sync_all()?;
    linkat(CWD, format!("/proc/self/fd/{}", content.as_raw_fd()), CWD, name, AtFlags::SYMLINK_FOLLOW)?;
    content.try_clone()
}

fn copy(content: &mut File, name: &Path) -> io::Result<File> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(name)?;
    content.rewind()?;
    io::copy(content, &mut file)?;
    file.sync_all()?;
    Ok(file)
}

/// Replaces what is in a file. Room is reserved first: a full disk leaves it as it was.
fn overwrite(content: &mut File, place: &mut File) -> io::Result<()> {
    let (before, length) = (place.metadata()?.len(), content.metadata()?.len());
    // File systems that cannot reserve room say so with other errors.
    if let Err(error @ (Errno::NOSPC | Errno::DQUOT | Errno::FBIG)) =
        fallocate(&*place, FallocateFlags::empty(), 0, length)
    {
        let _ = place.set_len(before);
        return Err(error.into());
    }
    content.rewind()?;
    place.rewind()?;
    let written = io::copy(content, place).and_then(|_| place.set_len(length)).and_then(|()| place.sync_all());
    // Not a mixture of the two.
    written.inspect_err(|_| _ = place.set_len(0))
}

/// The name of a file until it takes its place.
fn hidden(target: &Path) -> PathBuf {
    // Names have a limit of their own: one that is just short enough must not fail for our sake.
    let name: String = target.file_name().unwrap_or_default().to_string_lossy().chars().take(40).collect();
    target.with_file_name(format!(".{name}.{}.tmp", std::process::id()))
}

#[cfg(test)]
mod tests {
    #![expect(clippy::disallowed_methods, reason = "tests of files")]
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn it_has_no_name_until_it_is_whole_on_any_file_system() {
        for tmpfile in [true, false] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("out");
            let mut file = WholeFile::begin_where(&path, tmpfile).unwrap();
            file.write_all(b"first").unwrap();
            assert!(names(folder.path()).is_empty(), "{tmpfile}");
            drop(file);
            assert!(names(folder.path()).is_empty(), "{tmpfile}: one that is given up leaves nothing");
            for content in ["longer than the next", "second"] {
                let mut file = WholeFile::begin_where(&path, tmpfile).unwrap();
                file.write_all(content.as_bytes()).unwrap();
                file.finish().unwrap();
                assert_eq!(fs::read_to_string(&path).unwrap(), content, "{tmpfile}");
                assert_eq!(names(folder.path()), ["out"], "{tmpfile}");
                fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
            }
            assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640, "{tmpfile}");
        }
    }

    #[test]
    fn what_is_there_can_be_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        for content in ["something longer", "short", "longest of these three"] {
            fs::write(&path, "something that was there").unwrap();
            let mut file = in_memory().unwrap();
            file.write_all(content.as_bytes()).unwrap();
            overwrite(&mut file, &mut OpenOptions::new().write(true).open(&path).unwrap()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), content);
        }
    }

    #[test]
    fn a_directory_that_went_away_is_an_error() {
        for tmpfile in [true, false] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("sub/out");
            assert!(WholeFile::begin_where(&path, tmpfile).is_err());
            fs::create_dir(folder.path().join("sub")).unwrap();
            let file = WholeFile::begin_where(&path, tmpfile).unwrap();
            fs::remove_dir(folder.path().join("sub")).unwrap();
            assert_eq!(file.finish().unwrap_err().kind(), io::ErrorKind::NotFound, "{tmpfile}");
        }
    }
}
