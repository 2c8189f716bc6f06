//! A small station with its tags, for tests through the overlay.

use std::time::Duration;

use busbar_plugin_sdk::testing::{draw_at, host};
use busbar_plugin_sdk::{
    Binding, DoublePoint, Origin, Overlay, Plugin, Quality, Reason, TagValue, Value, ValueKind,
};
use serde_json::{Value as Json, json};

use crate::*;

pub(crate) const OPEN: Value = Value::DoublePoint(DoublePoint::Off);
pub(crate) const CLOSED: Value = Value::DoublePoint(DoublePoint::On);
pub(crate) const MOVING: Value = Value::DoublePoint(DoublePoint::Intermediate);
pub(crate) const YES: Value = Value::Bool(true);
pub(crate) const NO: Value = Value::Bool(false);

/// A tag: equipment, role, unit, value and quality.
pub(crate) struct Tag(
    pub(crate) &'static str,
    pub(crate) &'static str,
    pub(crate) &'static str,
    pub(crate) Option<Value>,
    pub(crate) Quality,
);

pub(crate) fn text(text: &str) -> Value {
    Value::Text(busbar_plugin_sdk::Text::new(text).unwrap())
}

pub(crate) fn tag(id: &'static str, role: &'static str, value: Value) -> Tag {
    Tag(id, role, "", Some(value), Quality::Good)
}

pub(crate) fn reading(id: &'static str, role: &'static str, unit: &'static str, value: f64) -> Tag {
    Tag(id, role, unit, Some(Value::F64(value)), Quality::Good)
}

pub(crate) fn bad(Tag(id, role, unit, value, _): Tag) -> Tag {
    Tag(id, role, unit, value, Quality::Bad(Reason::Communication))
}

/// A judgment with its texts and bindings.
#[derive(Debug)]
pub(crate) struct ToldJudgment {
    pub(crate) state: PieceState,
    pub(crate) standing: Standing,
    pub(crate) reason: String,
    pub(crate) assumption: String,
    pub(crate) basis: Vec<usize>,
}

/// An overlay with its tags.
pub(crate) struct Station {
    pub(crate) overlay: EnergisationOverlay,
    bindings: Vec<(String, String)>,
}

impl Station {
    pub(crate) fn new(settings: &Json, tags: &[Tag]) -> Self {
        let settings = serde_json::from_value(settings.clone()).unwrap();
        let mut overlay = EnergisationOverlay::create(settings, host()).unwrap();
        let binding = |Tag(id, role, unit, value, _): &Tag| Binding {
            node: 0,
            kind: value.as_ref().map_or(ValueKind::F64, Value::kind),
            limit_low: None,
            limit_high: None,
            tag_id: format!("{id}.{role}"),
            tag_name: String::new(),
            unit: (*unit).into(),
            node_id: (*id).into(),
            role: (*role).into(),
        };
        overlay.configure(tags.iter().map(binding).collect()).unwrap();
        let bindings = tags.iter().map(|tag| (tag.0.to_owned(), tag.1.to_owned())).collect();
        Self { overlay, bindings }
    }

    pub(crate) fn draw(&mut self, tags: &[Tag]) {
        draw_at(&mut self.overlay, None, &values(tags), 0).unwrap();
    }

    /// Judges values without drawing them.
    pub(crate) fn update(&mut self, tags: &[Tag]) {
        self.overlay.update(&values(tags));
    }

    pub(crate) fn judgment(&self, id: &str) -> ToldJudgment {
        let equipment = self.overlay.describe().equipment;
        let piece = equipment.iter().position(|of| of == id).unwrap();
        let judgments = self.overlay.judgments();
        let judgment = judgments.pieces[piece].unwrap();
        let PieceJudgment { state, standing, .. } = judgment;
        let [reason, assumption] =
            [judgment.reason, judgment.assumption].map(|text| judgments.text(text).to_owned());
        let basis = judgments.basis(judgment.basis).iter().map(|of| *of as usize).collect();
        ToldJudgment { state, standing, reason, assumption, basis }
    }

    pub(crate) fn state(&self, id: &str) -> PieceState {
        self.judgment(id).state
    }

    /// Tags that a judgment rests on, as equipment and role.
    pub(crate) fn basis(&self, id: &str) -> Vec<String> {
        let name = |binding: usize| {
            let (id, role) = &self.bindings[binding];
            format!("{id}.{role}")
        };
        self.judgment(id).basis.into_iter().map(name).collect()
    }
}

pub(crate) fn station(settings: &Json, tags: &[Tag]) -> Station {
    let mut station = Station::new(settings, tags);
    station.draw(tags);
    station
}

/// A line feeds a busbar over a breaker; a transformer with a breaker on its low side
/// feeds another busbar; each side of the transformer has an earth switch.
pub(crate) fn two_levels() -> Json {
    json!({
        "levels": [
            { "name": "110 kV", "color": "#aa2200" },
            { "name": "20 kV", "color": "#2200aa" },
        ],
        "nodes": [
            { "id": "line", "level": "110 kV", "equipment": ["LINE"] },
            { "id": "high", "level": "110 kV", "equipment": ["HIGH", "VT"] },
            { "id": "low", "level": "20 kV", "equipment": ["LOW"] },
            { "id": "bus", "level": "20 kV", "equipment": ["BUS"] },
        ],
        "branches": [
            { "equipment": "QA1", "between": ["line", "high"], "switch": true },
            { "equipment": "T1", "between": ["high", "low"] },
            { "equipment": "QA2", "between": ["low", "bus"], "kind": "breaker" },
        ],
        "earths": [
            { "equipment": "QC1", "node": "high" },
            { "equipment": "QC2", "node": "low" },
        ],
        "sources": [{ "node": "line" }],
    })
}

pub(crate) fn switches(qa1: Value, qa2: Value, qc1: Value, qc2: Value) -> Vec<Tag> {
    let values = [("QA1", qa1), ("QA2", qa2), ("QC1", qc1), ("QC2", qc2)];
    values.map(|(id, value)| tag(id, "position", value)).into()
}

pub(crate) fn generator() -> Json {
    let mut settings = two_levels();
    settings["sources"] = json!([{ "node": "line", "equipment": "G1", "rating_mva": 100.0 }]);
    settings
}

pub(crate) fn values(tags: &[Tag]) -> Vec<TagValue> {
    let value = |Tag(_, _, _, value, quality): &Tag| TagValue {
        value: value.clone(),
        quality: *quality,
        age: Duration::ZERO,
        origin: Origin::LIVE,
    };
    tags.iter().map(value).collect()
}
