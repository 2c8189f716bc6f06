//! Readings of compartments: values in one unit, and what is believed of them.

use busbar_plugin_sdk::{DoublePoint, Quality, TagValue, Value};

use crate::assessment::Range;
use crate::compartments::{Compartment, Input};
use crate::equation_of_state::air_pressure;
use crate::settings::{SEA_LEVEL, Settings};

/// Pressures that the air has, MPa: from 5,500 m to a strong anticyclone at sea level.
const AIR_RANGE: Range = Range { low: 0.05, high: 0.11 };

/// Temperature of a compartment's gas, °C, with the reason for which it is not known.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TemperatureReading {
    pub(crate) range: Range,
    pub(crate) doubt: Option<String>,
}

/// Absolute pressure of a compartment, MPa.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PressureReading {
    pub(crate) range: Range,
    /// Default that it rests on; empty for none.
    pub(crate) assumption: &'static str,
    pub(crate) doubt: Option<String>,
}

/// Good temperatures of all compartments, sorted, each tag once.
pub(crate) struct Neighbors<'c>(Vec<(f64, &'c str)>);

impl<'c> Neighbors<'c> {
    pub(crate) fn new(
        settings: &Settings,
        compartments: &'c [Compartment],
        values: &[TagValue],
    ) -> Self {
        let inputs = compartments.iter().filter_map(|of| of.temperature.as_ref());
        let believed = |input: &'c Input| {
            let celsius = read(input, values)?;
            is_in(settings.temperature_range, celsius).then_some((celsius, input.tag_id.as_str()))
        };
        let mut all: Vec<_> = inputs.filter_map(believed).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(b.1)));
        all.dedup();
        Self(all)
    }

    /// Median of the temperatures of all tags, which one that is wrong does not move; of the
    /// other where there are but two, and `None` of one alone.
    fn median_beside(&self, tag_id: &str) -> Option<f64> {
        let at = |place: usize| self.0.get(place).map(|of| of.0);
        match self.0.as_slice() {
            [] | [_] => None,
            [first, second] => Some(if first.1 == tag_id { second.0 } else { first.0 }),
            all => Some(0.5 * (at((all.len() - 1) / 2)? + at(all.len() / 2)?)),
        }
    }

    /// Temperature of a compartment, as far as it is believed.
    pub(crate) fn temperature(
        &self,
        settings: &Settings,
        compartment: &Compartment,
        values: &[TagValue],
    ) -> TemperatureReading {
        let [low, high] = settings.temperature_range;
        let unknown = |doubt| TemperatureReading { range: Range { low, high }, doubt: Some(doubt) };
        let Some(input) = &compartment.temperature else {
            return unknown("the gas temperature is not known".into());
        };
        let Some(celsius) = read(input, values) else {
            return unknown(format!("{} has no good value", input.tag_id));
        };
        if !is_in([low, high], celsius) {
            return unknown(format!(
                "{} is implausible: {celsius:.1} °C is outside {low} to {high}",
                input.tag_id
            ));
        }
        let median = self.median_beside(&input.tag_id);
        if let Some(median) =
            median.filter(|median| (celsius - median).abs() > settings.temperature_spread)
        {
            return unknown(format!(
                "{} is implausible: {celsius:.1} °C beside a median of {median:.1} of the others",
                input.tag_id
            ));
        }
        TemperatureReading { range: Range::exactly(celsius), doubt: None }
    }
}

/// Absolute pressure of a compartment; the reason where there is none.
pub(crate) fn read_pressure(
    settings: &Settings,
    compartment: &Compartment,
    values: &[TagValue],
) -> Result<PressureReading, String> {
    let missing = || compartment.missing.clone().unwrap_or_else(|| "no pressure".into());
    let input = compartment.pressure.as_ref().ok_or_else(missing)?;
    let pressure =
        read(input, values).ok_or_else(|| format!("{} has no good value", input.tag_id))?;
    let air = match compartment.is_gauge {
        true => read_air(settings, compartment, values),
        false => PressureReading { range: Range::exactly(0.0), assumption: "", doubt: None },
    };
    let unit = settings.unit.megapascals();
    let [low, high] = [air.range.low, air.range.high].map(|air| pressure * unit + air);
    if high < 0.0 {
        return Err(format!("{} is negative: {pressure:.3}", input.tag_id));
    }
    Ok(PressureReading { range: Range { low: low.max(0.0), high }, ..air })
}

/// Pressure of the air around, MPa.
fn read_air(
    settings: &Settings,
    compartment: &Compartment,
    values: &[TagValue],
) -> PressureReading {
    let exactly =
        |air, assumption| PressureReading { range: Range::exactly(air), assumption, doubt: None };
    if compartment.air.is_empty() {
        return exactly(settings.altitude_metres.map_or(SEA_LEVEL, air_pressure), "");
    }
    let unit = settings.unit.megapascals();
    let believed = |input: &Input| {
        let air = read(input, values)? * unit;
        is_in([AIR_RANGE.low, AIR_RANGE.high], air).then_some(air)
    };
    let all: Option<Vec<f64>> = compartment.air.iter().map(believed).collect();
    match (all, settings.altitude_metres) {
        (Some(all), _) => {
            let low = all.iter().copied().fold(f64::INFINITY, f64::min);
            let high = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let doubt = (low < high).then(|| "air pressures equally near differ".into());
            PressureReading { range: Range { low, high }, assumption: "", doubt }
        }
        (None, Some(altitude)) => exactly(air_pressure(altitude), "air pressure by the altitude"),
        (None, None) => PressureReading {
            range: AIR_RANGE,
            assumption: "",
            doubt: Some("the air pressure has no good or plausible value".into()),
        },
    }
}

/// State of the density contacts of a compartment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ContactState {
    /// Compartment without a density contact.
    Absent,
    /// All are known, and none reports an alarm.
    Calm,
    /// The binding with this index reports one.
    Alarm(usize),
    /// None reports one, and one has no good value.
    Missing,
}

pub(crate) fn read_contacts(contacts: &[usize], values: &[TagValue]) -> ContactState {
    let state = |binding: &usize| {
        let TagValue { value, quality, .. } = values.get(*binding)?;
        match value.as_ref().filter(|_| *quality == Quality::Good)? {
            Value::Bool(alarm) => Some(*alarm),
            Value::I64(0) => Some(false),
            Value::I64(1) => Some(true),
            Value::F64(0.0) => Some(false),
            Value::F64(1.0) => Some(true),
            Value::DoublePoint(DoublePoint::Off) => Some(false),
            Value::DoublePoint(DoublePoint::On) => Some(true),
            _ => None,
        }
    };
    let states: Vec<Option<bool>> = contacts.iter().map(state).collect();
    if let Some(place) = states.iter().position(|state| *state == Some(true)) {
        return ContactState::Alarm(contacts[place]);
    }
    match states.as_slice() {
        [] => ContactState::Absent,
        states if states.contains(&None) => ContactState::Missing,
        _ => ContactState::Calm,
    }
}

/// Good value of an input in its unit.
fn read(input: &Input, values: &[TagValue]) -> Option<f64> {
    let number = values.get(input.binding)?.good_number()?;
    Some(input.conversion.apply(number)).filter(|number| number.is_finite())
}

fn is_in([low, high]: [f64; 2], value: f64) -> bool {
    (low..=high).contains(&value)
}
