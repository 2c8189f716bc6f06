//! Exception codes of Modbus devices, and the quality that follows from each.

use busbar_plugin_sdk::Reason;
use tokio_modbus::ExceptionCode;

/// Reason of the bad quality of cells that a device refuses.
pub(crate) const REFUSED: Reason = Reason::Configuration;

/// Meaning of an exception for the tags of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ExceptionEffect {
    /// Some of the cells do not exist; those are bad by [`REFUSED`], once they are found.
    SomeRefused,
    /// None of them can be read: all are bad by [`REFUSED`].
    AllRefused,
    /// Cells that cannot be read now, and are bad by this reason.
    Unavailable(Reason),
}

/// Returns the effect of an exception code (Modbus Application Protocol Specification V1.1b3, 7).
pub(crate) fn effect_of_exception(exception: ExceptionCode) -> ExceptionEffect {
    match exception {
        ExceptionCode::IllegalFunction => ExceptionEffect::AllRefused,
        // Devices that take fewer cells a request than the protocol allows
        // answer with an illegal value, and want smaller requests.
        ExceptionCode::IllegalDataAddress | ExceptionCode::IllegalDataValue => {
            ExceptionEffect::SomeRefused
        }
        ExceptionCode::GatewayPathUnavailable
        | ExceptionCode::GatewayTargetDevice
        | ExceptionCode::Acknowledge
        | ExceptionCode::ServerDeviceBusy => ExceptionEffect::Unavailable(Reason::Communication),
        _ => ExceptionEffect::Unavailable(Reason::Unknown),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exceptions_say_who_is_at_fault() {
        let cases = [
            (1, ExceptionEffect::AllRefused),
            (2, ExceptionEffect::SomeRefused),
            (3, ExceptionEffect::SomeRefused),
            (4, ExceptionEffect::Unavailable(Reason::Unknown)),
            (6, ExceptionEffect::Unavailable(Reason::Communication)),
            (10, ExceptionEffect::Unavailable(Reason::Communication)),
            (11, ExceptionEffect::Unavailable(Reason::Communication)),
            (99, ExceptionEffect::Unavailable(Reason::Unknown)),
        ];
        for (code, expected) in cases {
            assert_eq!(effect_of_exception(ExceptionCode::new(code)), expected, "{code}");
        }
    }
}
