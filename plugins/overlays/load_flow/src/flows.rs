//! Flows with their ends, and verdicts on them.

use std::collections::{HashMap, HashSet};

use busbar_plugin_sdk::{Binding, TagValue, Verdict};

use crate::ends::{End, EndJudgment, PowerTag, digits};
use crate::settings::{DEFAULT_LOSS_PERCENT, Direction, FlowSettings, Settings};

/// Flow, by the indices of the equipment described.
pub(crate) struct Flow {
    pub(crate) from_to: [usize; 2],
    pub(crate) ends: Vec<End>,
    pub(crate) caption: String,
    pub(crate) reactive_caption: String,
}

/// Verdict on a flow with its words and the bindings that it rests on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FlowVerdict {
    pub(crate) verdict: Verdict,
    pub(crate) reason: String,
    pub(crate) assumption: String,
    pub(crate) basis: Vec<usize>,
}

/// Flows of the overlay, the equipment that they name, and findings on bindings.
#[derive(Default)]
pub(crate) struct Flows {
    pub(crate) list: Vec<Flow>,
    pub(crate) equipment: Vec<String>,
    /// Flows whose verdict is on each piece: both ends, from where and to where.
    pub(crate) at: Vec<Vec<usize>>,
    pub(crate) findings: Vec<String>,
}

impl Flows {
    /// Creates the flows of the settings with the tags of these bindings.
    pub(crate) fn new(settings: &Settings, bindings: &[Binding]) -> Self {
        let mut flows = Self::default();
        let mut places: HashMap<&str, usize> = HashMap::new();
        let mut own: HashMap<&str, Vec<usize>> = HashMap::new();
        for (index, binding) in bindings.iter().enumerate() {
            own.entry(&binding.node_id).or_default().push(index);
        }
        let mut at_place: HashMap<&str, usize> = HashMap::new();
        for flow in &settings.flows {
            *at_place.entry(&flow.measured_at).or_default() += 1;
        }
        let untelemetered: HashSet<&str> =
            settings.untelemetered.iter().map(String::as_str).collect();
        for (index, of) in settings.flows.iter().enumerate() {
            let mut place = |id| {
                let place = *places.entry(id).or_insert(flows.equipment.len());
                if place == flows.equipment.len() {
                    flows.equipment.push(String::from(id));
                    flows.at.push(Vec::new());
                }
                place
            };
            let from_to = [place(of.from.as_str()), place(of.to.as_str())];
            let mut equipment: Vec<usize> =
                from_to.into_iter().chain(of.ends().map(&mut place)).collect();
            equipment.sort_unstable();
            equipment.dedup();
            for place in &equipment {
                flows.at[*place].push(index);
            }
            let ends = of.ends().map(|id| {
                let own = own.get(id).map_or(&[][..], Vec::as_slice);
                let place = (id, untelemetered.contains(id));
                End::new(place, of, (bindings, own), &mut flows.findings)
            });
            let ends = ends.collect();
            let to = match at_place.get(of.measured_at.as_str()) {
                Some(2..) => format!(" to {}", of.to),
                _ => String::new(),
            };
            let (caption, reactive_caption) =
                (format!("Active power{to}"), format!("Reactive power{to}"));
            flows.list.push(Flow { from_to, ends, caption, reactive_caption });
        }
        // A place with two flows says once what it lacks.
        let mut told = HashSet::new();
        flows.findings.retain(|finding| told.insert(finding.clone()));
        flows
    }
}

