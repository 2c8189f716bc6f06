//! Search for a transformer's inputs among the bindings, with findings on those that are
//! missing or cannot be converted.

use busbar_plugin_sdk::units::{Quantity, UnitConversion};
use busbar_plugin_sdk::{Binding, ValueKind};

use crate::inputs::{Inputs, LoadSource, Source, role};
use crate::settings::TransformerSettings;

/// Phases whose currents may be bound to one transformer.
const MAX_PHASES: usize = 3;

/// Ratio of a rated load to other ratings beyond which one of them is in another unit.
const MAX_RATING_RATIO: f64 = 2.5;

/// Search for the inputs of one transformer.
pub(crate) struct InputSearch<'a> {
    settings: &'a TransformerSettings,
    bindings: &'a [Binding],
    pub(crate) inputs: Inputs,
    /// Ratings that ways of the load lack: findings where there is no other way.
    missing_ratings: Vec<String>,
}

impl<'a> InputSearch<'a> {
    pub(crate) fn new(settings: &'a TransformerSettings, bindings: &'a [Binding]) -> Self {
        Self { settings, bindings, inputs: Inputs::default(), missing_ratings: Vec::new() }
    }

    pub(crate) fn find_all(&mut self) {
        self.find_loads();
        self.find_conditions();
        self.find_label();
    }

    fn bindings_of(&self, role: &str) -> impl Iterator<Item = (usize, &Binding)> {
        let equipment = &self.settings.equipment;
        let is_it = move |of: &(usize, &Binding)| of.1.role == role && of.1.node_id == *equipment;
        self.bindings.iter().enumerate().filter(is_it)
    }

    fn has(&self, role: &str) -> bool {
        self.bindings_of(role).next().is_some()
    }

    /// Source in a role with a conversion; a finding where it has none.
    fn source(&mut self, role: &str, quantity: Quantity, unit: &str) -> Option<Source> {
        let (index, binding) = self.bindings_of(role).next()?;
        let source = self.convert(index, binding, quantity, unit);
        self.keep(source, unit)
    }

    fn convert(
        &self,
        index: usize,
        binding: &Binding,
        quantity: Quantity,
        unit: &str,
    ) -> Result<Source, String> {
        require_numbers(binding)?;
        Ok(plain(index, binding, UnitConversion::for_binding(binding, quantity, unit)?))
    }

    fn keep(&mut self, source: Result<Source, String>, unit: &str) -> Option<Source> {
        match source {
            Ok(source) => {
                if source.conversion.is_assumed {
                    let words = format!("{} in {unit}", source.role.replace('_', " "));
                    self.inputs.assumptions.push(words);
                }
                Some(source)
            }
            Err(finding) => {
                self.inputs.findings.push(finding);
                None
            }
        }
    }

    /// Source in a role whose values are numbers of a kind, or a point. A text stays a source, whose
    /// values are never known, and is a finding.
    fn state_source(&mut self, role: &str) -> Option<Source> {
        let (index, binding) = self.bindings_of(role).next()?;
        let source = plain(index, binding, UnitConversion::IDENTITY);
        if binding.kind == ValueKind::Text {
            let finding = format!(
                "the tag '{}' in the role '{role}' at '{}' is a text; bind one with numbers or a \
                 state",
                binding.tag_id, binding.node_id
            );
            self.inputs.findings.push(finding);
        }
        Some(source)
    }

    fn find_loads(&mut self) {
        let findings = self.inputs.findings.len();
        let current = self.current();
        let load = self.load();
        let apparent = self.apparent_power();
        let power = self.power();
        let loads = [current, load, apparent, power];
        self.inputs.loads = loads.into_iter().flatten().collect();
        if self.inputs.loads.is_empty() {
            self.inputs.findings.append(&mut self.missing_ratings);
        }
        let has_finding = self.inputs.findings.len() > findings;
        let is_measured = self.has(role::TOP_OIL) && self.has(role::HOT_SPOT);
        if self.inputs.loads.is_empty() && !has_finding && !is_measured {
            self.inputs.findings.push(format!(
                "no tag tells the load of '{}'; bind one to it in the role 'load', 'current', \
                 'apparent_power' or 'active_power', or give \"untelemetered\": true for it",
                self.settings.equipment
            ));
        }
        if self.inputs.loads.iter().any(needs_voltage) {
            self.find_voltage();
        }
    }

