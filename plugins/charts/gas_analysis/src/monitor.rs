//! Monitor of one transformer: its gases by tags, and the verdict on them.

use busbar_plugin_sdk::units::Quantity;
use busbar_plugin_sdk::{Binding, TagValue, Verdict};
use dga::c57_104::{GASES, Status};
use dga::{Gas, Sample};

use crate::gas_input::Input;
use crate::judged::{Judged, of_monitor};
use crate::settings::Settings;
use crate::source::EXTRAS;
use crate::status_bounds::StatusBounds;
use crate::verdict::{self, NOT_JUDGED};

/// Before the formula of a gas in lower case, the role of its tag: `gas_h2`.
const ROLE: &str = "gas_";
/// Quantity and unit of each of [`EXTRAS`].
const EXTRA_UNITS: [(Quantity, &str); EXTRAS.len()] =
    [(Quantity::Temperature, "°C"), (Quantity::Ratio, "p.u.")];

/// The tags of one transformer.
pub(crate) struct Monitor {
    pub(crate) id: String,
    /// Node of its lines; none where no gas is bound.
    pub(crate) node: Option<u32>,
    is_untelemetered: bool,
    gases: Vec<(Gas, Input)>,
    extras: [Option<Input>; EXTRAS.len()],
    /// Sample that was judged last, and the words for it.
    pub(crate) last: Option<(Judged, String)>,
}

/// Judgment on a monitor in one frame.
pub(crate) struct MonitorJudgment {
    pub(crate) judged: Judged,
    /// Text of the line, and the binding of that line.
    pub(crate) told: String,
    pub(crate) line_binding: Option<usize>,
    /// Status that is certain.
    pub(crate) least: Status,
    /// Highest status that what is missing admits.
    pub(crate) most: Status,
    pub(crate) verdict: Verdict,
    pub(crate) reason: String,
    pub(crate) assumption: String,
    pub(crate) basis: Vec<usize>,
    /// Bindings that the state of the legend rests on.
    pub(crate) state_basis: Vec<usize>,
}

impl Monitor {
    /// The monitor of a transformer by its own bindings; what they lack is added to the
    /// findings.
    pub(crate) fn new(
        id: &str,
        is_untelemetered: bool,
        (bindings, own): (&[Binding], &[usize]),
        findings: &mut Vec<String>,
    ) -> Self {
        let mut input = |name: &str, quantity, unit| {
            let is_it = |role: &str| {
                role.strip_prefix(ROLE).is_some_and(|rest| rest.eq_ignore_ascii_case(name))
            };
            let in_role: Vec<usize> =
                own.iter().copied().filter(|index| is_it(&bindings[*index].role)).collect();
            Input::new(bindings, &in_role, (quantity, unit), findings)
        };
        let gases = Gas::ALL.into_iter();
        let gases: Vec<(Gas, Input)> = gases
            .filter_map(|gas| Some((gas, input(gas.formula(), Quantity::Concentration, "ppm")?)))
            .collect();
        let extras = std::array::from_fn(|index| {
            let (quantity, unit) = EXTRA_UNITS[index];
            input(EXTRAS[index], quantity, unit)
        });
        let node = gases.first().map(|(_, input)| bindings[input.binding].node);
        let monitor = Self { id: id.to_owned(), node, is_untelemetered, gases, extras, last: None };
        let missing: Vec<String> = monitor
            .missing(&Gas::FIVE)
            .map(|gas| format!("'{ROLE}{}'", gas.formula().to_lowercase()))
            .collect();
        if !missing.is_empty() && !is_untelemetered {
            let missing = missing.join(", ");
            findings.push(format!(
                "no tag at '{id}' has the role {missing}; bind one, or name the transformer in \
                 `untelemetered`"
            ));
        }
        monitor
    }

    fn missing<'a>(&'a self, gases: &'a [Gas]) -> impl Iterator<Item = Gas> + 'a {
        let is_bound = |gas: &Gas| self.gases.iter().any(|(own, _)| own == gas);
        gases.iter().copied().filter(move |gas| !is_bound(gas))
    }

