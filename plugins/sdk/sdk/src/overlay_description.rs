//! Description of an overlay: legend, equipment, mechanisms, contour, findings.

use busbar_plugin_abi as abi;

use crate::Pattern;

/// Findings of one configuration that are reported; the last one counts the rest.
pub const MAX_FINDINGS: usize = 256;
/// Bytes of one finding, at most; a longer one is cut.
const MAX_FINDING_BYTES: usize = 1024;

/// Description of an overlay's contents besides values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    /// States that the overlay shows equipment in; at most 64.
    pub legend: Vec<LegendEntry>,
    /// Ids of the equipment that the overlay judges, all that settings or bindings name; at most
    /// 100,000.
    pub equipment: Vec<String>,
    /// Names of the mechanisms whose positions the overlay sets, as in models; at most 16.
    pub mechanisms: Vec<String>,
    /// Contour whose levels the overlay sets.
    pub contour: Option<Contour>,
    /// Reports whether the overlay is drawn only once an operator switches it on.
    pub starts_hidden: bool,
    /// Faults of the bindings, each as cause and remedy with `; ` between, which
    /// `busbar check` refuses: a role that no tag has, a unit that cannot be converted.
    pub findings: Vec<String>,
}

/// Contour: a quantity over the ground, interpolated from levels at equipment.
#[derive(Clone, Debug, PartialEq)]
pub struct Contour {
    /// Display name of the quantity; at most 64 bytes.
    pub name: String,
    /// Unit of the quantity; empty for none; at most 16 bytes.
    pub unit: String,
    /// Radius around a piece of equipment within which its level counts, metres; 0.1 to 1000.
    pub reach_metres: f64,
    /// Lower end of the normal band; only levels outside of it are coloured.
    pub low: Option<f64>,
    /// Upper end of the normal band.
    pub high: Option<f64>,
    /// Distance between two lines of equal level, in the unit; above 0.
    pub step: f64,
}

/// State in the legend of an overlay.
#[derive(Clone, Debug, PartialEq)]
pub struct LegendEntry {
    /// Display name of the state; at most 64 bytes.
    pub name: String,
    /// Colour of the state, sRGB.
    pub color: [u8; 3],
    /// Pattern that distinguishes the state where colours do not.
    pub pattern: Pattern,
}

/// Description as its ABI struct, with the memory behind its pointers.
pub(crate) struct RawDescription {
    legend: Vec<abi::BusbarLegendEntry>,
    equipment: Vec<abi::BusbarStr>,
    mechanisms: Vec<abi::BusbarStr>,
    contour: Option<abi::BusbarContour>,
    findings: Vec<abi::BusbarStr>,
    kept: Description,
}

impl RawDescription {
    pub(crate) fn new(mut description: Description) -> Self {
        limit_findings(&mut description.findings);
        let entry = |entry: &LegendEntry| {
            let [red, green, blue] = entry.color;
            abi::BusbarLegendEntry {
                name: abi::BusbarStr::from_borrowed(&entry.name),
                pattern: entry.pattern.code().into(),
                color: u32::from_be_bytes([0, red, green, blue]),
            }
        };
        let texts = |texts: &[String]| {
            texts.iter().map(|text| abi::BusbarStr::from_borrowed(text)).collect()
        };
        let contour = |contour: &Contour| abi::BusbarContour {
            name: abi::BusbarStr::from_borrowed(&contour.name),
            unit: abi::BusbarStr::from_borrowed(&contour.unit),
            reach_metres: contour.reach_metres,
            low: contour.low.unwrap_or(f64::NAN),
            high: contour.high.unwrap_or(f64::NAN),
            step: contour.step,
        };
        // Strings stay where they are when the vectors that hold them move.
        Self {
            legend: description.legend.iter().map(entry).collect(),
            equipment: texts(&description.equipment),
            mechanisms: texts(&description.mechanisms),
            contour: description.contour.as_ref().map(contour),
            findings: texts(&description.findings),
            kept: description,
        }
    }

    pub(crate) fn write(&self, into: &mut abi::BusbarOverlayDescription) {
        into.legend_count = self.legend.len() as u32;
        into.equipment_count = self.equipment.len() as u32;
        into.reserved = 0;
        into.legend = self.legend.as_ptr();
        into.equipment = self.equipment.as_ptr();
        into.mechanism_count = self.mechanisms.len() as u32;
        into.starts_hidden = self.kept.starts_hidden.into();
        into.mechanisms = self.mechanisms.as_ptr();
        into.contour = self.contour.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
        into.finding_count = self.findings.len() as u32;
        into.reserved_2 = 0;
        into.findings = self.findings.as_ptr();
    }
}

/// Cuts findings to what the host takes: [`MAX_FINDINGS`] of them, the last of which counts
/// the rest, of at most [`MAX_FINDING_BYTES`].
fn limit_findings(findings: &mut Vec<String>) {
    for finding in findings.iter_mut() {
        finding.truncate(finding.floor_char_boundary(MAX_FINDING_BYTES));
    }
    let more = findings.len().saturating_sub(MAX_FINDINGS - 1);
    if more > 1 {
        findings.truncate(MAX_FINDINGS - 1);
        findings.push(format!("{more} more findings of this kind; mend those above first"));
    }
}
