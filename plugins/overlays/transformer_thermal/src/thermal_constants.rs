//! Constants of IEC 60076-7:2018: table 4 (exponential model), table 2 (limits), and the
//! rises of the loading guide's transformers, which keep to IEC 60076-2.

use crate::settings::{Cooling, Loading, Size};

/// Greatest hot-spot rise over the ambient temperature at rated load (IEC 60076-2), K.
pub(crate) const MAX_HOT_SPOT_RISE: f64 = 78.0;
/// Rated power up to which a transformer is small, MVA (IEC 60076-7:2018, 3).
const MAX_SMALL_MVA: f64 = 2.5;
/// Rated power up to which a transformer is medium, MVA.
const MAX_MEDIUM_MVA: f64 = 100.0;

/// Column of table 4, with the rises of the guide's transformer of that cooling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CoolingConstants {
    pub(crate) oil_exponent: f64,
    pub(crate) winding_exponent: f64,
    /// Constants k11, k21 and k22.
    pub(crate) k: [f64; 3],
    /// Time constants of oil and winding, minutes.
    pub(crate) minutes: [f64; 2],
    /// Top-oil rise at rated load, and hot-spot rise over it, K: 78 K together.
    pub(crate) rises: [f64; 2],
    /// Load losses over no-load losses.
    pub(crate) loss_ratio: f64,
}

const SMALL_ONAN: CoolingConstants = CoolingConstants {
    oil_exponent: 0.8,
    winding_exponent: 1.6,
    k: [1.0, 1.0, 2.0],
    minutes: [180.0, 4.0],
    rises: [55.0, 23.0],
    loss_ratio: 5.0,
};
const ONAN: CoolingConstants = CoolingConstants {
    oil_exponent: 0.8,
    winding_exponent: 1.3,
    k: [0.5, 2.0, 2.0],
    minutes: [210.0, 10.0],
    rises: [52.0, 26.0],
    loss_ratio: 6.0,
};
const ONAF: CoolingConstants = CoolingConstants { minutes: [150.0, 7.0], ..ONAN };
const OF: CoolingConstants = CoolingConstants {
    oil_exponent: 1.0,
    winding_exponent: 1.3,
    k: [1.0, 1.3, 1.0],
    minutes: [90.0, 7.0],
    rises: [56.0, 22.0],
    loss_ratio: 6.0,
};
const OD: CoolingConstants = CoolingConstants {
    oil_exponent: 1.0,
    winding_exponent: 2.0,
    k: [1.0, 1.0, 1.0],
    minutes: [90.0, 7.0],
    rises: [49.0, 29.0],
    loss_ratio: 6.0,
};
/// Constant k21 where the flow of oil through an ON-cooled winding is restricted.
const RESTRICTED_ON_K21: f64 = 3.0;
/// Constant k21 where the flow of oil through an OF-cooled winding is restricted.
const RESTRICTED_OF_K21: f64 = 1.45;

impl CoolingConstants {
    /// Column of table 4 for a cooling, a size, and a restricted flow of oil.
    pub(crate) fn new(cooling: Cooling, size: Option<Size>, is_restricted: bool) -> Self {
        let (mut constants, restricted_k21) = match cooling {
            // Small transformers have one column, and no restricted flow.
            Cooling::Onan if size == Some(Size::Small) => return SMALL_ONAN,
            Cooling::Onan => (ONAN, RESTRICTED_ON_K21),
            Cooling::Onaf => (ONAF, RESTRICTED_ON_K21),
            Cooling::Of | Cooling::Ofan | Cooling::Ofaf | Cooling::Ofwf => (OF, RESTRICTED_OF_K21),
            Cooling::Od | Cooling::Odan | Cooling::Odaf | Cooling::Odwf => return OD,
        };
        if is_restricted {
            constants.k[1] = restricted_k21;
        }
        constants
    }
}

/// Limits of a kind of loading (table 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// Load, per unit of the rated current.
    pub(crate) load: f64,
    /// Top oil and hot spot, degrees Celsius; `None` where the table sets none.
    pub(crate) temperatures: Option<[f64; 2]>,
}

