//! Tags of a monitor with their conversions: gases, temperature and load.

use std::time::Duration;

use busbar_plugin_sdk::units::{Quantity, UnitConversion};
use busbar_plugin_sdk::{Binding, Quality, Reason, TagValue};
use dga::Concentration;

/// A tag with its conversion, or the reason why there is none.
pub(crate) struct Input {
    pub(crate) binding: usize,
    conversion: Result<UnitConversion, String>,
}

type NoConversion = (String, String);

/// The conversion of a role's only tag; else the reason why there is none, and the finding.
fn conversion(
    bindings: &[Binding],
    in_role: &[usize],
    (quantity, unit): (Quantity, &str),
) -> Result<UnitConversion, NoConversion> {
    let Some((first, more)) = in_role.split_first() else {
        return Err(("is not bound".to_owned(), String::new()));
    };
    let Binding { tag_id, role, node_id, kind, .. } = &bindings[*first];
    if let Some(second) = more.first() {
        let second = &bindings[*second].tag_id;
        return Err((
            "has two tags".to_owned(),
            format!(
                "the tags '{tag_id}' and '{second}' are both in the role '{role}' at '{node_id}'; \
                 bind one of them in another role"
            ),
        ));
    }
    if !kind.is_quantity() {
        return Err((
            "is no number".to_owned(),
            format!(
                "the tag '{tag_id}' in the role '{role}' at '{node_id}' is no number; bind one of \
                 the type f64 or i64"
            ),
        ));
    }
    let conversion = UnitConversion::for_binding(&bindings[*first], quantity, unit);
    conversion.map_err(|finding| ("has a unit that cannot be converted".to_owned(), finding))
}

impl Input {
    /// The tag in a role among these bindings, if there is one; what is wrong with it is
    /// added to the findings.
    pub(crate) fn new(
        bindings: &[Binding],
        in_role: &[usize],
        wanted: (Quantity, &str),
        findings: &mut Vec<String>,
    ) -> Option<Self> {
        let binding = *in_role.first()?;
        let conversion = conversion(bindings, in_role, wanted).map_err(|(reason, finding)| {
            findings.push(finding);
            reason
        });
        Some(Self { binding, conversion })
    }

    /// Reports whether the tag has no unit and the one wanted is assumed.
    pub(crate) fn is_assumed(&self) -> bool {
        self.conversion.as_ref().is_ok_and(|conversion| conversion.is_assumed)
    }

    /// The number in the unit wanted, or the reason why it does not count.
    pub(crate) fn number(&self, values: &[TagValue]) -> Result<f64, String> {
        let conversion = self.conversion.as_ref().map_err(String::clone)?;
        let value = values.get(self.binding).ok_or("has no value yet")?;
        let age = in_words(value.age);
        match value.quality {
            Quality::Good => {
                let number = value.good_number().map(|number| conversion.apply(number));
                let number = number.filter(|number| number.is_finite());
                number.ok_or_else(|| "is no finite number".to_owned())
            }
            _ if value.value.is_none() => Err("has no value yet".into()),
            Quality::Bad(Reason::Stale) => Err(format!("stale for {age}")),
            Quality::Uncertain(_) => Err(format!("uncertain, {age} old")),
            Quality::Bad(_) => Err(format!("bad, last good {age} ago")),
        }
    }

    /// The concentration of a gas, or the reason why it does not count.
    pub(crate) fn measured(&self, values: &[TagValue]) -> Result<Concentration, String> {
        let ppm = self.number(values)?;
        Concentration::measured(ppm + 0.0).map_err(|error| error.to_string())
    }
}

fn in_words(age: Duration) -> String {
    match age.as_secs() {
        seconds if seconds < 120 => format!("{seconds} s"),
        seconds if seconds < 7200 => format!("{} min", seconds / 60),
        seconds if seconds < 172_800 => format!("{} h", seconds / 3600),
        seconds => format!("{} d", seconds / 86_400),
    }
}
