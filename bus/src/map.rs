//! Files on tmpfs that several processes map: the only module that turns addresses into references.

use crate::{Address, BusError, Result};
use model::MapRef;
use rustix::fs::{FallocateFlags, Mode, OFlags};
use rustix::mm::{MapFlags, ProtFlags};
use std::path::Path;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// A mapped file. Words in it are only ever touched as atomics, byte ranges only through [`Mapping::write`] and
/// [`Mapping::read`], so a process that misbehaves can spoil values but not our memory safety.
pub(crate) struct Mapping {
    base: NonNull<u8>,
    len: usize,
}

// SAFETY: the mapping is a plain range of shared memory, not tied to a thread; access is through atomics, or through
// `read` and `write`, whose callers order them.
unsafe impl Send for Mapping {}
// SAFETY: as above.
unsafe impl Sync for Mapping {}

impl Mapping {
    /// Makes a file of `len` zero bytes in the root, lets `fill` write its beginning, and only then gives it its name:
    /// whoever opens it finds it whole. All of its memory is reserved here, so a full tmpfs is an error now, not a
    /// SIGBUS later.
    pub(crate) fn create(address: &Address, name: &str, len: usize, fill: impl FnOnce(&Mapping)) -> Result<Mapping> {
        let path = address.file(name);
        let draft = address.file(&format!("{name}.draft{}", rustix::process::getpid().as_raw_nonzero()));
        let failed = |action: &'static str| {
            let path = &path;
            move |e: rustix::io::Errno| BusError::io(path, action, e)
        };
        let flags = OFlags::RDWR | OFlags::CREATE | OFlags::TRUNC | OFlags::CLOEXEC | OFlags::NOFOLLOW;
        let file = rustix::fs::open(&draft, flags, Mode::RUSR | Mode::WUSR).map_err(failed("make the file"))?;
        let made = rustix::io::retry_on_intr(|| rustix::fs::fallocate(&file, FallocateFlags::empty(), 0, len as u64))
            .map_err(failed("reserve its memory"))
            .and_then(|()| Mapping::map(&path, &file, len))
            .and_then(|mapping| {
                fill(&mapping);
                // Everything above becomes visible before the name does: the rename is a system call, and the opener
                // goes through the same directory.
                std::sync::atomic::fence(Ordering::Release);
                rustix::fs::rename(&draft, &path).map_err(failed("name the file"))?;
                Ok(mapping)
            });
        if made.is_err() {
            let _ = rustix::fs::unlink(&draft);
        }
        made
    }

    /// Maps a file in the root that another process made. `magic` is what its first word must be.
    pub(crate) fn open(address: &Address, name: &str, magic: u64) -> Result<Mapping> {
        let path = address.file(name);
        let file = rustix::fs::open(&path, OFlags::RDWR | OFlags::CLOEXEC | OFlags::NOFOLLOW, Mode::empty())
            .map_err(|e| BusError::io(&path, "open the file", e))?;
        let size = rustix::fs::fstat(&file).map_err(|e| BusError::io(&path, "open the file", e))?.st_size;
        let len = usize::try_from(size).unwrap_or(0);
        let damaged = || {
            BusError::new(
                format!("`{}`", path.display()),
                "use the file",
                "it has not the form that this build expects",
                "all processes of a fleet must come from the same build",
            )
        };
        if len < 64 {
            return Err(damaged());
        }
        let mapping = Mapping::map(&path, &file, len)?;
        if mapping.u64_at(0).load(Ordering::Acquire) == magic { Ok(mapping) } else { Err(damaged()) }
    }

    fn map(path: &Path, file: &impl std::os::fd::AsFd, len: usize) -> Result<Mapping> {
        // POPULATE: page faults belong to the start, not to the loop.
        let (protection, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED | MapFlags::POPULATE);
        // SAFETY: a fresh mapping at an address of the kernel's choice replaces nothing.
        let base = unsafe { rustix::mm::mmap(std::ptr::null_mut(), len, protection, flags, file, 0) }
            .map_err(|e| BusError::io(path, "map the file", e))?;
        let base = NonNull::new(base.cast::<u8>()).expect("mmap does not return null");
        Ok(Mapping { base, len })
    }

    /// How many bytes it has.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// The 32-bit word at this offset.
    pub(crate) fn u32_at(&self, offset: usize) -> &AtomicU32 {
        assert!(offset.is_multiple_of(4) && offset + 4 <= self.len, "word {offset} of {}", self.len);
        // SAFETY: in bounds and aligned (the base is page aligned), and alive as long as `self`. Every process touches
        // this word as an atomic only.
        unsafe { self.base.add(offset).cast::<AtomicU32>().as_ref() }
    }

    /// The 64-bit word at this offset.
    pub(crate) fn u64_at(&self, offset: usize) -> &AtomicU64 {
        assert!(offset.is_multiple_of(8) && offset + 8 <= self.len, "word {offset} of {}", self.len);
        // SAFETY: as for `u32_at`.
        unsafe { self.base.add(offset).cast::<AtomicU64>().as_ref() }
    }

    /// Copies bytes in. The caller owns this range until it publishes it with a `Release` store of a word.
    pub(crate) fn write(&self, offset: usize, bytes: &[u8]) {
        assert!(offset.checked_add(bytes.len()).is_some_and(|end| end <= self.len));
        // SAFETY: in bounds; `bytes` is private memory, so the two do not overlap.
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), self.base.add(offset).as_ptr(), bytes.len()) }
    }

    /// Copies bytes out. The caller has seen, with `Acquire`, the word that published this range.
    pub(crate) fn read(&self, offset: usize, bytes: &mut [u8]) {
        assert!(offset.checked_add(bytes.len()).is_some_and(|end| end <= self.len));
        // SAFETY: in bounds; `bytes` is private memory, so the two do not overlap. Any bytes are valid `u8`s.
        unsafe { std::ptr::copy_nonoverlapping(self.base.add(offset).as_ptr(), bytes.as_mut_ptr(), bytes.len()) }
    }
}