impl Flow {
    /// Judges the flow by its ends: above the rating, ends that disagree, else by what is
    /// known of either end.
    pub(crate) fn judge(&self, of: &FlowSettings, values: &[TagValue]) -> FlowVerdict {
        let judged: Vec<EndJudgment> =
            self.ends.iter().map(|end| end.judge(of.rating_mva, values)).collect();
        for (end, judgment) in self.ends.iter().zip(&judged) {
            if let EndJudgment::Above { reason, basis } = judgment {
                let assumption = end.assumption().unwrap_or_default();
                let (reason, basis) = (reason.clone(), basis.clone());
                return FlowVerdict { verdict: Verdict::Abnormal, reason, assumption, basis };
            }
        }
        let mut assumptions: Vec<String> = self.ends.iter().filter_map(End::assumption).collect();
        if let Some(compared) = self.compare(of, values, &mut assumptions) {
            return compared;
        }
        if let Some(above) = self.above_by_other_end(of, values, &assumptions) {
            return above;
        }
        let mut known: Vec<(bool, &[usize])> = Vec::new();
        let mut doubted: Vec<(&End, &str, &[usize])> = Vec::new();
        for (end, judgment) in self.ends.iter().zip(&judged) {
            match judgment {
                EndJudgment::Within { has_reactive, basis } => known.push((*has_reactive, basis)),
                EndJudgment::Above { reason, basis } | EndJudgment::Unknown { reason, basis } => {
                    doubted.push((end, reason, basis));
                }
            }
        }
        let has_reactive = known.iter().any(|(has_reactive, _)| *has_reactive);
        // An end stands in for the other one with all that the other one measures.
        let stands_in = |end: &End| !known.is_empty() && (has_reactive || end.reactive.is_empty());
        if let Some((_, reason, basis)) = doubted.iter().find(|(end, ..)| !stands_in(end)) {
            return FlowVerdict {
                verdict: Verdict::Unknown,
                reason: (*reason).to_owned(),
                assumption: String::new(),
                basis: basis.to_vec(),
            };
        }
        if let Some((_, reason, _)) = doubted.first() {
            assumptions.insert(0, format!("the other end is as this one, {reason}"));
        }
        if !has_reactive {
            assumptions.insert(0, "reactive power is not measured".to_owned());
        }
        FlowVerdict {
            verdict: Verdict::Normal,
            reason: String::new(),
            assumption: assumptions.join("; "),
            basis: known.iter().flat_map(|(_, basis)| basis.iter().copied()).collect(),
        }
    }

    /// Compares the active power of both ends where it is known at both.
    fn compare(
        &self,
        of: &FlowSettings,
        values: &[TagValue],
        assumptions: &mut Vec<String>,
    ) -> Option<FlowVerdict> {
        let [first, other] = &self.ends[..] else { return None };
        let known = |end: &End| known(&end.active, values);
        let percent = of.max_loss_percent.unwrap_or(DEFAULT_LOSS_PERCENT);
        let most = of.max_loss();
        let mut worst: Option<(f64, [usize; 2])> = None;
        for (own, here) in known(first) {
            for &(their, there) in &known(other) {
                let difference = match of.other_end_counts {
                    Some(Direction::Along) => (here - there).abs(),
                    Some(Direction::Against) => (here + there).abs(),
                    None => (here.abs() - there.abs()).abs(),
                };
                if worst.is_none_or(|(before, _)| difference > before) {
                    worst = Some((difference, [own, their]));
                }
            }
        }
        let (difference, basis) = worst?;
        if of.max_loss_percent.is_none() {
            assumptions.push(format!("at most {percent} % of the rating is lost"));
        }
        if of.other_end_counts.is_none() {
            assumptions.push("either sign at the other end".to_owned());
        }
        (difference > most).then(|| FlowVerdict {
            verdict: Verdict::Abnormal,
            reason: format!(
                "ends disagree: {} and {} differ by {} MW, more than {} MW",
                first.id,
                other.id,
                digits(difference),
                digits(most)
            ),
            assumption: assumptions.join("; "),
            basis: basis.to_vec(),
        })
    }

    /// Finds an end that is above the rating by its reactive power and the active power of
    /// the other end: with less active power than that, the ends would disagree.
    fn above_by_other_end(
        &self,
        of: &FlowSettings,
        values: &[TagValue],
        assumptions: &[String],
    ) -> Option<FlowVerdict> {
        let [first, other] = &self.ends[..] else { return None };
        let largest = |tags: &[PowerTag]| {
            known(tags, values).into_iter().max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()))
        };
        let above = |[end, other]: [&End; 2]| {
            let (own, reactive) = largest(&end.reactive)?;
            let (their, active) = largest(&other.active)?;
            let least = (active.abs() - of.max_loss()).max(0.0).hypot(reactive);
            let is_above = !end.active.is_empty() && least > of.rating_mva;
            is_above.then(|| (format!("{}: {} MVA at least", end.id, digits(least)), [own, their]))
        };
        let (reason, basis) = above([first, other]).or_else(|| above([other, first]))?;
        let reason =
            format!("{reason} by the other end, above the rating of {} MVA", of.rating_mva);
        Some(FlowVerdict {
            verdict: Verdict::Abnormal,
            reason,
            assumption: assumptions.join("; "),
            basis: basis.to_vec(),
        })
    }
}

/// Returns the powers of these tags that are known, with their bindings.
fn known(tags: &[PowerTag], values: &[TagValue]) -> Vec<(usize, f64)> {
    tags.iter().filter_map(|tag| Some((tag.binding, tag.value(values).ok()?))).collect()
}
