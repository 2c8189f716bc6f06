//! Points of condition monitoring.

use super::point_list::{NormalValue, PointContext, PointKind, PointListBuilder, Quantity};

/// Scan period of condition monitoring, milliseconds, as a demonstration needs it. Stations read
/// gas each 1 to 10 minutes, currents and temperatures each 5 to 30.
const SCAN: u32 = 5000;

const PRESSURE: Quantity = ("SIMG.Pres", "SF6 pressure", "bar", 0.0, 12.0, SCAN);
const GAS_TEMPERATURE: Quantity = ("SIMG.Tmp", "SF6 temperature", "°C", -40.0, 100.0, SCAN);
const TOTAL: Quantity = ("SARC.TotA", "arrester leakage current", "mA", 0.0, 20.0, SCAN);
const RESISTIVE: Quantity = ("SARC.RisA", "arrester resistive current", "mA", 0.0, 10.0, SCAN);
const OPERATIONS: Quantity = ("SARC.OpCnt", "arrester operations", "1", 0.0, 9999.0, SCAN);
const CONTACT: Quantity = ("STMP.Tmp", "contact temperature", "°C", -40.0, 200.0, SCAN);
const LEAKAGE: Quantity = ("SINS.LeakA", "insulator leakage current", "mA", 0.0, 50.0, SCAN);

/// Filling pressure of a breaker at 20 °C, bar absolute.
pub(crate) const SF6_FILLING: f64 = 7.0;
/// Pressure limit of the alarm, bar absolute at 20 °C; the lock-out limit follows.
pub(crate) const SF6_ALARM: f64 = 6.4;
pub(crate) const SF6_LOCK_OUT: f64 = 6.0;
/// Density above which no gas of a breaker is, kg/m3.
const MAX_SF6_DENSITY: f64 = 60.0;
/// Halvings of a range of densities, to the last bit of the pressure.
const BISECTIONS: usize = 60;
/// Temperature of gas and of contacts without current, °C.
const OUTSIDE: f64 = 22.0;

/// Monitored devices of a bay, of each pole.
pub(super) struct MonitoredDevices<'a> {
    pub(super) bay: &'a str,
    /// Flag of a breaker with SF6.
    pub(super) breaker: bool,
    pub(super) arrester: bool,
    /// Devices with a contact that may heat up.
    pub(super) contacts: &'a [&'a str],
    /// Devices whose insulator leaks.
    pub(super) insulators: &'a [&'a str],
    /// Share of the rated current that flows, for temperatures.
    pub(super) loading: f64,
}

impl MonitoredDevices<'_> {
    pub(super) fn add(&self, list: &mut PointListBuilder) {
        for pole in 1..=3_usize {
            let mut add = |quantity: Quantity, device: &str, node, role, usual| {
                let equipment = format!("{}-{device}-L{pole}", self.bay);
                let place = PointContext { bay: self.bay, equipment, node, role };
                list.add(PointKind::Monitoring, quantity, place, usual);
            };
            if self.breaker {
                let temperature = OUTSIDE + 1.0;
                let pressure = sf6_pressure(SF6_FILLING, temperature);
                add(PRESSURE, "QA1", pole, "sf6_pressure", NormalValue::Walk(pressure, 0.005));
                add(GAS_TEMPERATURE, "QA1", pole, "sf6_temperature", walk(temperature, 0.2));
            }
            if self.arrester {
                add(TOTAL, "FA1", pole, "arrester_total_current", walk(0.9, 0.02));
                add(RESISTIVE, "FA1", pole, "arrester_resistive_current", walk(0.12, 0.01));
                let operations = NormalValue::Constant((3 * pole + self.bay.len()) as f64);
                add(OPERATIONS, "FA1", pole, "arrester_operations", operations);
            }
            for (index, device) in self.contacts.iter().enumerate() {
                // Contacts heat up with the square of the current.
                let base = OUTSIDE + 25.0 * self.loading * self.loading + 0.3 * index as f64;
                let node = 3 * index + pole;
                add(CONTACT, device, node, "contact_temperature", walk(base, 0.4));
            }
            for (index, device) in self.insulators.iter().enumerate() {
                let node = 3 * index + pole;
                add(LEAKAGE, device, node, "leakage_current", walk(0.4, 0.05));
            }
        }
    }
}