    /// Judges what the tags say now.
    pub(crate) fn judge(
        &mut self,
        values: &[TagValue],
        unix_nanos: i64,
        settings: &Settings,
    ) -> MonitorJudgment {
        let mut sample = Sample::new();
        let mut doubts: Vec<(Gas, usize, String)> = Vec::new();
        for (gas, input) in &self.gases {
            match input.measured(values) {
                Ok(concentration) => sample = sample.with(*gas, concentration),
                Err(why) => doubts.push((*gas, input.binding, why)),
            }
        }
        let number = |input: &Input| input.number(values).ok().map(|number| number as f32);
        let extras = self.extras.each_ref().map(|of| of.as_ref().and_then(number));
        let extras = extras.map(|number| number.unwrap_or(f32::NAN));
        let is_of_tables = |(gas, ..): &&(Gas, usize, String)| GASES.contains(gas);
        let doubted = doubts.iter().filter(is_of_tables).count();
        let missing: Vec<&str> = self.missing(&Gas::FIVE).map(Gas::formula).collect();
        let are_others_open = doubted > 0 || !missing.is_empty();
        let bounds = StatusBounds::new(&sample, are_others_open, settings.age.into());
        let StatusBounds { least, most, .. } = bounds;
        let verdict = match (least, most) {
            (Status::Two | Status::Three, _) => Verdict::Abnormal,
            (Status::One, Status::One) => Verdict::Normal,
            (Status::One, _) => Verdict::Unknown,
        };
        let doubt = (verdict == Verdict::Unknown || doubted > 0)
            .then(|| self.doubt(&doubts, &missing, &bounds, verdict));
        let (judged, told, line_binding) = match doubt {
            Some((doubt, binding)) => {
                self.last = None;
                let doubt = format!("not judged: {doubt}");
                let judged = Judged { extras, ..not_judged(unix_nanos, sample, &doubt) };
                let told = match least {
                    Status::One => doubt,
                    least => format!("status {least} at least; {doubt}"),
                };
                (judged, told, binding)
            }
            None => {
                let whole = self.judge_whole((sample, extras), unix_nanos, least, settings);
                let (judged, told, binding) = whole;
                let told = if most > least { format!("at least {told}") } else { told };
                (judged, told, binding)
            }
        };
        let reason = match verdict {
            Verdict::Normal => "",
            Verdict::Abnormal => &told,
            Verdict::Unknown => told.strip_prefix("not judged: ").unwrap_or(&told),
        };
        let reason = reason.to_owned();
        let basis = self.basis(verdict, &bounds, values);
        let is_needed = |binding: &usize| {
            judged.state == NOT_JUDGED || !doubts.iter().any(|(_, other, _)| other == binding)
        };
        let all = self.gases.iter().map(|(_, input)| input.binding);
        let state_basis = all.filter(is_needed).collect();
        let assumption = match verdict {
            Verdict::Unknown => String::new(),
            _ => self.assumption(verdict),
        };
        MonitorJudgment {
            judged,
            told,
            line_binding,
            least,
            most,
            verdict,
            reason,
            assumption,
            basis,
            state_basis,
        }
    }

    /// Judges a sample whose status is certain enough for a record of its own.
    fn judge_whole(
        &mut self,
        (sample, extras): (Sample, [f32; EXTRAS.len()]),
        unix_nanos: i64,
        status: Status,
        settings: &Settings,
    ) -> (Judged, String, Option<usize>) {
        let binding = self.gases.first().map(|(_, input)| input.binding);
        match &self.last {
            // Most frames bring the values of the frame before.
            Some((judged, told)) if judged.sample == sample => {
                (Judged { unix_nanos, extras, ..judged.clone() }, told.clone(), binding)
            }
            _ => {
                let read = (sample, extras);
                let (judged, judgement) = of_monitor(unix_nanos, read, status, settings);
                let told = verdict::in_short(judged.status, &judgement);
                self.last = Some((judged.clone(), told.clone()));
                (judged, told, binding)
            }
        }
    }

    /// Words for what is not known, and the binding that they are told at.
    fn doubt(
        &self,
        doubts: &[(Gas, usize, String)],
        missing: &[&str],
        bounds: &StatusBounds,
        verdict: Verdict,
    ) -> (String, Option<usize>) {
        let line = self.gases.first().map(|(_, input)| input.binding);
        // O2 and N2 are told where the row of the tables decides.
        let is_told = |gas: &Gas| GASES.contains(gas) || bounds.needs_ratio;
        let mut told = doubts.iter().filter(|(gas, ..)| is_told(gas));
        if let Some((gas, binding, why)) = told.next() {
            let more = match told.count() {
                0 => String::new(),
                count => format!(" and {count} more"),
            };
            return (format!("{} {why}{more}", gas.formula()), Some(*binding));
        }
        if self.gases.is_empty() {
            let words = match self.is_untelemetered {
                true => "declared untelemetered",
                false => "no tag has the role of a gas",
            };
            return (words.to_owned(), None);
        }
        if verdict == Verdict::Unknown && missing.is_empty() {
            return ("O2 and N2 are not measured, and either table may hold".to_owned(), line);
        }
        (format!("{} not measured", missing.join(", ")), line)
    }

    /// Bindings that the verdict rests on.
    fn basis(&self, verdict: Verdict, bounds: &StatusBounds, values: &[TagValue]) -> Vec<usize> {
        let is_ratio = |gas: Gas| matches!(gas, Gas::O2 | Gas::N2);
        let is_good = |input: &Input| input.measured(values).is_ok();
        let is_needed = |(gas, input): &&(Gas, Input)| match verdict {
            Verdict::Unknown => !is_good(input),
            Verdict::Abnormal => {
                bounds.above.contains(gas)
                    || (is_ratio(*gas) && bounds.needs_ratio && is_good(input))
            }
            Verdict::Normal => !is_ratio(*gas) || bounds.needs_ratio,
        };
        self.gases.iter().filter(is_needed).map(|(_, input)| input.binding).collect()
    }

    /// Words for the defaults that a verdict rests on.
    fn assumption(&self, verdict: Verdict) -> String {
        let missing: Vec<&str> = match verdict {
            Verdict::Normal => self.missing(&GASES).map(Gas::formula).collect(),
            _ => Vec::new(),
        };
        let mut words = Vec::new();
        if !missing.is_empty() {
            words.push(format!("{} not measured, as in healthy oil", missing.join(" and ")));
        }
        let is_assumed = |(_, input): &&(Gas, Input)| input.is_assumed();
        if let Some((gas, _)) = self.gases.iter().find(is_assumed) {
            words.push(format!("{} is in ppm", gas.formula()));
        }
        words.join("; ")
    }
}

/// A record of a transformer that is not judged.
pub(crate) fn not_judged(unix_nanos: i64, sample: Sample, doubt: &str) -> Judged {
    Judged {
        unix_nanos,
        sample,
        extras: [f32::NAN; EXTRAS.len()],
        status: None,
        state: NOT_JUDGED,
        is_online: true,
        doubt: Some(doubt.into()),
    }
}
