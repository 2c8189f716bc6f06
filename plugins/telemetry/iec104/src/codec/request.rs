//! All that this station ever sends: requests for values, and the time.

use std::time::SystemTime;

use super::asdu::cause;
use super::time::{Cp56, Zone};

/// Station interrogation, global (QOI, IEC 60870-5-101, 7.2.6.22).
const QOI_STATION: u8 = 20;
/// General request for counters, without freezing or reset (QCC, 7.2.6.23).
const QCC_GENERAL_READ: u8 = 5;

/// A request of a controlling station that only looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Interrogation of all values, C_IC_NA_1.
    Interrogation,
    /// C_CI_NA_1: all counters, as they are.
    Counters,
    /// Synchronization of the clock, C_CS_NA_1.
    ClockSync(SystemTime, Zone),
}

impl Request {
    /// The data unit for a station; nothing for a time that no tag can name.
    pub fn to_bytes(self, common_address: u16, originator: u8) -> Option<Vec<u8>> {
        let [low, high] = common_address.to_le_bytes();
        let unit = |type_id, element: &[u8]| {
            let mut bytes = vec![type_id, 1, cause::ACTIVATION, originator, low, high, 0, 0, 0];
            bytes.extend(element);
            bytes
        };
        Some(match self {
            Self::Interrogation => unit(100, &[QOI_STATION]),
            Self::Counters => unit(101, &[QCC_GENERAL_READ]),
            Self::ClockSync(time, zone) => {
                unit(103, &Cp56::from_system_time(time, zone)?.to_bytes())
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;

    #[test]
    fn requests_are_those_of_the_standard() {
        let time = UNIX_EPOCH + Duration::from_millis(1_709_210_096_789);
        let sync = Request::ClockSync(time, Zone::Utc);
        let cases: [(Request, &[u8]); 3] = [
            (Request::Interrogation, &[100, 1, 6, 9, 0x34, 0x12, 0, 0, 0, 20]),
            (Request::Counters, &[101, 1, 6, 9, 0x34, 0x12, 0, 0, 0, 5]),
            (sync, &[103, 1, 6, 9, 0x34, 0x12, 0, 0, 0, 0xD5, 0xDD, 34, 12, 29, 2, 24]),
        ];
        for (request, bytes) in cases {
            assert_eq!(request.to_bytes(0x1234, 9).as_deref(), Some(bytes), "{request:?}");
        }
        assert_eq!(Request::ClockSync(UNIX_EPOCH, Zone::Utc).to_bytes(1, 0), None);
    }
}