    fn current(&mut self) -> Option<LoadSource> {
        if !self.has(role::CURRENT) || !self.has_rated_current(role::CURRENT) {
            return None;
        }
        let phases: Vec<_> = self
            .bindings_of(role::CURRENT)
            .take(MAX_PHASES)
            .map(|(index, binding)| self.convert(index, binding, Quantity::Current, "A"))
            .collect();
        let count = phases.len();
        let sources: Vec<_> =
            phases.into_iter().filter_map(|phase| self.keep(phase, "A")).collect();
        if sources.len() < count {
            return None;
        }
        self.find_tap();
        Some(LoadSource::Current(sources))
    }

    fn has_rated_current(&mut self, role: &str) -> bool {
        let has = !self.settings.taps.is_empty() || self.settings.any_rated_current().is_some();
        if !has {
            self.missing_ratings.push(format!(
                "the tag in the role '{role}' at '{}' is a current, and its rated current is not \
                 known; give rated_current in the settings",
                self.settings.equipment
            ));
        }
        has
    }

    fn find_tap(&mut self) {
        self.inputs.tap = self.state_source(role::TAP);
        let equipment = &self.settings.equipment;
        match (self.settings.taps.is_empty(), &self.inputs.tap) {
            (false, None) => self.inputs.findings.push(format!(
                "the rated current of '{equipment}' goes by taps, and no tag tells the tap; bind \
                 one to it in the role 'tap', or give rated_current alone"
            )),
            (true, Some(_)) => {
                self.inputs.assumptions.push("rated current the same for all taps".to_owned());
            }
            _ => {}
        }
    }

    /// Load in the role `load`, by the rated load or by its unit.
    fn load(&mut self) -> Option<LoadSource> {
        let (index, binding) = self.bindings_of(role::LOAD).next()?;
        if let Err(finding) = require_numbers(binding) {
            self.inputs.findings.push(finding);
            return None;
        }
        let quantity = Quantity::from_unit(&binding.unit);
        let needed = |what: &str, key: &str| {
            format!(
                "the tag '{}' in the role 'load' at '{}' is {what} in {}; give {key} in the \
                 settings",
                binding.tag_id, binding.node_id, binding.unit
            )
        };
        if let Some(rated) = self.settings.rated_load {
            if !quantity.is_none_or(may_tell_load) {
                self.inputs.findings.push(format!(
                    "the tag '{}' in the role 'load' at '{}' has the unit '{}', which tells no \
                     load; give the tag its unit, or bind another one",
                    binding.tag_id, binding.node_id, binding.unit
                ));
                return None;
            }
            if let Some(finding) = self.rated_load_fault(binding, quantity, rated) {
                self.inputs.findings.push(finding);
                return None;
            }
            let source = plain(index, binding, UnitConversion::IDENTITY);
            return Some(match quantity {
                Some(Quantity::ActivePower) => {
                    LoadSource::Power { active: source, reactive: None, rated }
                }
                Some(Quantity::ApparentPower) => LoadSource::ApparentPower { source, rated },
                _ => LoadSource::Ratio { source, rated },
            });
        }
        let rated_power = self.settings.rated_power;
        match quantity {
            Some(Quantity::Current) => {
                if !self.has_rated_current(role::LOAD) {
                    return None;
                }
                let source = self.source(role::LOAD, Quantity::Current, "A")?;
                self.find_tap();
                Some(LoadSource::Current(vec![source]))
            }
            Some(Quantity::ApparentPower) => match rated_power {
                Some(rated) => {
                    let source = self.source(role::LOAD, Quantity::ApparentPower, "MVA")?;
                    Some(LoadSource::ApparentPower { source, rated })
                }
                None => {
                    let finding = needed("apparent power", "rated_power");
                    self.missing_ratings.push(finding);
                    None
                }
            },
            Some(Quantity::ActivePower) => match rated_power {
                Some(rated) => {
                    let active = self.source(role::LOAD, Quantity::ActivePower, "MW")?;
                    Some(LoadSource::Power { active, reactive: None, rated })
                }
                None => {
                    let finding = needed("active power", "rated_power");
                    self.missing_ratings.push(finding);
                    None
                }
            },
            _ => {
                let source = self.source(role::LOAD, Quantity::Ratio, "%")?;
                Some(LoadSource::Ratio { source, rated: 100.0 })
            }
        }
    }

    /// Finding on a rated load that is surely in another unit than its tag: 100 of a tag in per
    /// unit would make each load a hundredth.
    fn rated_load_fault(
        &self,
        binding: &Binding,
        quantity: Option<Quantity>,
        rated: f64,
    ) -> Option<String> {
        let settings = self.settings;
        let (to, known) = match quantity? {
            Quantity::Ratio => ("p.u.", 1.0),
            Quantity::Current => ("A", settings.any_rated_current()?),
            Quantity::ApparentPower => ("MVA", settings.rated_power?),
            Quantity::ActivePower => ("MW", settings.rated_power?),
            _ => return None,
        };
        let found = UnitConversion::between(&binding.unit, to, quantity?)?.apply(rated);
        let is_alike = (known / MAX_RATING_RATIO..=known * MAX_RATING_RATIO).contains(&found);
        (!is_alike).then(|| {
            format!(
                "the tag '{}' in the role 'load' at '{}' is in {}, in which rated_load would be \
                 {found} {to} where {known} {to} are rated; give rated_load in the unit of the \
                 tag, or leave it out",
                binding.tag_id, binding.node_id, binding.unit
            )
        })
    }

