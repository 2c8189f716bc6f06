//! Transport to a device: a network or a serial line.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use busbar_link::{Endpoint, SettingsFaults, TlsFiles, TlsSettings};
use schemars::JsonSchema;
use serde::Deserialize;

/// Port of Modbus TCP (Modbus Messaging on TCP/IP V1.0b, 3.1.3).
const PORT: u16 = 502;
/// Port of Modbus/TCP Security (its specification V21, 5).
const SECURE_PORT: u16 = 802;
/// Unit ids of a serial line; 0 is for broadcasts, which have no answer (Modbus over Serial Line
/// V1.02, 2.2).
const SERIAL_UNITS: RangeInclusive<u8> = 1..=247;
/// Slowest and fastest line, bits a second.
const BAUD_RATES: RangeInclusive<u32> = 300..=4_000_000;
/// Bits of a character: start, eight of data, parity or a second stop, stop
/// (Modbus over Serial Line V1.02, 2.5.1).
const CHARACTER_BITS: u32 = 11;
/// The silence between frames does not get shorter above 19200 bits a second
/// (2.5.1.1).
const MIN_SILENCE: Duration = Duration::from_micros(1750);

/// A serial line: as devices have it that were not configured otherwise.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SerialSettings {
    /// Absolute path of the device file, such as `/dev/ttyUSB0`.
    #[schemars(length(min = 1))]
    device: PathBuf,
    /// Baud rate of the serial line, bits per second.
    #[serde(default = "default_baud_rate")]
    #[schemars(range(min = 300, max = 4_000_000))]
    baud_rate: u32,
    /// Bits of a character: 8 is the only number that Modbus RTU knows.
    #[serde(default = "default_data_bits")]
    #[schemars(range(min = 8, max = 8))]
    data_bits: u8,
    /// Parity bit of each character.
    #[serde(default)]
    parity: Parity,
    /// Stop bits: 1 or 2; without it 1, or 2 where there is no parity.
    #[schemars(range(min = 1, max = 2))]
    stop_bits: Option<u8>,
}

/// Parity bit of a character on a serial line.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Parity {
    /// Even parity, the default of the Modbus standard.
    #[default]
    Even,
    /// Odd parity, a bit in each character.
    Odd,
    /// No parity bit; then two stop bits are the default.
    None,
}

fn default_baud_rate() -> u32 {
    19_200
}

fn default_data_bits() -> u8 {
    8
}

/// The settings that choose a transport.
pub(crate) struct RawTransport {
    pub(crate) host: Option<String>,
    pub(crate) port: Option<u16>,
    pub(crate) tls: Option<TlsSettings>,
    pub(crate) serial: Option<SerialSettings>,
}

/// Transport to a device. It is displayed as operators know it.
#[derive(Clone, Debug)]
pub(crate) enum Transport {
    Tcp { endpoint: Endpoint, tls: Option<TlsFiles> },
    Serial(SerialLine),
}

/// A serial line whose settings have been checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SerialLine {
    pub(crate) device: String,
    pub(crate) baud_rate: u32,
    pub(crate) parity: Parity,
    pub(crate) has_two_stop_bits: bool,
}

impl RawTransport {
    /// Exactly one transport, or a fault.
    pub(crate) fn parse(self, faults: &mut SettingsFaults) -> Option<Transport> {
        match (self.host, self.serial) {
            (Some(host), None) => {
                let tls = self.tls.map(|tls| tls.parse(faults));
                let usual = if tls.is_some() { SECURE_PORT } else { PORT };
                let endpoint = Endpoint::parse("", &host, self.port.unwrap_or(usual), faults);
                Some(Transport::Tcp { endpoint, tls })
            }
            (None, Some(serial)) => {
                for (name, is_there) in [("port", self.port.is_some()), ("tls", self.tls.is_some())]
                {
                    if is_there {
                        faults.add(format!("{name}: belongs to host, not to serial: remove it"));
                    }
                }
                Some(Transport::Serial(serial.parse(faults)))
            }
            (Some(_), Some(_)) => {
                faults.add("host, serial: a device is reached by one of them: remove the other");
                None
            }
            (None, None) => {
                faults.add(
                    "host: give the device's name or address (Modbus TCP), or give serial \
                     (Modbus RTU)",
                );
                None
            }
        }
    }
}

impl SerialSettings {
    fn parse(self, faults: &mut SettingsFaults) -> SerialLine {
        if !self.device.is_absolute() {
            let device = self.device.display();
            faults.add(format!("serial.device: '{device}' is no absolute path"));
        }
        if self.data_bits != 8 {
            faults.add(format!(
                "serial.data_bits: Modbus RTU needs 8, not {}: set the device to RTU",
                self.data_bits
            ));
        }
        let usual = if self.parity == Parity::None { 2 } else { 1 };
        let stop_bits = self.stop_bits.unwrap_or(usual);
        SerialLine {
            device: self.device.to_string_lossy().into_owned(),
            baud_rate: faults.check("serial.baud_rate", self.baud_rate, BAUD_RATES),
            parity: self.parity,
            has_two_stop_bits: faults.check("serial.stop_bits", stop_bits, 1..=2) == 2,
        }
    }
}

impl Transport {
    /// Units that can be asked.
    pub(crate) fn units(&self) -> RangeInclusive<u8> {
        match self {
            Self::Tcp { .. } => 0..=u8::MAX,
            Self::Serial(_) => SERIAL_UNITS,
        }
    }

    /// For the name of the thread.
    pub(crate) fn short_name(&self) -> String {
        match self {
            Self::Tcp { endpoint, .. } => endpoint.port.to_string(),
            Self::Serial(line) => {
                let name = Path::new(&line.device).file_name().unwrap_or_default();
                name.to_string_lossy().into_owned()
            }
        }
    }
}

impl fmt::Display for Transport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp { endpoint, .. } => endpoint.fmt(f),
            Self::Serial(line) => f.write_str(&line.device),
        }
    }
}

impl SerialLine {
    /// Returns the transmission time of a number of bytes on the line.
    pub(crate) fn transmission(&self, bytes: u32) -> Duration {
        Duration::from_secs(1) * (bytes * CHARACTER_BITS) / self.baud_rate
    }

    /// Returns the silence that ends a frame: three and a half characters (Modbus over Serial Line
    /// V1.02, 2.5.1.1).
    pub(crate) fn silence(&self) -> Duration {
        (self.transmission(7) / 2).max(MIN_SILENCE)
    }
}
