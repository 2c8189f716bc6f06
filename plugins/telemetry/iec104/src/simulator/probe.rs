//! A simulated station in memory whose clocks are the caller's.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_sdk::{Error, Simulation};

use super::share;
use super::station::{CloseReason, Shared, Station, Times};
use crate::settings::Settings;

/// Simulated station for fuzzing.
pub struct StationProbe(Arc<Shared>);

/// The station as one client sees it.
pub struct ClientProbe {
    station: Station,
    times: Times,
}

impl StationProbe {
    /// A station with these tags.
    ///
    /// # Errors
    /// What the plugin would say of settings and addresses.
    pub fn new(settings: Settings, tags: &Simulation) -> Result<Self, Error> {
        share(&settings.parse()?, tags).map(|(shared, _)| Self(Arc::new(shared)))
    }

    /// A client that connects at this time, the first since the station was started.
    pub fn connect(&self, time: SystemTime) -> ClientProbe {
        self.0.has_sent_start.store(false, Ordering::Relaxed);
        let times = Times { now: Instant::now(), true_time: time, station_time: time };
        ClientProbe { station: Station::new(Arc::clone(&self.0), times.now), times }
    }
}

impl ClientProbe {
    /// Takes what the client sent.
    ///
    /// # Errors
    /// Why the station closes the connection.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.station.receive(bytes, self.times).map_err(in_words)
    }

    /// Lets time go on; the station does what is due and looks for changes.
    ///
    /// # Errors
    /// Returns the errors of [`ClientProbe::receive`].
    pub fn pass(&mut self, time: Duration) -> Result<(), String> {
        self.times.now += time;
        self.times.true_time += time;
        self.times.station_time += time;
        self.station.tick(self.times).map_err(in_words)?;
        self.station.look_for_changes(self.times);
        Ok(())
    }

    /// Takes the bytes for the client, and the count of data units in them.
    pub fn take_output(&mut self) -> (Vec<u8>, u64) {
        self.station.take_output()
    }
}

fn in_words(fault: CloseReason) -> String {
    fault.to_string()
}
