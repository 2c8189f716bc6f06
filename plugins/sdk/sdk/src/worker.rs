//! Worker threads of plugins, with cooperative cancellation.

use std::future::poll_fn;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::clock::Clock;
use crate::{Error, Host, LinkState, LogLevel, Reason, SampleSink, TagSpec};

/// Longest time that dropping a [`Worker`] waits for its thread. The host gives `stop` two seconds.
pub const MAX_STOP: Duration = Duration::from_millis(1500);
/// Period at which a drop checks whether the thread has ended.
const STOP_CHECK: Duration = Duration::from_millis(1);
/// Shortest and longest delay between two sessions of [`Worker::serve`].
const MIN_RETRY: Duration = Duration::from_millis(500);
const MAX_RETRY: Duration = Duration::from_secs(30);

/// Thread that runs until it is dropped.
///
/// ```
/// use std::time::Duration;
/// use busbar_plugin_sdk::{Sample, SampleSink, Value, Worker};
/// use busbar_plugin_sdk::testing::{Recorder, TestClock};
///
/// let (clock, recorder) = (TestClock::new(), Recorder::new());
/// let sink = recorder.sink();
/// let worker = Worker::start(&clock.host(), "ramp", move |running| {
///     let mut value = 0;
///     while running.wait(Duration::from_secs(60)) {
///         value += 1;
///         sink.publish(&[Sample::good(7, Value::I64(value))]);
///     }
/// })?;
/// clock.advance(Duration::from_secs(60));
/// assert!(recorder.wait_until(Duration::from_secs(5), |seen| seen.samples.len() == 1));
/// drop(worker);
/// # Ok::<(), busbar_plugin_sdk::Error>(())
/// ```
pub struct Worker {
    running: StopToken,
    thread: Option<JoinHandle<()>>,
    host: Host,
    name: String,
}

/// Stop token of a worker's thread: it reports whether the thread shall continue.
#[derive(Clone)]
pub struct StopToken {
    stop: Arc<Mutex<Stop>>,
    clock: Clock,
}

#[derive(Default)]
struct Stop {
    is_wanted: bool,
    /// Waker of the task in [`StopToken::stopped`].
    waker: Option<Waker>,
}

impl StopToken {
    /// Reports whether the thread shall continue. A loop that blocks elsewhere asks at least every
    /// second.
    pub fn is_running(&self) -> bool {
        !self.stop.lock().unwrap_or_else(PoisonError::into_inner).is_wanted
    }

    /// Completes when the worker is dropped, for threads with an event loop of their own. One task
    /// at a time may wait for it.
    pub fn stopped(&self) -> impl Future<Output = ()> + Send + use<> {
        let stop = Arc::clone(&self.stop);
        poll_fn(move |context: &mut Context<'_>| {
            let mut stop = stop.lock().unwrap_or_else(PoisonError::into_inner);
            if stop.is_wanted {
                return Poll::Ready(());
            }
            stop.waker = Some(context.waker().clone());
            Poll::Pending
        })
    }

    fn end(&self) {
        let mut stop = self.stop.lock().unwrap_or_else(PoisonError::into_inner);
        stop.is_wanted = true;
        let waker = stop.waker.take();
        drop(stop);
        if let Some(waker) = waker {
            waker.wake();
        }
        self.clock.wake();
    }

    /// Waits, at most until the worker is dropped; returns whether the thread shall continue.
    pub fn wait(&self, duration: Duration) -> bool {
        self.clock.wait(duration, || !self.is_running());
        self.is_running()
    }
}

