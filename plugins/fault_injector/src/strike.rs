//! Injection of faults in the middle of any call.

use std::hint::black_box;
use std::sync::Mutex;
use std::time::Duration;

use crate::fault::{At, Kind, due};

/// Bytes of one memory leak.
const LEAKED_BYTES: usize = 64 << 10;
/// Descriptors that are closed, after the standard ones.
const CLOSED: std::ops::Range<i32> = 3..64;
/// Size of an allocation that cannot succeed, bytes.
const TOO_MUCH: usize = 1 << 62;

/// Counts a call and injects its fault. A kind that corrupts results is returned for the caller to
/// apply.
pub(crate) fn strike(at: At) -> Option<Kind> {
    let kind = due(at)?;
    match kind {
        Kind::Panic => panic!("told to panic at {at:?}"),
        Kind::IndexOutOfBounds => {
            let values = vec![at; black_box(3)];
            black_box(values[black_box(7)]);
        }
        Kind::PanicInDrop => drop(Bomb(at)),
        // SAFETY: none; the fault is the purpose.
        Kind::Segfault => unsafe {
            black_box(std::ptr::without_provenance_mut::<u8>(8)).write_volatile(1)
        },
        Kind::StackOverflow => {
            black_box(recurse(black_box(0)));
        }
        Kind::Abort => std::process::abort(),
        Kind::Exit => std::process::exit(0),
        Kind::AllocationFailure => {
            black_box(Vec::<u8>::with_capacity(black_box(TOO_MUCH)));
        }
        Kind::EndlessLoop => loop {
            std::hint::spin_loop();
        },
        Kind::Deadlock => deadlock(),
        Kind::DoubleFree => double_free(),
        Kind::CloseDescriptors => {
            for descriptor in CLOSED {
                // SAFETY: none; the descriptors are others' and the fault is the purpose.
                unsafe { libc::close(descriptor) };
            }
        }
        Kind::LeakMemory => {
            Vec::leak(black_box(vec![1_u8; LEAKED_BYTES]));
        }
        Kind::LeakDescriptor => {
            std::mem::forget(std::fs::File::open("/dev/null"));
        }
        Kind::LeakThread => {
            let _ = std::thread::Builder::new().name("left_behind".into()).spawn(|| {
                std::thread::sleep(Duration::from_secs(3600));
            });
        }
        Kind::LieAboutSize
        | Kind::NotUtf8
        | Kind::NotFinite
        | Kind::OutOfRange
        | Kind::NullResult
        | Kind::Overrun
        | Kind::Flood
        | Kind::AfterStop
        | Kind::MissingVerdict
        | Kind::VerdictOutOfRange
        | Kind::UnknownWithoutReason => return Some(kind),
    }
    None
}

struct Bomb(At);

impl Drop for Bomb {
    fn drop(&mut self) {
        panic!("told to panic in drop at {:?}", self.0);
    }
}

#[allow(unconditional_recursion, reason = "the fault is the purpose")]
fn recurse(depth: u64) -> u64 {
    let frame = black_box([depth; 64]);
    recurse(frame[1] + 1) + frame[0]
}

fn deadlock() {
    static LOCK: Mutex<()> = Mutex::new(());
    let _first = LOCK.lock();
    let _second = LOCK.lock();
}

fn double_free() {
    // SAFETY: none; the second `free` is the fault, which is the purpose.
    unsafe {
        let block = black_box(libc::malloc(24));
        libc::free(block);
        libc::free(black_box(block));
    }
}