/// Name of the file in the run's root that holds the walls of the scenario's map.
const WALLS: &str = "map";
/// Name of the file that holds what shortest ways need of it.
const WAYS: &str = "ways";

/// A file of the root that this process maps to read it.
struct Frozen(Mapping);

impl AsRef<[u8]> for Frozen {
    fn as_ref(&self) -> &[u8] {
        // SAFETY: in bounds and alive as long as `self`. Nothing writes to the file: the daemon makes it (`freeze`) and takes the right
        // to write away before it starts any other process of the fleet.
        unsafe { std::slice::from_raw_parts(self.0.base.as_ptr(), self.0.len) }
    }
}

/// Makes a file of the root that nothing writes to any more.
fn freeze(address: &Address, name: &str, bytes: &[u8]) -> Result<()> {
    drop(Mapping::create(address, name, bytes.len(), |mapping| mapping.write(0, bytes))?);
    let path = address.file(name);
    rustix::fs::chmod(&path, Mode::RUSR).map_err(|e| BusError::io(&path, "make it read-only", e))
}

/// Maps such a file.
fn frozen(address: &Address, name: &str) -> Result<Frozen> {
    let path = address.file(name);
    let failed = |e: rustix::io::Errno| BusError::io(&path, "open the file", e);
    let file =
        rustix::fs::open(&path, OFlags::RDONLY | OFlags::CLOEXEC | OFlags::NOFOLLOW, Mode::empty()).map_err(failed)?;
    let len = usize::try_from(rustix::fs::fstat(&file).map_err(failed)?.st_size).unwrap_or(0);
    if len == 0 {
        return Err(damaged(address, name, "it is empty".to_owned()));
    }
    // POPULATE: page faults belong to the start, not to the loop.
    // SAFETY: a fresh mapping at an address of the kernel's choice replaces nothing.
    let base = unsafe {
        rustix::mm::mmap(std::ptr::null_mut(), len, ProtFlags::READ, MapFlags::SHARED | MapFlags::POPULATE, &file, 0)
    }
    .map_err(|e| BusError::io(&path, "map the file", e))?;
    let base = NonNull::new(base.cast::<u8>()).expect("mmap does not return null");
    Ok(Frozen(Mapping { base, len }))
}

fn damaged(address: &Address, name: &str, why: String) -> BusError {
    let way_out = "all processes of a fleet must come from the same build; start it again";
    BusError::new(format!("`{}`", address.file(name).display()), "use the file", why, way_out)
}

/// Puts the walls of a scenario's map into the root, where every process of the run maps them.
///
/// # Errors
/// When shared memory has no room for them.
pub fn freeze_map(address: &Address, map: &MapRef) -> Result<()> {
    freeze(address, WALLS, map.map().bytes())
}

/// Attaches the walls of the run's map to what was read of its scenario, if that has a map.
///
/// # Errors
/// When they cannot be read, or are damaged.
pub fn attach_map(address: &Address, map: Option<&mut MapRef>) -> Result<()> {
    let Some(map) = map else { return Ok(()) };
    map.attach(frozen(address, WALLS)?).map_err(|problem| damaged(address, WALLS, problem.to_string()))
}

/// Puts what shortest ways need of the map into the root, where agents read it.
///
/// # Errors
/// When shared memory has no room for it.
pub fn freeze_ways(address: &Address, links: &[u8]) -> Result<()> {
    freeze(address, WAYS, links)
}

/// Lets `take` have that for the rest of the process's life, if there is any; `take` says whether it is whole.
///
/// # Errors
/// When it cannot be read, or is damaged.
pub fn attach_ways(address: &Address, take: impl FnOnce(&'static [u8]) -> bool) -> Result<()> {
    let links: &'static Frozen = match frozen(address, WAYS) {
        // The mapping ends with the process.
        Ok(links) => Box::leak(Box::new(links)),
        Err(error) if error.is_missing() => return Ok(()),
        Err(error) => return Err(error),
    };
    if take(links.as_ref()) { Ok(()) } else { Err(damaged(address, WAYS, "it is not whole".to_owned())) }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: this is the range that `map` made, and no reference into it outlives `self`. An error would mean a
        // wrong range, and there is nothing to do about it here.
        let _ = unsafe { rustix::mm::munmap(self.base.as_ptr().cast(), self.len) };
    }
}
