//! Injection of faults in the middle of any call.

use std::hint::black_box;
use std::sync::Mutex;
use std::time::Duration;

use crate::fault::{CallSite, Misbehavior, due};

/// Bytes of one memory leak.
const LEAKED_BYTES: usize = 64 << 10;
/// Descriptors that are closed, after the standard ones.
const CLOSED: std::ops::Range<i32> = 3..64;
/// Size of an allocation that cannot succeed, bytes.
const TOO_MUCH: usize = 1 << 62;

/// Counts a call and injects its fault. A kind that corrupts results is returned for the caller to
/// apply.
pub(crate) fn inject(at: CallSite) -> Option<Misbehavior> {
    let kind = due(at)?;
    match kind {
        Misbehavior::Panic => panic!("told to panic at {at:?}"),
        Misbehavior::IndexOutOfBounds => {
            let values = vec![at; black_box(3)];
            black_box(values[black_box(7)]);
        }
        Misbehavior::PanicInDrop => drop(Bomb(at)),
        // SAFETY: none; the fault is the purpose.
        Misbehavior::Segfault => unsafe {
            black_box(std::ptr::without_provenance_mut::<u8>(8)).write_volatile(1)
        },
        Misbehavior::StackOverflow => {
            black_box(recurse(black_box(0)));
        }
        Misbehavior::Abort => std::process::abort(),
        Misbehavior::Exit => std::process::exit(0),
        Misbehavior::AllocationFailure => {
            black_box(Vec::<u8>::with_capacity(black_box(TOO_MUCH)));
        }
        Misbehavior::EndlessLoop => loop {
            std::hint::spin_loop();
        },
        Misbehavior::Deadlock => deadlock(),
        Misbehavior::DoubleFree => double_free(),
        Misbehavior::CloseDescriptors => {
            for descriptor in CLOSED {
                // SAFETY: none; the descriptors are others' and the fault is the purpose.
                unsafe { libc::close(descriptor) };
            }
        }
        Misbehavior::LeakMemory => {
            Vec::leak(black_box(vec![1_u8; LEAKED_BYTES]));
        }
        Misbehavior::LeakDescriptor => {
            std::mem::forget(std::fs::File::open("/dev/null"));
        }
        Misbehavior::LeakThread => {
            let _ = std::thread::Builder::new().name("left_behind".into()).spawn(|| {
                std::thread::sleep(Duration::from_secs(3600));
            });
        }
        Misbehavior::WrongStructSize
        | Misbehavior::NotUtf8
        | Misbehavior::NotFinite
        | Misbehavior::OutOfRange
        | Misbehavior::NullResult
        | Misbehavior::Overrun
        | Misbehavior::Flood
        | Misbehavior::AfterStop
        | Misbehavior::MissingVerdict
        | Misbehavior::VerdictOutOfRange
        | Misbehavior::UnknownWithoutReason
        | Misbehavior::SeverityOfNormal => return Some(kind),
    }
    None
}

struct Bomb(CallSite);

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
