//! Loads of the bays in normal operation.

/// Number of main transformers.
pub(crate) const MAIN_TRANSFORMERS: usize = 2;

/// Load of a bay in normal operation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Load {
    /// Designation of the bay, such as `=S12D1Q1`.
    pub(crate) bay: String,
    /// Active power out of the busbar in MW.
    pub(crate) megawatts: f64,
    /// Nominal voltage in kV.
    pub(crate) kilovolts: f64,
    /// Rated current in A.
    pub(crate) rated_amperes: f64,
}

impl Load {
    /// Returns the current at the station's power factor, A.
    pub(crate) fn amperes(&self) -> f64 {
        1000.0 * self.megawatts.abs() / (3_f64.sqrt() * self.kilovolts * POWER_FACTOR)
    }
}

pub(super) const POWER_FACTOR: f64 = 0.97;

/// Active power out of the busbar by bay, MW, and rated current, A. What comes in goes
/// out: 232 MW by two lines, 76 by four; 156 through the transformers, which lose 0.8
/// and leave 12.2 to the 35 kV side; 143 to the 110 kV lines.
const LOADS: [(&str, f64, f64, f64); 22] = [
    ("=S12D1Q1", -120.0, 220.0, 800.0),
    ("=S12D1Q2", -112.0, 220.0, 800.0),
    ("=S12D1Q3", 24.0, 220.0, 800.0),
    ("=S12D1Q4", 20.0, 220.0, 800.0),
    ("=S12D1Q5", 18.0, 220.0, 800.0),
    ("=S12D1Q6", 14.0, 220.0, 800.0),
    ("=S12D1Q21", 79.0, 220.0, 472.0),
    ("=S12D1Q22", 77.0, 220.0, 472.0),
    ("=S12D1Q30", 9.0, 220.0, 1250.0),
    ("=S12E1Q1", 22.0, 110.0, 600.0),
    ("=S12E1Q2", 19.0, 110.0, 600.0),
    ("=S12E1Q3", 17.0, 110.0, 600.0),
    ("=S12E1Q4", 16.0, 110.0, 600.0),
    ("=S12E1Q5", 18.0, 110.0, 600.0),
    ("=S12E1Q6", 15.0, 110.0, 600.0),
    ("=S12E1Q7", 19.0, 110.0, 600.0),
    ("=S12E1Q8", 17.0, 110.0, 600.0),
    ("=S12E1Q21", -72.4, 110.0, 945.0),
    ("=S12E1Q22", -70.6, 110.0, 945.0),
    ("=S12E1Q30", 3.6, 110.0, 1250.0),
    ("=S12T1", -6.2, 35.0, 990.0),
    ("=S12T2", -6.0, 35.0, 990.0),
];
const FEEDER_MEGAWATTS: f64 = 0.61;

/// Returns the loads of the yards' and transformers' bays.
pub(crate) fn bay_loads() -> Vec<Load> {
    LOADS
        .iter()
        .map(|&(bay, megawatts, kilovolts, rated_amperes)| Load {
            bay: bay.to_owned(),
            megawatts,
            kilovolts,
            rated_amperes,
        })
        .collect()
}

pub(super) fn load_of(bay: &str) -> Load {
    let feeder = Load {
        bay: bay.to_owned(),
        megawatts: FEEDER_MEGAWATTS,
        kilovolts: 35.0,
        rated_amperes: 630.0,
    };
    bay_loads().into_iter().find(|load| load.bay == bay).unwrap_or(feeder)
}

/// Returns the share of a bay's rated current that flows.
pub(super) fn loading(bay: &str) -> f64 {
    let load = load_of(bay);
    load.amperes() / load.rated_amperes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(is_in: impl Fn(&str) -> bool) -> f64 {
        let loads = bay_loads().into_iter().filter(|load| is_in(&load.bay));
        loads.map(|load| load.megawatts).sum()
    }

    #[test]
    fn what_comes_in_goes_out() {
        for level in ["=S12D1", "=S12E1"] {
            // What goes through the coupler stays on the busbars.
            let out = sum(|bay| bay.starts_with(level) && !bay.ends_with("Q30"));
            assert!(out.abs() < 1e-9, "{level}: {out} MW");
        }
        let through = |ends: [&str; 3]| ends.map(|end| sum(|bay| bay == end));
        for number in [1, 2] {
            let [high, medium, low] = [
                format!("=S12D1Q2{number}"),
                format!("=S12E1Q2{number}"),
                format!("=S12T{number}"),
            ];
            let losses: f64 = through([&high, &medium, &low]).iter().sum();
            assert!((0.2..0.6).contains(&losses), "T{number} loses {losses} MW");
        }
        let low = sum(|bay| bay.starts_with("=S12T"));
        assert!((low + 20.0 * FEEDER_MEGAWATTS).abs() < 1e-9, "{low} MW to 20 feeders");
        assert!(bay_loads().iter().all(|load| load.amperes() < load.rated_amperes));
    }
}
