//! Both ends of a connection in memory, their clocks in the caller's hands: for fuzzing.

use std::time::{Instant, SystemTime};

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Error, SampleSink, TagSpec};

use crate::points::Points;
use crate::settings::Settings;
pub use crate::simulator::probe::{ClientProbe, StationProbe};
use crate::station::Station;

/// The controlling end behind its connections: data units in, samples and requests out.
pub struct ControllingProbe {
    station: Station,
    now: Instant,
}

impl ControllingProbe {
    /// A station whose data transfer has just started.
    ///
    /// # Errors
    /// What the plugin would say of settings and addresses.
    pub fn new(settings: Settings, tags: &[TagSpec], sink: SampleSink) -> Result<Self, Error> {
        let config = settings.parse()?;
        let points = Points::parse(tags, &config)?;
        let (mut station, now) = (Station::new(config, points, sink, host()), Instant::now());
        station.begin(SystemTime::UNIX_EPOCH, now);
        Ok(Self { station, now })
    }

    /// Takes a data unit and publishes what is in it.
    pub fn handle_answer(&mut self, asdu: &[u8], received: SystemTime) {
        self.station.handle_answer(asdu, received, self.now);
        self.station.flush();
    }

    /// The request that is to be sent now, as a data unit.
    pub fn next_request(&mut self) -> Option<Vec<u8>> {
        self.station.next_request(self.now, || SystemTime::UNIX_EPOCH)
    }
}
