//! Derived tags: evaluation order and values of expressions over other tags.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap};

use busbar_types::{DoublePoint, Origin, Quality, Value, ValueKind};

use crate::{Expression, Moment, Sample, TagHandle, TagSpec, TagSpecError, TagState};

/// Derived tags of a table in topological order: each after its inputs.
#[derive(Debug, Default)]
pub(crate) struct Derivations {
    rules: Vec<Rule>,
    /// The rules that rest on each tag.
    rules_by_input: HashMap<TagHandle, Vec<usize>>,
}

/// Expression of one derived tag, with its inputs.
#[derive(Debug)]
pub(crate) struct Rule {
    pub(crate) tag: TagHandle,
    /// Inputs, in the order of the expression's names.
    pub(crate) inputs: Vec<TagHandle>,
    expression: Expression,
}

/// Rules that have to be worked out, each once, in order.
#[derive(Debug, Default)]
pub(crate) struct DueRules(BinaryHeap<Reverse<usize>>);

impl Derivations {
    /// Reads the expressions of all tags that have one.
    pub(crate) fn from_specs(specs: &[TagSpec]) -> Result<Self, Vec<TagSpecError>> {
        if specs.iter().all(|spec| spec.expression.is_none()) {
            return Ok(Self::default());
        }
        let handles: HashMap<&str, TagHandle> =
            specs.iter().zip(0..).map(|(spec, rank)| (spec.id.as_str(), TagHandle(rank))).collect();
        let (mut rules, mut faults) = (BTreeMap::new(), Vec::new());
        for (spec, rank) in specs.iter().zip(0..) {
            match Rule::from_spec(spec, TagHandle(rank), &handles, specs) {
                Some(Ok(rule)) => {
                    rules.insert(rule.tag, rule);
                }
                Some(Err(fault)) => faults.push(fault),
                None => {}
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let rules = in_order(rules, specs)?;
        let mut rules_by_input: HashMap<TagHandle, Vec<usize>> = HashMap::new();
        for (index, rule) in rules.iter().enumerate() {
            for &input in &rule.inputs {
                rules_by_input.entry(input).or_default().push(index);
            }
        }
        Ok(Self { rules, rules_by_input })
    }

    /// The tags that derived tags rest on.
    pub(crate) fn is_input(&self, tag: TagHandle) -> bool {
        self.rules_by_input.contains_key(&tag)
    }

    pub(crate) fn rule(&self, index: usize) -> &Rule {
        &self.rules[index]
    }

    /// The rules that rest on any of these tags.
    pub(crate) fn due(&self, touched: &[TagHandle]) -> DueRules {
        let mut due = DueRules::default();
        touched.iter().for_each(|&tag| self.dependents(tag, &mut due));
        due
    }

    /// Adds the rules that rest on a tag.
    pub(crate) fn dependents(&self, tag: TagHandle, due: &mut DueRules) {
        due.0.extend(
            self.rules_by_input.get(&tag).into_iter().flatten().map(|&index| Reverse(index)),
        );
    }
}

impl DueRules {
    /// Returns the next rule; its inputs were returned before it.
    pub(crate) fn next_due(&mut self) -> Option<usize> {
        let Reverse(next) = self.0.pop()?;
        while self.0.peek() == Some(&Reverse(next)) {
            self.0.pop();
        }
        Some(next)
    }
}

impl Rule {
    fn from_spec(
        spec: &TagSpec,
        tag: TagHandle,
        handles: &HashMap<&str, TagHandle>,
        specs: &[TagSpec],
    ) -> Option<Result<Self, TagSpecError>> {
        let expression = match Expression::parse(spec.expression.as_deref()?) {
            Ok(expression) => expression,
            Err(error) => {
                let cause = format!("its expression is none: {error}");
                let remedy = "write a formula of tag ids in braces, such as '{T1.U} * {T1.I}'";
                return Some(Err(fault(spec, cause, remedy)));
            }
        };
        let is_text = |id: &&String| {
            let tag = handles.get(id.as_str());
            tag.is_some_and(|tag| specs[tag.0 as usize].kind == ValueKind::Text)
        };
        let text = expression.inputs().iter().find(is_text);
        if let Some(id) = text.or((spec.kind == ValueKind::Text).then_some(&spec.id)) {
            let cause = format!("its expression is of numbers, and '{id}' is a text");
            return Some(Err(fault(spec, cause, "use tags of other types")));
        }
        let inputs =
            expression.inputs().iter().map(|id| handles.get(id.as_str()).copied().ok_or(id));
        match inputs.collect::<Result<Vec<_>, _>>() {
            Ok(inputs) => Some(Ok(Self { tag, inputs, expression })),
            Err(id) => {
                let cause = format!("its expression names '{id}', and there is no such tag");
                Some(Err(fault(spec, cause, "name tags of this configuration")))
            }
        }
    }

    /// The value for these states of its inputs: no better than the worst of them, and
    /// as old as the oldest.
    pub(crate) fn evaluate(
        &self,
        states: impl Iterator<Item = TagState>,
        kind: ValueKind,
        now: Moment,
    ) -> Sample {
        let mut quality = Quality::Good;
        let mut numbers = Vec::with_capacity(self.inputs.len());
        let mut oldest = now;
        let mut origin = Origin::LIVE;
        for state in states {
            origin |= state.origin;
            quality = quality.worst(state.quality);
            numbers.extend(state.value.as_ref().map(number));
            oldest = oldest.min(now.before(state.age.unwrap_or_default()));
        }
        let is_known = numbers.len() == self.inputs.len();
        let value = is_known.then(|| typed(self.expression.evaluate(&numbers), kind));
        // No source time: the clocks of its inputs may differ.
        Sample {
            tag: self.tag,
            value,
            quality,
            doubt: Quality::Good,
            source_time: None,
            received: now,
            valid_from: oldest,
            origin,
            is_buffered: false,
        }
    }
}

/// Sorts the rules topologically, each after its inputs (Kahn, 1962).
fn in_order(
    mut rules: BTreeMap<TagHandle, Rule>,
    specs: &[TagSpec],
) -> Result<Vec<Rule>, Vec<TagSpecError>> {
    let mut missing: BTreeMap<TagHandle, usize> = BTreeMap::new();
    let mut rules_by_input: BTreeMap<TagHandle, Vec<TagHandle>> = BTreeMap::new();
    for rule in rules.values() {
        let derived: Vec<_> = rule.inputs.iter().filter(|tag| rules.contains_key(tag)).collect();
        missing.insert(rule.tag, derived.len());
        derived.into_iter().for_each(|&on| rules_by_input.entry(on).or_default().push(rule.tag));
    }
    let mut ready: Vec<TagHandle> =
        missing.iter().filter(|(_, count)| **count == 0).map(|(&tag, _)| tag).collect();
    let mut ordered = Vec::with_capacity(rules.len());
    while let Some(tag) = ready.pop() {
        for on in rules_by_input.remove(&tag).unwrap_or_default() {
            if let Some(count) = missing.get_mut(&on) {
                *count -= 1;
                if *count == 0 {
                    ready.push(on);
                }
            }
        }
        ordered.extend(rules.remove(&tag));
    }
    if rules.is_empty() {
        return Ok(ordered);
    }
    let circular = |&tag: &TagHandle| {
        let cause = "its expression rests on itself".into();
        fault(&specs[tag.0 as usize], cause, "break the circle of derived tags")
    };
    Err(rules.keys().map(circular).collect())
}

fn fault(spec: &TagSpec, cause: String, remedy: &str) -> TagSpecError {
    TagSpecError { id: spec.id.clone(), cause, remedy: remedy.into() }
}

/// A value in a formula. A text is no number; it stands in a number's place only where a source
/// sends the wrong type.
fn number(value: &Value) -> f64 {
    match value {
        Value::F64(number) => *number,
        Value::I64(number) => *number as f64,
        Value::Bool(on) => f64::from(u8::from(*on)),
        Value::Text(_) => f64::NAN,
        Value::DoublePoint(point) => match point {
            DoublePoint::Intermediate => 0.0,
            DoublePoint::Off => 1.0,
            DoublePoint::On => 2.0,
            DoublePoint::BadState => 3.0,
        },
    }
}

/// A formula's result as a value of a type; one that it cannot be stays a number, for
/// the table to call bad.
fn typed(result: f64, kind: ValueKind) -> Value {
    let is_whole = result.fract() == 0.0 && result.abs() < 9.0e15;
    match kind {
        ValueKind::I64 if is_whole => Value::I64(result as i64),
        ValueKind::Bool if result.is_finite() => Value::Bool(result != 0.0),
        ValueKind::DoublePoint => match result {
            0.0 => Value::DoublePoint(DoublePoint::Intermediate),
            1.0 => Value::DoublePoint(DoublePoint::Off),
            2.0 => Value::DoublePoint(DoublePoint::On),
            3.0 => Value::DoublePoint(DoublePoint::BadState),
            _ => Value::F64(result),
        },
        _ => Value::F64(result),
    }
}
