//! Trends of gas that are kept across restarts, with the parameters that they belong to.

use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};

use busbar_plugin_sdk::{Host, LogLevel, StateFile, StateFileLayout};

use crate::TrendKey;
use crate::settings::Settings;
use crate::trend::{KeptTrend, NANOS_A_DAY, Trend};

/// Wall-clock time between two writings of the trends, whose points are days apart.
const SAVE_INTERVAL: Duration = Duration::from_secs(600);
/// Layout of the file: 10,000 trends have some 50 MiB.
const STATE_FILE: StateFileLayout =
    StateFileLayout { version: 1, key: "trends", max_bytes: 64 << 20, subject: "trends of gas" };

/// File of trends, and those of it that no frame has taken yet.
pub(crate) struct KeptTrends {
    file: StateFile<KeptTrend>,
    restored: HashMap<String, KeptTrend>,
    /// Parameters of all trends: window, gas and filling.
    parameters: String,
    last_save: Instant,
    has_drawn: bool,
    host: Host,
}

impl KeptTrends {
    /// Reads the file of the settings; `None` where they name none.
    pub(crate) fn new(settings: &Settings, filling: Option<f64>, host: Host) -> Option<Self> {
        let file = StateFile::new(settings.state_file.as_ref()?, STATE_FILE, host.clone());
        let mixture = settings.mixture.as_ref().map(|mixture| format!("{mixture:?}"));
        let gas = mixture.map_or(0, |mixture| hash(mixture.as_bytes()));
        let window = settings.trend_days * 24.0;
        Some(Self {
            restored: file.read(),
            file,
            parameters: format!("{window} h, gas {gas:x}, filling {filling:?}"),
            last_save: Instant::now(),
            has_drawn: false,
            host,
        })
    }

    /// Takes the trends of the file that are of the same tags and parameters and not of a
    /// time to come; logs how old they are.
    pub(crate) fn restore(&mut self, now: i64, trends: &mut [(TrendKey, Trend)]) {
        self.has_drawn = true;
        if self.restored.is_empty() {
            return;
        }
        let mut restored = std::mem::take(&mut self.restored);
        let mut newest: Option<i64> = None;
        let mut count = 0_usize;
        for (key, trend) in trends {
            let Some(kept) = restored.remove(key.equipment()) else { continue };
            let refusal = match () {
                () if kept.parameters != self.parameters_of(key) => "of other tags or parameters",
                () if kept.unix_nanos > now => "of a time that is still to come",
                () => {
                    newest = newest.max(Some(kept.unix_nanos));
                    count += 1;
                    trend.restore(kept);
                    continue;
                }
            };
            let words = format!(
                "the trend that was kept of '{}' is {refusal}; it begins anew",
                key.equipment()
            );
            self.host.log(LogLevel::Warning, &words);
        }
        if let Some(newest) = newest {
            let days = now.saturating_sub(newest) as f64 / NANOS_A_DAY;
            let words =
                format!("{count} trends of gas go on; the newest sample is {days:.1} days old");
            self.host.log(LogLevel::Info, &words);
        }
    }

    /// Writes the trends from time to time.
    pub(crate) fn save(&mut self, trends: &[(TrendKey, Trend)]) {
        if self.last_save.elapsed() >= SAVE_INTERVAL {
            self.last_save = Instant::now();
            self.file.write(self.entries(trends));
        }
    }

    /// Writes the trends for the last time, unless the settings were only tried.
    pub(crate) fn close(&mut self, trends: &[(TrendKey, Trend)]) {
        if self.has_drawn {
            self.file.close(&self.entries(trends));
        }
    }

    fn entries(&self, trends: &[(TrendKey, Trend)]) -> BTreeMap<String, KeptTrend> {
        let entry = |(key, trend): &(TrendKey, Trend)| {
            Some((key.equipment().to_owned(), trend.to_kept(self.parameters_of(key))?))
        };
        trends.iter().filter_map(entry).collect()
    }

    fn parameters_of(&self, key: &TrendKey) -> String {
        let [_, pressure, temperature] = &key.0;
        format!("{}, tags '{pressure}' and '{temperature}'", self.parameters)
    }
}

/// Hash of Fowler, Noll and Vo (FNV-1a, 64 bits): the same in every version of the program.
fn hash(bytes: &[u8]) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, step)
}
