//! Silence test of overlays: seeded inputs with faults, and the rule that every verdict must
//! satisfy.
//!
//! A verdict is never normal where a completion of what is missing is abnormal, and never
//! unknown where all completions agree. A test enumerates the completions of its inputs by a
//! judgment of its own, and hands what they admit to [`AdmittedVerdicts::check`].

use std::time::Duration;

use super::{Drawing, FaultGenerator};
use crate::{Origin, Quality, Reason, TagValue, Text, Value, ValueKind, Verdict};

/// Environment variable with the number of cases of each silence test.
pub const SILENCE_CASES_VARIABLE: &str = "BUSBAR_SILENCE_CASES";
/// Cases without that variable: a sample for every run of the tests.
const DEFAULT_CASES: u64 = 2_000;
/// Rarity of faults: one input in so many has one.
const FAULT_RARITY: usize = 3;
/// Oldest value that is made, milliseconds.
const MAX_AGE_MILLIS: usize = 100_000;
/// Texts that come where a number or a state is expected, and may be mistaken for one.
const WORDS: [&str; 5] = ["", "20", "0", "on", "AUTO"];

/// Reads the number of cases of a silence test from the environment.
pub fn silence_cases() -> u64 {
    let set = std::env::var(SILENCE_CASES_VARIABLE).ok();
    set.and_then(|text| text.parse().ok()).unwrap_or(DEFAULT_CASES)
}

/// Fault of one input of an overlay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputFault {
    /// Bad value; the last one stays.
    Bad,
    /// Value of doubtful quality.
    Uncertain,
    /// Input without any value yet.
    Missing,
    /// Value that is called good and is not a finite number.
    NotFinite,
    /// Value that is called good and is of another type than the tag's.
    WrongKind,
}

impl InputFault {
    /// All faults of inputs.
    pub const ALL: [Self; 5] =
        [Self::Bad, Self::Uncertain, Self::Missing, Self::NotFinite, Self::WrongKind];
}

/// Seeded source of inputs with faults.
#[derive(Clone, Debug)]
pub struct InputGenerator {
    random: FaultGenerator,
}

impl InputGenerator {
    /// Creates the generator of a case.
    pub fn new(case: u64) -> Self {
        Self { random: FaultGenerator::new(case) }
    }

    /// Returns a random number below a limit; 0 where the limit is 0.
    pub fn below(&mut self, limit: usize) -> usize {
        self.random.below(limit)
    }

    /// Draws an event that has a chance of one in so many.
    pub fn one_in(&mut self, rarity: usize) -> bool {
        self.random.one_in(rarity)
    }

    /// Chooses one of these at random.
    ///
    /// # Panics
    /// When there is none.
    pub fn choice<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// Returns an input that has this value, or a fault.
    pub fn input(&mut self, value: Value) -> (TagValue, Option<InputFault>) {
        let fault = self.one_in(FAULT_RARITY).then(|| self.choice(&InputFault::ALL));
        let age = Duration::from_millis(self.below(MAX_AGE_MILLIS) as u64);
        let kind = value.kind();
        let good =
            TagValue { value: Some(value), quality: Quality::Good, age, origin: Origin::LIVE };
        let reasons = [Reason::Communication, Reason::Sensor, Reason::Stale, Reason::Unknown];
        let reason = self.choice(&reasons);
        let of = match fault {
            None => good,
            Some(InputFault::Bad) => TagValue { quality: Quality::Bad(reason), ..good },
            Some(InputFault::Uncertain) => TagValue { quality: Quality::Uncertain(reason), ..good },
            Some(InputFault::Missing) => {
                TagValue { value: None, quality: Quality::Bad(Reason::NotConnected), ..good }
            }
            Some(InputFault::NotFinite) => {
                let value = self.choice(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
                TagValue { value: Some(Value::F64(value)), ..good }
            }
            Some(InputFault::WrongKind) => {
                TagValue { value: Some(self.value_of_other_kind(kind)), ..good }
            }
        };
        (of, fault)
    }

    /// Returns a value of another kind: a state for a number, a number for a state, a text for either.
    fn value_of_other_kind(&mut self, kind: ValueKind) -> Value {
        let is_text = kind != ValueKind::Text && self.one_in(2);
        if let Some(text) = is_text.then(|| Text::new(self.choice(&WORDS))).flatten() {
            return Value::Text(text);
        }
        match kind {
            ValueKind::Bool | ValueKind::DoublePoint => Value::F64(1.0),
            ValueKind::F64 | ValueKind::I64 => Value::Bool(true),
            ValueKind::Text => match self.one_in(2) {
                true => Value::Bool(true),
                false => Value::I64(1),
            },
        }
    }
}

/// Verdicts that an input admits: one for each of its completions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AdmittedVerdicts {
    normal: bool,
    abnormal: bool,
}

impl AdmittedVerdicts {
    /// Adds the verdict on one completion.
    pub fn add(&mut self, is_abnormal: bool) {
        self.normal |= !is_abnormal;
        self.abnormal |= is_abnormal;
    }

