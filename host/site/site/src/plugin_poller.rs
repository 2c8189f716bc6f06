//! Polling of plugins beside the frames: a call may take as long as the plugin takes, so that each
//! polled plugin has a thread of its own.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_plugin_host::PluginError;
use busbar_plugin_process::Plugin;

/// Capability of a plugin that is polled, with what is known of it.
pub(crate) trait PolledCapability: Sized + Send + 'static {
    /// Word for what is read: the thread's name, and in messages.
    const SUBJECT: &'static str;
    /// Period of polling, from the end of one poll to the next.
    const PERIOD: Duration;
    /// State that poller and site share.
    type State: Default + Send + 'static;

    /// Finds the capability of a plugin.
    ///
    /// # Errors
    /// A plugin without the capability.
    fn from_plugin(plugin: &Plugin) -> Result<Self, PluginError>;

    /// Forgets the known revision: what another process counts may be the same by chance.
    fn forget(&mut self);

    /// Reads what is new. Runs without the lock but where it publishes what was read.
    fn poll(&mut self, plugin: &Plugin, shared: &SharedState<Self::State>);

    /// Takes a request out of the state; reports whether there is one. It is answered before the
    /// next poll.
    fn take_request(&mut self, state: &mut Self::State) -> bool {
        let _ = state;
        false
    }

    /// Answers the request that was taken.
    fn answer(&mut self, shared: &SharedState<Self::State>) {
        let _ = shared;
    }
}

/// State under a lock, shared with a polling thread.
pub(crate) struct SharedState<T> {
    inner: Mutex<Inner<T>>,
    changed: Condvar,
}

struct Inner<T> {
    ends: bool,
    polls: u64,
    state: T,
}

impl<T> SharedState<T> {
    /// Calls a function with the state, under the lock.
    pub(crate) fn with<R>(&self, act: impl FnOnce(&mut T) -> R) -> R {
        act(&mut self.inner().state)
    }

    fn inner(&self) -> MutexGuard<'_, Inner<T>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits while a condition holds, at most until an instant.
    fn wait_while(
        &self,
        until: Instant,
        mut holds: impl FnMut(&mut Inner<T>) -> bool,
    ) -> MutexGuard<'_, Inner<T>> {
        let left = until.saturating_duration_since(Instant::now());
        let waited = self.changed.wait_timeout_while(self.inner(), left, |inner| holds(inner));
        waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Poller of one plugin. Its thread ends when it is dropped.
pub(crate) struct PluginPoller<C: PolledCapability> {
    shared: Arc<SharedState<C::State>>,
    thread: Option<JoinHandle<()>>,
}

impl<C: PolledCapability> PluginPoller<C> {
    /// Starts the thread that polls a plugin.
    ///
    /// # Errors
    /// A plugin without the capability, or no thread.
    pub(crate) fn start(plugin: &Plugin) -> Result<Self, PluginError> {
        let capability = C::from_plugin(plugin)?;
        let inner = Inner { ends: false, polls: 0, state: C::State::default() };
        let shared = Arc::new(SharedState { inner: Mutex::new(inner), changed: Condvar::new() });
        let (theirs, plugin) = (shared.clone(), plugin.clone());
        let id = plugin.info().id.clone();
        let work = move || run(capability, &plugin, &theirs);
        let thread = std::thread::Builder::new().name(C::SUBJECT.into()).spawn(work);
        let thread = thread.map_err(|error| PluginError::Failed {
            id,
            settings_at_fault: false,
            message: format!("no thread can be started to read its {}: {error}", C::SUBJECT),
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Calls a function with the shared state, under the lock.
    pub(crate) fn with<R>(&self, act: impl FnOnce(&mut C::State) -> R) -> R {
        self.shared.with(act)
    }

    /// Wakes the thread, for a request that was put into the state.
    pub(crate) fn wake(&self) {
        self.shared.changed.notify_all();
    }

    /// Waits until the plugin was polled once, at most `timeout`.
    pub(crate) fn wait_for_first(&self, timeout: Duration) {
        drop(self.shared.wait_while(Instant::now() + timeout, |inner| inner.polls == 0));
    }

    /// Waits until the state fulfils a condition, at most `timeout`.
    pub(crate) fn wait_until(&self, timeout: Duration, fulfils: impl Fn(&C::State) -> bool) {
        let end = Instant::now() + timeout;
        drop(self.shared.wait_while(end, |inner| !fulfils(&inner.state)));
    }
}

impl<C: PolledCapability> Drop for PluginPoller<C> {
    fn drop(&mut self) {
        self.shared.inner().ends = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // It ends with its call, which has a deadline.
            let _ = thread.join();
        }
    }
}

fn run<C: PolledCapability>(mut capability: C, plugin: &Plugin, shared: &SharedState<C::State>) {
    let mut deaths = 0;
    let mut next_poll = Instant::now();
    loop {
        let mut is_requested = false;
        let is_idle = |inner: &mut Inner<C::State>| {
            is_requested = !inner.ends && capability.take_request(&mut inner.state);
            !inner.ends && !is_requested
        };
        if shared.wait_while(next_poll, is_idle).ends {
            return;
        }
        if is_requested {
            capability.answer(shared);
        } else {
            let died = plugin.status().deaths;
            if died != deaths {
                capability.forget();
            }
            deaths = died;
            capability.poll(plugin, shared);
            shared.inner().polls += 1;
            next_poll = Instant::now() + C::PERIOD;
        }
        shared.changed.notify_all();
    }
}

/// Notes the outcome of a read, and logs a fault once until another one follows.
pub(crate) fn note_fault<C: PolledCapability>(
    plugin: &Plugin,
    noted: &mut Option<String>,
    found: Option<String>,
) {
    if let Some(fault) = found.as_ref().filter(|fault| noted.as_ref() != Some(*fault)) {
        tracing::error!(plugin = plugin.name(), "{} cannot be read: {fault}", C::SUBJECT);
    }
    *noted = found;
}