impl Limits {
    /// Limits of table 2. Where the size is not known, those of the least strict size.
    pub(crate) fn new(loading: Loading, size: Option<Size>) -> Self {
        let (loads, temperatures) = match loading {
            Loading::NormalCyclic => ([1.5, 1.5, 1.3], [105.0, 120.0]),
            Loading::LongTimeEmergency => ([1.8, 1.5, 1.3], [115.0, 140.0]),
            Loading::ShortTimeEmergency => ([2.0, 1.8, 1.5], [115.0, 160.0]),
        };
        let [small, medium, large] = loads;
        let load = match size {
            Some(Size::Small) | None => small,
            Some(Size::Medium) => medium,
            Some(Size::Large) => large,
        };
        let is_unlimited = loading == Loading::ShortTimeEmergency && size == Some(Size::Small);
        Self { load, temperatures: (!is_unlimited).then_some(temperatures) }
    }
}

impl Size {
    /// Size category of a rated power, MVA.
    pub(crate) fn of_rated_power(mva: f64) -> Self {
        match mva {
            _ if mva <= MAX_SMALL_MVA => Self::Small,
            _ if mva <= MAX_MEDIUM_MVA => Self::Medium,
            _ => Self::Large,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_those_of_table_4() {
        // x, y, k11, k21, k22, oil minutes, winding minutes.
        let column = |cooling, size, is_restricted| {
            let of = CoolingConstants::new(cooling, size, is_restricted);
            let [k11, k21, k22] = of.k;
            let [oil, winding] = of.minutes;
            [of.oil_exponent, of.winding_exponent, k11, k21, k22, oil, winding]
        };
        let large = Some(Size::Large);
        for (columns, wanted) in [
            (column(Cooling::Onan, Some(Size::Small), false), [0.8, 1.6, 1.0, 1.0, 2.0, 180., 4.]),
            (column(Cooling::Onan, large, true), [0.8, 1.3, 0.5, 3.0, 2.0, 210., 10.]),
            (column(Cooling::Onan, large, false), [0.8, 1.3, 0.5, 2.0, 2.0, 210., 10.]),
            (column(Cooling::Onaf, large, true), [0.8, 1.3, 0.5, 3.0, 2.0, 150., 7.]),
            (column(Cooling::Onaf, large, false), [0.8, 1.3, 0.5, 2.0, 2.0, 150., 7.]),
            (column(Cooling::Ofaf, large, true), [1.0, 1.3, 1.0, 1.45, 1.0, 90., 7.]),
            (column(Cooling::Ofaf, large, false), [1.0, 1.3, 1.0, 1.3, 1.0, 90., 7.]),
            (column(Cooling::Odaf, large, false), [1.0, 2.0, 1.0, 1.0, 1.0, 90., 7.]),
        ] {
            assert_eq!(columns, wanted);
        }
    }

    #[test]
    fn default_rises_keep_to_iec_60076_2() {
        for of in [SMALL_ONAN, ONAN, ONAF, OF, OD] {
            assert_eq!(of.rises.iter().sum::<f64>(), MAX_HOT_SPOT_RISE);
            assert!(of.rises[0] <= 60.0);
        }
    }

    #[test]
    fn limits_are_those_of_table_2() {
        let loads = |loading| {
            [Size::Small, Size::Medium, Size::Large].map(|of| Limits::new(loading, Some(of)).load)
        };
        assert_eq!(loads(Loading::NormalCyclic), [1.5, 1.5, 1.3]);
        assert_eq!(loads(Loading::LongTimeEmergency), [1.8, 1.5, 1.3]);
        assert_eq!(loads(Loading::ShortTimeEmergency), [2.0, 1.8, 1.5]);
        let temperatures = |loading, size| Limits::new(loading, Some(size)).temperatures;
        assert_eq!(temperatures(Loading::NormalCyclic, Size::Large), Some([105.0, 120.0]));
        assert_eq!(temperatures(Loading::LongTimeEmergency, Size::Small), Some([115.0, 140.0]));
        assert_eq!(temperatures(Loading::ShortTimeEmergency, Size::Medium), Some([115.0, 160.0]));
        assert_eq!(temperatures(Loading::ShortTimeEmergency, Size::Small), None);
        assert_eq!(Size::of_rated_power(2.5), Size::Small);
        assert_eq!(Size::of_rated_power(100.0), Size::Medium);
        assert_eq!(Size::of_rated_power(100.1), Size::Large);
    }
}