impl Worker {
    /// Starts a thread of this name.
    ///
    /// # Errors
    /// [`Error::failed`] when the system has no thread left.
    pub fn start(
        host: &Host,
        name: &str,
        work: impl FnOnce(&StopToken) + Send + 'static,
    ) -> Result<Self, Error> {
        let running = StopToken { stop: Arc::default(), clock: host.clock().clone() };
        let handed = running.clone();
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || work(&handed))
            .map_err(|error| Error::failed(format!("cannot start the thread {name}: {error}")))?;
        Ok(Self { running, thread: Some(thread), host: host.clone(), name: name.to_owned() })
    }

    /// Starts a thread that serves `tags` from a device. It runs `session`, which connects, reports
    /// the link as up, and publishes for as long as all is well. When the session ends, the link is
    /// reported as down, and the tags are bad (communication). The session runs again after half a
    /// second, then a second, and so on up to thirty.
    ///
    /// # Errors
    /// Returns the errors of [`Worker::start`].
    pub fn serve<E: std::fmt::Display>(
        host: &Host,
        name: &str,
        tags: &[TagSpec],
        sink: SampleSink,
        mut session: impl FnMut(&SampleSink, &StopToken) -> Result<(), E> + Send + 'static,
    ) -> Result<Self, Error> {
        let tags: Vec<_> = tags.iter().map(|tag| tag.tag).collect();
        Self::start(host, name, move |running| {
            let mut delay = MIN_RETRY;
            sink.report_link(LinkState::Connecting, "connecting");
            while running.is_running() {
                let started = Instant::now();
                let fault = match session(&sink, running) {
                    _ if !running.is_running() => return,
                    Ok(()) => "the connection ended".to_owned(),
                    Err(fault) => fault.to_string(),
                };
                // What held for a while deserves a quick second try.
                delay = if started.elapsed() > MAX_RETRY { MIN_RETRY } else { delay };
                sink.report_link(LinkState::Down, &fault);
                sink.publish_bad(tags.iter().copied(), Reason::Communication);
                running.wait(delay);
                delay = (delay * 2).min(MAX_RETRY);
            }
        })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.running.end();
        let Some(thread) = self.thread.take() else { return };
        let deadline = Instant::now() + MAX_STOP;
        while !thread.is_finished() && Instant::now() < deadline {
            std::thread::sleep(STOP_CHECK);
        }
        let name = &self.name;
        if !thread.is_finished() {
            let text = format!("the thread {name} did not end in time and was left behind");
            self.host.log(LogLevel::Error, &text);
        } else if thread.join().is_err() {
            let text = format!("the thread {name} had panicked: a fault of the plugin");
            self.host.log(LogLevel::Error, &text);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;
    use crate::testing::{Recorder, TestClock, host, tag_spec};
    use crate::{Quality, ValueKind};

    const LONG: Duration = Duration::from_secs(3600);

    #[test]
    fn dropping_ends_a_long_wait_at_once() {
        let started = Instant::now();
        let worker = Worker::start(&host(), "test", |running| assert!(!running.wait(LONG)));
        drop(worker.unwrap());
        assert!(started.elapsed() < MAX_STOP);
    }

    #[test]
    fn dropping_wakes_an_event_loop() {
        struct Unpark(std::thread::Thread);
        impl std::task::Wake for Unpark {
            fn wake(self: Arc<Self>) {
                self.0.unpark();
            }
        }
        let (sender, events) = channel();
        let worker = Worker::start(&host(), "test", move |running| {
            let mut stopped = std::pin::pin!(running.stopped());
            let waker = Arc::new(Unpark(std::thread::current())).into();
            while stopped.as_mut().poll(&mut Context::from_waker(&waker)).is_pending() {
                sender.send("waits").unwrap();
                std::thread::park();
            }
            sender.send("ends").unwrap();
        });
        events.recv_timeout(Duration::from_secs(5)).unwrap();
        drop(worker.unwrap());
        assert_eq!(events.iter().last(), Some("ends"));
    }

    #[test]
    fn a_test_clock_moves_only_when_told() {
        let clock = TestClock::new();
        let (sender, ticks) = channel();
        let worker = Worker::start(&clock.host(), "test", move |running| {
            while running.wait(LONG) {
                sender.send(()).unwrap();
            }
        });
        clock.advance(LONG / 2);
        assert!(ticks.recv_timeout(Duration::from_millis(50)).is_err());
        clock.advance(LONG / 2);
        ticks.recv_timeout(Duration::from_secs(5)).unwrap();
        drop(worker.unwrap());
        assert!(ticks.recv().is_err());
    }

    #[test]
    fn a_session_that_fails_is_tried_again_later_and_later() {
        let (clock, recorder) = (TestClock::new(), Recorder::new());
        let tags = [tag_spec(4, "a", ValueKind::F64, "a".into())];
        let (sender, tries) = channel();
        let session = move |_: &SampleSink, _: &StopToken| {
            sender.send(()).unwrap();
            Err("no answer")
        };
        let worker = Worker::serve(&clock.host(), "test", &tags, recorder.sink(), session).unwrap();
        for delay in [MIN_RETRY, MIN_RETRY * 2, MIN_RETRY * 4] {
            tries.recv_timeout(Duration::from_secs(5)).unwrap();
            clock.advance(delay / 2);
            assert!(tries.recv_timeout(Duration::from_millis(20)).is_err(), "{delay:?}");
            clock.advance(delay / 2);
        }
        drop(worker);
        let recording = recorder.recording();
        let bad = Quality::Bad(Reason::Communication);
        assert!(recording.samples.iter().all(|sample| sample.tag == 4 && sample.quality == bad));
        assert_eq!(recording.links.back().unwrap().1, "no answer");
    }
}