    /// Returns the verdict that all completions agree on, or unknown.
    pub fn verdict(self) -> Verdict {
        match (self.normal, self.abnormal) {
            (true, false) => Verdict::Normal,
            (false, true) => Verdict::Abnormal,
            _ => Verdict::Unknown,
        }
    }

    /// Checks the verdict of a drawing on a piece of equipment.
    ///
    /// # Panics
    /// When the verdict is another than that on which all completions agree.
    #[track_caller]
    pub fn check(self, drawing: &Drawing, equipment: usize, story: &str) {
        let drawn = drawing.verdict(equipment);
        let drawn = drawn.unwrap_or_else(|| panic!("{story}: no verdict on {equipment}"));
        assert_eq!(drawn.verdict, self.verdict(), "{story}: {drawn:?}");
    }
}

/// Checks the form of all verdicts of a drawing: one for every piece of equipment described;
/// reasons where there must be any; bases that are good; no text with a negative zero.
///
/// # Panics
/// When a verdict breaks one of these rules.
#[track_caller]
pub fn check_verdicts(drawing: &Drawing, equipment: usize, values: &[TagValue], story: &str) {
    let mut count = vec![0; equipment];
    for drawn in &drawing.verdicts {
        count[drawn.equipment] += 1;
        let is_silent = drawn.reason.trim().is_empty();
        let needs_reason = drawn.verdict != Verdict::Normal || drawn.is_assumed;
        assert!(!(needs_reason && is_silent), "{story}: without a reason: {drawn:?}");
        let is_good = |binding: &usize| values[*binding].quality == Quality::Good;
        let is_known = drawn.verdict != Verdict::Unknown;
        let rests_on_good = drawn.basis.iter().all(is_good);
        assert!(!is_known || rests_on_good, "{story}: it rests on what is not good: {drawn:?}");
        assert!(!has_negative_zero(&drawn.reason), "{story}: {drawn:?}");
    }
    assert!(count.iter().all(|count| *count == 1), "{story}: verdicts a piece: {count:?}");
    for line in &drawing.lines {
        assert!(!has_negative_zero(&line.text), "{story}: {line:?}");
    }
}

/// Finds a number that is zero with a minus before it.
fn has_negative_zero(text: &str) -> bool {
    let is_of_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | 'e');
    text.split(|c| !is_of_number(c)).any(|word| {
        let digits = word.strip_prefix('-').unwrap_or_default();
        !digits.is_empty() && digits.chars().all(|c| matches!(c, '0' | '.'))
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_same_case_makes_the_same_inputs_and_all_faults_come() {
        let of = |case| {
            let mut inputs = InputGenerator::new(case);
            (0..200).map(|_| inputs.input(Value::F64(1.5)).1).collect::<Vec<_>>()
        };
        assert_eq!(of(7), of(7));
        assert_ne!(of(7), of(8));
        for fault in InputFault::ALL {
            assert!(of(7).contains(&Some(fault)), "{fault:?}");
        }
        assert!(of(7).iter().filter(|fault| fault.is_none()).count() > 100);
    }

    #[test]
    fn wrong_kinds_are_states_numbers_and_texts() {
        let kinds = |value: Value| {
            let mut inputs = InputGenerator::new(1);
            let inputs = std::iter::repeat_with(|| inputs.input(value.clone()));
            let wrong = inputs.filter(|(_, fault)| *fault == Some(InputFault::WrongKind));
            let kinds = wrong.take(40).filter_map(|(tag, _)| tag.value.map(|of| of.kind().code()));
            kinds.collect::<BTreeSet<_>>().into_iter().filter_map(ValueKind::from_code).collect()
        };
        let check = |value, expected: &[ValueKind]| {
            let found: Vec<ValueKind> = kinds(value);
            assert_eq!(found, expected);
        };
        use ValueKind::{Bool, F64, I64};
        check(Value::F64(1.5), &[Bool, ValueKind::Text]);
        check(Value::I64(1), &[Bool, ValueKind::Text]);
        check(Value::Bool(true), &[F64, ValueKind::Text]);
        check(Value::Text(Text::new("AUTO").unwrap()), &[I64, Bool]);
    }

    #[test]
    fn completions_that_differ_leave_it_unknown() {
        let mut admitted = AdmittedVerdicts::default();
        admitted.add(true);
        assert_eq!(admitted.verdict(), Verdict::Abnormal);
        admitted.add(false);
        assert_eq!(admitted.verdict(), Verdict::Unknown);
    }

    #[test]
    fn negative_zeros_are_found() {
        for text in ["-0.00 MW", "-0", "5 A, -0.0 %"] {
            assert!(has_negative_zero(text), "{text}");
        }
        for text in ["-0.01 MW", "0.00", "BV1-0A", "2026-01-00", "–"] {
            assert!(!has_negative_zero(text), "{text}");
        }
    }
}
