//! Concentrations and rates that are usual in service, and those that call for attention.
//!
//! All in ppm (µL/L), rates in ppm a year, unless said otherwise.

use crate::Gas;

/// Range from the lowest to the highest 90 % value of the networks surveyed.
pub type Range = (f64, f64);

/// Relation of a tap changer's oil to the tank's, by which acetylene may come from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TapChanger {
    /// No tap changer, or one in oil of its own.
    Separate,
    /// Tap changer whose oil communicates with the tank's.
    Communicating,
}

/// Returns the 90 % typical concentrations of power transformers in service, ppm (IEC 60599:2015,
/// table A.2); `None` for gases without one.
pub fn iec_concentration(gas: Gas, tap_changer: TapChanger) -> Option<Range> {
    Some(match gas {
        Gas::H2 => (50.0, 150.0),
        Gas::Ch4 => (30.0, 130.0),
        Gas::C2h6 => (20.0, 90.0),
        Gas::C2h4 => (60.0, 280.0),
        Gas::C2h2 if tap_changer == TapChanger::Separate => (2.0, 20.0),
        Gas::C2h2 => (60.0, 280.0),
        Gas::Co => (400.0, 600.0),
        Gas::Co2 => (3800.0, 14_000.0),
        Gas::O2 | Gas::N2 => return None,
    })
}

/// Returns the 90 % typical rates of increase of power transformers in service, ppm a year (IEC
/// 60599:2015, table A.3); `None` for gases without one.
pub fn iec_rate(gas: Gas, tap_changer: TapChanger) -> Option<Range> {
    Some(match gas {
        Gas::H2 => (35.0, 132.0),
        Gas::Ch4 => (10.0, 120.0),
        Gas::C2h6 => (5.0, 90.0),
        Gas::C2h4 => (32.0, 146.0),
        Gas::C2h2 if tap_changer == TapChanger::Separate => (0.0, 4.0),
        Gas::C2h2 => (21.0, 37.0),
        Gas::Co => (260.0, 1060.0),
        Gas::Co2 => (1700.0, 10_000.0),
        Gas::O2 | Gas::N2 => return None,
    })
}

/// Returns typical, first and second intermediate, and pre-failure concentrations, ppm (CIGRE
/// technical brochure 771); `None` for gases without one.
pub fn cigre_levels(gas: Gas) -> Option<[f64; 4]> {
    Some(match gas {
        Gas::H2 => [118.0, 200.0, 280.0, 725.0],
        Gas::Ch4 => [85.0, 135.0, 180.0, 400.0],
        Gas::C2h6 => [111.0, 210.0, 300.0, 900.0],
        Gas::C2h4 => [56.0, 120.0, 200.0, 800.0],
        Gas::C2h2 => [5.0, 19.0, 40.0, 450.0],
        Gas::Co => [700.0, 970.0, 1180.0, 2100.0],
        Gas::Co2 => [6300.0, 11_600.0, 16_700.0, 50_000.0],
        Gas::O2 | Gas::N2 => return None,
    })
}

/// Attention value of hydrogen, ppm (DL/T 722-2014, table 3).
pub const DLT_H2: f64 = 150.0;
/// Attention value of acetylene up to 220 kV, ppm (DL/T 722-2014, table 3).
pub const DLT_C2H2: f64 = 5.0;
/// Attention value of acetylene from 330 kV, ppm (DL/T 722-2014, table 3).
pub const DLT_C2H2_EHV: f64 = 1.0;
/// Attention value of total hydrocarbons, CH4, C2H6, C2H4 and C2H2, ppm (DL/T 722-2014, table 3).
pub const DLT_TOTAL_HYDROCARBONS: f64 = 150.0;
/// Relative rate of total hydrocarbons, percent a month (DL/T 722-2014, 9.3.2).
pub const DLT_RELATIVE_RATE: f64 = 10.0;

/// Returns the absolute rates that call for attention, mL a day, of an (open, sealed) transformer
/// (DL/T 722-2014, table 4): H2, C2H2, CO and CO2. For total hydrocarbons see
/// [`DLT_TOTAL_HYDROCARBONS_RATE`].
pub fn dlt_rate(gas: Gas) -> Option<(f64, f64)> {
    Some(match gas {
        Gas::H2 => (5.0, 10.0),
        Gas::C2h2 => (0.1, 0.2),
        Gas::Co => (50.0, 100.0),
        Gas::Co2 => (100.0, 200.0),
        _ => return None,
    })
}

/// Absolute rates of total hydrocarbons that call for attention, mL a day, of an (open, sealed)
/// transformer (DL/T 722-2014, table 4).
pub const DLT_TOTAL_HYDROCARBONS_RATE: (f64, f64) = (6.0, 12.0);
