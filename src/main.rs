//! The `idmesh` command: see [`idmesh::cli`].
//!
//! If the memory is exhausted, the standard library aborts the process. The allocator of this
//! program ends the process with a message and the exit code of bad input instead. Large
//! allocations are checked before (`idmesh::memory`), with better messages; this allocator tells of
//! all others. No output is half written then, because outputs get their names when they are whole.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// The exit code of bad input.
const BAD_INPUT: i32 = 3;

#[global_allocator]
static ALLOCATOR: Telling = Telling;

/// The system's allocator, which tells the user if it has no memory left.
struct Telling;

#[allow(unsafe_code, reason = "an allocator has no other interface; each call goes to the system's allocator")]
// SAFETY: all functions return what the system's allocator returns, or not at all.
unsafe impl GlobalAlloc for Telling {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `GlobalAlloc::alloc`.
        told(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `GlobalAlloc::alloc_zeroed`.
        told(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract of `GlobalAlloc::realloc`.
        told(unsafe { System.realloc(old, layout, size) }, size)
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `GlobalAlloc::dealloc`.
        unsafe { System.dealloc(old, layout) }
    }
}

#[inline]
fn told(new: *mut u8, size: usize) -> *mut u8 {
    if new.is_null() {
        end(size);
    }
    new
}

/// Ends the process. Nothing here allocates.
#[cold]
fn end(size: usize) -> ! {
    static TOLD: AtomicBool = AtomicBool::new(false);
    if TOLD.swap(true, Relaxed) {
        // Another thread ends the process just now.
        loop {
            std::thread::sleep(std::time::Duration::from_secs(1));
        }
    }
    let mut text = [0; 256];
    let mut rest = &mut text[..];
    // A progress display has left its line unfinished.
    let line = if std::io::stderr().is_terminal() { "\n" } else { "" };
    let _ = write!(
        rest,
        "{line}error: the memory is exhausted: {size} more bytes are not available\n\
         hint: raise the limit of the process or job, or take fewer threads (RAYON_NUM_THREADS)\n"
    );
    let left = rest.len();
    let _ = std::io::stderr().write_all(&text[..text.len() - left]);
    exit()
}

/// Ends the process without the functions that run at an exit, which could allocate.
#[cfg(unix)]
#[allow(unsafe_code, reason = "the standard library has only the exit that runs these functions")]
fn exit() -> ! {
    unsafe extern "C" {
        fn _exit(code: std::ffi::c_int) -> !;
    }
    // SAFETY: POSIX has this function, with this type; it may be called at any time.
    unsafe { _exit(BAD_INPUT) }
}

#[cfg(not(unix))]
fn exit() -> ! {
    std::process::exit(BAD_INPUT)
}

/// Makes a file beyond the limit of the process's file sizes (`ulimit -f`) an error of writing. By
/// default the system ends the process without a message.
#[cfg(any(target_os = "linux", target_os = "macos"))]
#[allow(unsafe_code, reason = "the standard library has no signals")]
fn ignore_the_file_size_signal() {
    unsafe extern "C" {
        fn signal(number: std::ffi::c_int, handler: usize) -> usize;
    }
    const SIGXFSZ: std::ffi::c_int = 25;
    const SIG_IGN: usize = 1;
    // SAFETY: POSIX has this function; `SIG_IGN` is a handler, and no other thread runs yet.
    unsafe { signal(SIGXFSZ, SIG_IGN) };
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
fn ignore_the_file_size_signal() {}

/// Whether the process was started without a standard output (`>&-`). What is written there would
/// be lost without an error: before `main` the standard library opens `/dev/null` in its place.
static STDOUT_IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Looks at standard output before the standard library does.
#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "nothing safe runs before the standard library")]
mod before_main {
    use std::ffi::c_int;

    unsafe extern "C" {
        fn fcntl(file: c_int, command: c_int, ...) -> c_int;
    }
    const STDOUT: c_int = 1;
    const F_GETFD: c_int = 1;

    extern "C" fn look() {
        // SAFETY: POSIX has this function, with this type; this command takes no more arguments and
        // changes nothing.
        let flags = unsafe { fcntl(STDOUT, F_GETFD) };
        super::STDOUT_IS_CLOSED.store(flags == -1, super::Relaxed);
    }

    // SAFETY: the system calls the functions in this section once, before `main`. The function
    // needs nothing of the standard library.
    #[used]
    #[unsafe(link_section = ".init_array")]
    static LOOK: extern "C" fn() = look;
}

/// Lets all threads take memory from one place if the process has a limit of addresses. By default
/// glibc sets 64 MiB of addresses aside for each new thread. If this leaves none, the next thread
/// cannot start, and glibc or the standard library aborts the process.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "the standard library cannot set up glibc's allocator")]
fn share_limited_addresses() {
    unsafe extern "C" {
        fn mallopt(parameter: std::ffi::c_int, value: std::ffi::c_int) -> std::ffi::c_int;
    }
    const M_ARENA_MAX: std::ffi::c_int = -8;
    if idmesh::memory::has_limit_of_addresses() {
        // SAFETY: glibc has this function, with this type, and no other thread runs yet.
        unsafe { mallopt(M_ARENA_MAX, 1) };
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn share_limited_addresses() {}

/// Keeps a Vulkan layer quiet. Mesa's layer that sorts the devices asks Wayland which one draws on
/// the screen. Where the folder of Wayland's sockets is not named, libwayland prints an error,
/// which reads like one of ours. Any absolute path will do: Wayland is not reached either way, so
/// the devices and their order stay the same.
#[cfg(all(target_os = "linux", feature = "gpu"))]
#[allow(unsafe_code, reason = "a change of the environment is unsafe beside other threads")]
fn quieten_wayland() {
    const NAME: &str = "XDG_RUNTIME_DIR";
    // As libwayland judges it.
    let is_named = std::env::var_os(NAME).is_some_and(|folder| folder.as_encoded_bytes().starts_with(b"/"));
    if !is_named {
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var(NAME, "/nonexistent") };
    }
}

#[cfg(not(all(target_os = "linux", feature = "gpu")))]
fn quieten_wayland() {}

fn main() -> ExitCode {
    ignore_the_file_size_signal();
    share_limited_addresses();
    quieten_wayland();
    idmesh::cli::main(STDOUT_IS_CLOSED.load(Relaxed))
}
