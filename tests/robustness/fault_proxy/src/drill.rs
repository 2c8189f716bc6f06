//! Endurance test of adapters: connections that break in all ways, and so many of them that leaks
//! show.

use std::time::{Duration, Instant};

use crate::{ConnectionFault, FaultProxy, FaultScript, ResourceUsage};

/// Complete list of connection faults.
pub const ALL_FAULTS: [ConnectionFault; 9] = [
    ConnectionFault::None,
    ConnectionFault::Split,
    ConnectionFault::Delay,
    ConnectionFault::Reset,
    ConnectionFault::Close,
    ConnectionFault::Vanish,
    ConnectionFault::Trickle,
    ConnectionFault::Garbage,
    ConnectionFault::Swap,
];
/// Faults that do not end the connection.
pub const ENDLESS_FAULTS: [ConnectionFault; 3] =
    [ConnectionFault::None, ConnectionFault::Split, ConnectionFault::Delay];
/// Longest time of a drill.
pub const MAX_DRILL: Duration = Duration::from_secs(120);
/// Descriptors and threads that an adapter, a proxy and their connections may hold at once,
/// beside those that were there before.
const MAX_DESCRIPTORS: usize = 24;
const MAX_THREADS: usize = 8;
/// Lowest rate of struck connections: one in this many.
const STRUCK: u64 = 4;
/// Polling period of the resource usage.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// Checks values that say which tag they are of, in bits 24 and up, and when they were made, by
/// a number that counts up below: none is of another tag, and none older than one before. How
/// many there were of each tag.
///
/// # Panics
/// Panics if a value is of another tag, or older than one before it.
#[track_caller]
pub fn check_stamps<const N: usize>(values: &[(u32, i64)], tags: [u32; N]) -> [usize; N] {
    tags.map(|tag| {
        let (mut newest, mut count) = (0, 0);
        for (_, value) in values.iter().filter(|(of, _)| *of == tag) {
            let (owner, number) = (value >> 24, value & 0xFF_FFFF);
            assert_eq!(owner, i64::from(tag), "a value of another tag");
            assert!(number >= newest, "tag {tag}: {number} after {newest}");
            (newest, count) = (number, count + 1);
        }
        count
    })
}

impl FaultProxy {
    /// Waits until `count` connections have come and broken; every `pause` it closes one whose
    /// fault is among `endless`.
    ///
    /// # Panics
    /// When there are not as many within [`MAX_DRILL`], or hardly any was struck.
    #[track_caller]
    pub fn break_all(
        &self,
        script: &FaultScript,
        count: u64,
        pause: Duration,
        endless: &[ConnectionFault],
    ) {
        let deadline = Instant::now() + MAX_DRILL;
        while self.connections() < count {
            assert!(Instant::now() < deadline, "{} connections", self.connections());
            std::thread::sleep(pause);
            let last = self.connections().saturating_sub(1);
            if endless.contains(&script.plan(last).fault) {
                self.hang_up();
            }
        }
        assert!(self.strikes() >= count / STRUCK, "{} strikes", self.strikes());
    }

    /// Waits for `count` connections, while this process holds hardly more than `before`.
    ///
    /// # Panics
    /// When there are not as many within [`MAX_DRILL`], or more is held.
    #[track_caller]
    pub fn wear_out(&self, count: u64, before: ResourceUsage) {
        let deadline = Instant::now() + MAX_DRILL;
        let mut most = before;
        while self.connections() < count {
            assert!(Instant::now() < deadline, "{} connections", self.connections());
            std::thread::sleep(LOOK_PERIOD);
            most = most.max(ResourceUsage::now());
        }
        assert!(most.descriptors <= before.descriptors + MAX_DESCRIPTORS, "{before:?}, {most:?}");
        assert!(most.threads <= before.threads + MAX_THREADS, "{before:?}, {most:?}");
    }
}
