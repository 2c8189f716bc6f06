//! Switches with the tags of their positions, and verdicts on them.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use busbar_plugin_sdk::{
    Binding, DoublePoint, Quality, Reason, TagValue, Value, ValueKind, Verdict,
};

use crate::motion::{DEFAULT_TRAVEL_SECONDS, Motion, MotionWatch};
use crate::settings::{Settings, SwitchSettings};
use crate::travel::Travel;

/// Switch of the settings, with its tag.
pub(crate) struct Switch {
    /// Index of the switch's equipment.
    pub(crate) equipment: usize,
    pub(crate) mechanism: usize,
    pub(crate) travel: Travel,
    /// Tag of the position, or the reason why there is none.
    pub(crate) tag: Result<PositionTag, Cow<'static, str>>,
    watch: MotionWatch,
    travel_seconds: f64,
}

/// Tag of a switch position.
pub(crate) struct PositionTag {
    pub(crate) binding: usize,
    tag_id: String,
    is_double_point: bool,
}

/// Verdict on a switch with its words.
pub(crate) struct SwitchVerdict {
    pub(crate) verdict: Verdict,
    pub(crate) reason: String,
    pub(crate) assumption: String,
    pub(crate) binding: Option<usize>,
}

/// Switches of the overlay, their equipment, and findings on bindings.
#[derive(Default)]
pub(crate) struct Switches {
    pub(crate) list: Vec<Switch>,
    pub(crate) equipment: Vec<String>,
    pub(crate) findings: Vec<String>,
}

impl Switches {
    /// Creates the switches of the settings with the tags of these bindings.
    pub(crate) fn new(settings: &Settings, mechanisms: &[String], bindings: &[Binding]) -> Self {
        let mut by_place: HashMap<(&str, &str), Vec<usize>> = HashMap::new();
        for (index, binding) in bindings.iter().enumerate() {
            by_place.entry((&binding.node_id, &binding.role)).or_default().push(index);
        }
        let untelemetered: HashSet<&String> = settings.untelemetered.iter().collect();
        let mut places: HashMap<&str, usize> = HashMap::new();
        let mut switches = Self::default();
        for of in &settings.switches {
            let equipment = *places.entry(&of.equipment).or_insert(switches.equipment.len());
            if equipment == switches.equipment.len() {
                switches.equipment.push(of.equipment.clone());
            }
            let bound = by_place.get(&(of.equipment.as_str(), of.role.as_str()));
            let bound = bound.map_or(&[][..], Vec::as_slice);
            let is_untelemetered = untelemetered.contains(&of.equipment);
            let (tag, finding) = position_tag(of, is_untelemetered, (bindings, bound));
            switches.findings.extend(finding);
            switches.list.push(Switch {
                equipment,
                mechanism: mechanisms.binary_search(&of.mechanism).unwrap_or_default(),
                travel: Travel::taking(of.travel_seconds),
                tag,
                watch: MotionWatch::default(),
                travel_seconds: of.travel_seconds,
            });
        }
        switches
    }
}

impl Switches {
    /// Keeps observations of switches whose tags stay, after a reload of the bindings.
    pub(crate) fn keep_history(&mut self, before: Self) {
        for (now, before) in self.list.iter_mut().zip(before.list) {
            let is_same = match (&now.tag, &before.tag) {
                (Ok(now), Ok(before)) => now.tag_id == before.tag_id,
                _ => false,
            };
            if is_same {
                (now.watch, now.travel) = (before.watch, before.travel);
            }
        }
    }
}

type Found = (Result<PositionTag, Cow<'static, str>>, Option<String>);

fn position_tag(
    of: &SwitchSettings,
    is_untelemetered: bool,
    (bindings, bound): (&[Binding], &[usize]),
) -> Found {
    let SwitchSettings { equipment, role, .. } = of;
    let index = match bound {
        [index] => *index,
        [] if is_untelemetered => return (Err("declared untelemetered".into()), None),
        [] => {
            let cause = format!("no tag at '{equipment}' has the role '{role}'");
            let remedy = "bind one, or name it in `untelemetered`";
            let reason = format!("no tag has the role '{role}'");
            return (Err(reason.into()), Some(format!("{cause}; {remedy}")));
        }
        [first, second, ..] => {
            let [first, second] = [first, second].map(|index| &bindings[*index].tag_id);
            let cause = format!(
                "the tags '{first}' and '{second}' are both in the role '{role}' at '{equipment}'"
            );
            let reason = format!("'{first}' and '{second}' are both its position");
            return (
                Err(reason.into()),
                Some(format!("{cause}; bind one of them in another role")),
            );
        }
    };
    let Binding { tag_id, kind, .. } = &bindings[index];
    let is_double_point = *kind == ValueKind::DoublePoint;
    let finding = (!is_double_point).then(|| {
        format!(
            "the tag '{tag_id}' in the role '{role}' at '{equipment}' is no double-point; give it \
             the type double_point, or bind another"
        )
    });
    (Ok(PositionTag { binding: index, tag_id: tag_id.clone(), is_double_point }), finding)
}

impl PositionTag {
    /// Returns the position, or the reason why it is not known.
    fn position(&self, values: &[TagValue]) -> Result<DoublePoint, &'static str> {
        if !self.is_double_point {
            return Err("no double-point");
        }
        let tag = values.get(self.binding).ok_or("no value yet")?;
        match (tag.quality, &tag.value) {
            (_, None) => Err("no value yet"),
            (Quality::Bad(Reason::Stale), _) => Err("stale"),
            (Quality::Bad(_), _) => Err("bad"),
            (Quality::Uncertain(_), _) => Err("uncertain"),
            (Quality::Good, Some(Value::DoublePoint(point))) => Ok(*point),
            (Quality::Good, Some(_)) => Err("a value of another type than the tag's"),
        }
    }
}

impl Switch {
    /// Judges the switch at an instant, nanoseconds since 1970-01-01 UTC.
    pub(crate) fn judge(&mut self, values: &[TagValue], unix_nanos: i64) -> SwitchVerdict {
        let tag = match &self.tag {
            Ok(tag) => tag,
            Err(reason) => {
                return SwitchVerdict {
                    verdict: Verdict::Unknown,
                    reason: reason.clone().into_owned(),
                    assumption: String::new(),
                    binding: None,
                };
            }
        };
        let is_default = self.travel_seconds <= 0.0;
        let seconds = if is_default { DEFAULT_TRAVEL_SECONDS } else { self.travel_seconds };
        let position = tag.position(values);
        let motion = self.watch.see(position.ok(), unix_nanos, seconds);
        let (verdict, words) = match motion {
            Motion::Settled => (Verdict::Normal, String::new()),
            Motion::Travelling => (Verdict::Normal, "travelling".to_owned()),
            Motion::TooLong => {
                (Verdict::Abnormal, format!("neither open nor closed for more than {seconds} s"))
            }
            Motion::SinceUnknown => {
                (Verdict::Unknown, "neither open nor closed, and nobody saw since when".to_owned())
            }
            Motion::Contradiction => (Verdict::Abnormal, "open and closed at once".to_owned()),
            Motion::Unknown => (Verdict::Unknown, position.err().unwrap_or_default().to_owned()),
        };
        let is_timed =
            matches!(motion, Motion::Travelling | Motion::TooLong | Motion::SinceUnknown);
        let assumption = match is_default && is_timed {
            true => format!("it travels for at most {seconds} s"),
            false => String::new(),
        };
        let reason = if words.is_empty() { words } else { format!("{}: {words}", tag.tag_id) };
        SwitchVerdict { verdict, reason, assumption, binding: Some(tag.binding) }
    }
}