    fn apparent_power(&mut self) -> Option<LoadSource> {
        let rated = self.rated_power(role::APPARENT_POWER)?;
        let source = self.source(role::APPARENT_POWER, Quantity::ApparentPower, "MVA")?;
        Some(LoadSource::ApparentPower { source, rated })
    }

    fn power(&mut self) -> Option<LoadSource> {
        let rated = self.rated_power(role::ACTIVE_POWER)?;
        let active = self.source(role::ACTIVE_POWER, Quantity::ActivePower, "MW")?;
        let reactive = self.source(role::REACTIVE_POWER, Quantity::ReactivePower, "Mvar");
        Some(LoadSource::Power { active, reactive, rated })
    }

    fn rated_power(&mut self, role: &str) -> Option<f64> {
        if self.has(role) && self.settings.rated_power.is_none() {
            self.missing_ratings.push(format!(
                "the tag in the role '{role}' at '{}' is a power, and the rated power is not \
                 known; give rated_power in the settings",
                self.settings.equipment
            ));
        }
        self.settings.rated_power
    }

    fn find_voltage(&mut self) {
        if !self.has(role::VOLTAGE) {
            self.inputs.assumptions.push("rated voltage".to_owned());
            return;
        }
        if self.settings.rated_voltage.is_none() {
            self.inputs.findings.push(format!(
                "the voltage of '{}' is measured, and its rated voltage is not known; give \
                 rated_voltage in the settings",
                self.settings.equipment
            ));
        }
        self.inputs.voltage = self.source(role::VOLTAGE, Quantity::Voltage, "kV");
        if self.inputs.voltage.is_none() {
            self.inputs.assumptions.push("rated voltage".to_owned());
        }
    }

    fn find_conditions(&mut self) {
        self.inputs.ambient = self.source(role::AMBIENT, Quantity::Temperature, "°C");
        self.inputs.top_oil = self.source(role::TOP_OIL, Quantity::Temperature, "°C");
        self.inputs.hot_spot = self.source(role::HOT_SPOT, Quantity::Temperature, "°C");
        self.inputs.cooler_fault = self.state_source(role::COOLER_FAULT);
        let stage = self.state_source(role::COOLER_STAGE).or_else(|| self.state_source(role::FANS));
        match (self.settings.stages.is_empty(), &stage) {
            (false, None) => self.inputs.findings.push(format!(
                "'{}' has stages of cooling, and no tag tells which one runs; bind one to it in \
                 the role 'cooler_stage' or 'fans'",
                self.settings.equipment
            )),
            (true, Some(_)) => self.inputs.assumptions.push("all coolers run".to_owned()),
            _ => self.inputs.cooler_stage = stage,
        }
    }

    fn find_label(&mut self) {
        let roles = [
            role::CURRENT,
            role::LOAD,
            role::APPARENT_POWER,
            role::ACTIVE_POWER,
            role::HOT_SPOT,
            role::TOP_OIL,
            role::AMBIENT,
        ];
        let first = |role: &&str| {
            self.bindings_of(role).next().map(|(index, binding)| (binding.node, index))
        };
        self.inputs.label = roles.iter().find_map(first);
    }
}

fn plain(binding: usize, of: &Binding, conversion: UnitConversion) -> Source {
    let Binding { tag_id, role, .. } = of.clone();
    Source { binding, tag_id, role, conversion }
}

/// Refuses a tag whose values are states or texts.
fn require_numbers(binding: &Binding) -> Result<(), String> {
    match binding.kind.is_quantity() {
        true => Ok(()),
        false => Err(format!(
            "the tag '{}' in the role '{}' at '{}' has no numbers; bind one that has",
            binding.tag_id, binding.role, binding.node_id
        )),
    }
}

/// Reports whether values of a quantity can tell a load against a rated one.
fn may_tell_load(quantity: Quantity) -> bool {
    matches!(
        quantity,
        Quantity::Ratio | Quantity::Current | Quantity::ApparentPower | Quantity::ActivePower
    )
}

fn needs_voltage(of: &LoadSource) -> bool {
    matches!(of, LoadSource::ApparentPower { .. } | LoadSource::Power { .. })
}