/// Computes the pressure of SF6, bar absolute, at a temperature, °C, from the pressure of the
/// same density at 20 °C.
fn sf6_pressure(at_20: f64, celsius: f64) -> f64 {
    let [mut low, mut high] = [0.0, MAX_SF6_DENSITY];
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        let is_less = beattie_bridgeman(middle, 293.15) < at_20;
        if is_less { low = middle } else { high = middle }
    }
    beattie_bridgeman(low, celsius + 273.15)
}

/// Computes the pressure of SF6, bar absolute, at a density, kg/m3, and a temperature, K, by
/// the equation of Beattie and Bridgeman with the constants in common use for switchgear.
fn beattie_bridgeman(density: f64, kelvin: f64) -> f64 {
    let a = 74.9e-6 * (1.0 - 0.727e-3 * density);
    let b = 2.51e-3 * density * (1.0 - 0.846e-3 * density);
    10.0 * (56.926e-6 * density * kelvin * (1.0 + b) - density * density * a)
}

fn walk(base: f64, amplitude: f64) -> NormalValue {
    NormalValue::Walk(base, amplitude)
}

/// Point of a transformer: quantity, role, value, deviation, number of sensors.
type TransformerPoint = (Quantity, &'static str, f64, f64, usize);

/// Monitoring points of a transformer, 51 in all.
const TRANSFORMER: [TransformerPoint; 17] = [
    (("SIML.H2", "hydrogen", "ppm", 0.0, 5000.0, SCAN), "hydrogen", 24.0, 0.4, 1),
    (("SIML.CH4", "methane", "ppm", 0.0, 5000.0, SCAN), "methane", 11.0, 0.2, 1),
    (("SIML.C2H2", "acetylene", "ppm", 0.0, 1000.0, SCAN), "acetylene", 0.3, 0.02, 1),
    (("SIML.C2H4", "ethylene", "ppm", 0.0, 5000.0, SCAN), "ethylene", 8.0, 0.2, 1),
    (("SIML.C2H6", "ethane", "ppm", 0.0, 5000.0, SCAN), "ethane", 6.0, 0.2, 1),
    (("SIML.CO", "carbon monoxide", "ppm", 0.0, 10_000.0, SCAN), "carbon_monoxide", 310.0, 3.0, 1),
    (("SIML.CO2", "carbon dioxide", "ppm", 0.0, 50_000.0, SCAN), "carbon_dioxide", 2100.0, 9.0, 1),
    (("SIML.H2O", "moisture in oil", "ppm", 0.0, 100.0, SCAN), "moisture", 9.0, 0.1, 1),
    (("SIML.Tmp", "top-oil temperature", "°C", -40.0, 150.0, 1000), "top_oil", 44.0, 0.2, 2),
    (("YPTR.HPTmp", "winding hot-spot", "°C", -40.0, 200.0, 1000), "hot_spot", 54.0, 0.3, 2),
    (("SIML.Lev", "oil level", "%", 0.0, 100.0, SCAN), "oil_level", 58.0, 0.2, 2),
    (("SCUR.Core", "core earth current", "mA", 0.0, 1000.0, SCAN), "core_current", 12.0, 0.5, 2),
    (("SIMB.TanD", "bushing loss factor", "%", 0.0, 5.0, SCAN), "loss_factor", 0.34, 0.01, 9),
    (
        ("SPDC.Lev", "partial discharge", "pC", 0.0, 10_000.0, SCAN),
        "partial_discharge",
        35.0,
        4.0,
        4,
    ),
    (("CCGR.Amp", "fan current", "A", 0.0, 10.0, SCAN), "fan_current", 2.1, 0.05, 16),
    (("SVBR.Lev", "tank vibration", "m/s2", 0.0, 50.0, SCAN), "vibration", 3.2, 0.2, 5),
    (("YLTC.OilTmp", "tap changer oil", "°C", -40.0, 150.0, SCAN), "tap_changer_oil", 41.0, 0.3, 1),
];

/// Adds the monitoring points of a transformer.
pub(super) fn add_of_transformer(bay: &str, list: &mut PointListBuilder) {
    for (quantity, role, base, amplitude, sensors) in TRANSFORMER {
        for node in 1..=sensors {
            let is_second = node > 1 && matches!(role, "top_oil" | "hot_spot" | "oil_level");
            let role = if is_second { "second_sensor" } else { role };
            let place = PointContext { bay, equipment: format!("{bay}-TA1"), node, role };
            let point = list.add(PointKind::Monitoring, quantity, place, walk(base, amplitude));
            point.limits[1] = match role {
                "top_oil" => Some(95.0),
                "hot_spot" => Some(118.0),
                _ => None,
            };
        }
    }
}

/// Point of the station: quantity, value, deviation, number of sensors.
type StationPoint = (Quantity, f64, f64, usize);

/// Monitoring points of the station: weather, batteries, fire detection, gas in the switch room,
/// cameras: 102 points.
const STATION: [StationPoint; 9] = [
    (("MMET.EnvTmp", "ambient temperature", "°C", -50.0, 60.0, 1000), OUTSIDE, 0.2, 2),
    (("MMET.EnvHum", "humidity", "%", 0.0, 100.0, SCAN), 54.0, 0.5, 2),
    (("MMET.HorWdSpd", "wind speed", "m/s", 0.0, 60.0, SCAN), 3.0, 1.0, 2),
    (("MMET.EnvPres", "air pressure", "hPa", 800.0, 1100.0, SCAN), 1012.0, 0.3, 1),
    (("MMET.RnfInt", "rain", "mm/h", 0.0, 200.0, SCAN), 0.0, 0.0, 1),
    (("ZBAT.Vol", "battery voltage", "V", 0.0, 300.0, SCAN), 231.0, 0.4, 12),
    (("SFIR.Lev", "smoke density", "%", 0.0, 100.0, 1000), 0.4, 0.1, 40),
    (("SIMG.Room", "SF6 in the room", "ppm", 0.0, 2000.0, SCAN), 2.0, 0.5, 2),
    (("SCAM.Rate", "video stream rate", "Mbit/s", 0.0, 100.0, SCAN), 8.0, 0.6, 40),
];

/// Adds the monitoring points of the station as a whole.
pub(super) fn add_of_station(bay: &str, equipment: &str, list: &mut PointListBuilder) {
    for (quantity, base, amplitude, sensors) in STATION {
        for node in 1..=sensors {
            let place =
                PointContext { bay, equipment: equipment.to_owned(), node, role: "environment" };
            list.add(PointKind::Monitoring, quantity, place, walk(base, amplitude));
        }
    }
}

/// Adds the 6 monitoring points of a 35 kV feeder.
pub(super) fn add_of_feeder(bay: &str, equipment: &str, list: &mut PointListBuilder) {
    let contacts = (1..=3).map(|node| (CONTACT, node, 31.0, 0.4));
    let others = [(PRESSURE, 1, 1.4, 0.002), (GAS_TEMPERATURE, 1, OUTSIDE, 0.2)];
    for (quantity, node, base, amplitude) in
        others.into_iter().chain(contacts).chain([(LEAKAGE, 1, 0.1, 0.02)])
    {
        let place =
            PointContext { bay, equipment: equipment.to_owned(), node, role: "environment" };
        list.add(PointKind::Monitoring, quantity, place, walk(base, amplitude));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gas_of_a_filled_breaker_is_at_its_filling_pressure_at_20_degrees() {
        assert!((sf6_pressure(SF6_FILLING, 20.0) - SF6_FILLING).abs() < 1e-9);
        // The reference equation of SF6 (Guder and Wagner 2009) as CoolProp 8.0.0 has it.
        for (celsius, expected) in REFERENCE {
            let found = sf6_pressure(SF6_FILLING, celsius);
            assert!((found / expected - 1.0).abs() < 0.007, "{celsius}: {found} {expected}");
        }
    }

    /// Temperatures, °C, and pressures, bar, of SF6 that has 7 bar at 20 °C.
    const REFERENCE: [(f64, f64); 3] = [(-20.0, 5.8093), (23.0, 7.0874), (40.0, 7.5797)];
}
