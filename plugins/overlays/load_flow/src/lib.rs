//! Load flow: power at feeders and transformers as arrows, by the share that the apparent
//! power has of the rating (after Overbye and others, visualisation of power systems), and a
//! verdict on each flow.

mod ends;
mod flows;
mod settings;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, Judgment, Overlay, OverlayFrame, Plugin, Severity,
    TagValue, Verdict, VerdictSeverity,
};
use ends::{End, PowerTag, digits};
use flows::{Flow, FlowVerdict, Flows};
pub use settings::{Direction, FlowSettings, Settings};

/// Overlay plugin for load flow.
pub struct LoadFlow {
    settings: Settings,
    flows: Flows,
    /// Greatest number of arrows that the host takes in a frame.
    max_arrows: usize,
}

impl Plugin for LoadFlow {
    const ID: &'static str = "load_flow";
    const NAME: &'static str = "Load flow";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Power as arrows, by its share of the rating.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let flows = Flows { findings: Vec::new(), ..Flows::new(&settings, &[]) };
        Ok(Self { settings, flows, max_arrows: 0 })
    }
}

impl Overlay for LoadFlow {
    fn describe(&self) -> Description {
        let Flows { equipment, findings, .. } = &self.flows;
        Description {
            equipment: equipment.clone(),
            findings: findings.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.flows = Flows::new(&self.settings, &bindings);
        self.max_arrows = bindings.len() + self.flows.equipment.len();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let mut arrows = 0;
        let mut verdicts = Vec::with_capacity(self.flows.list.len());
        for (flow, of) in self.flows.list.iter().zip(&self.settings.flows) {
            let Some(end) = flow.ends.first() else { continue };
            for tag in &end.active {
                let share = self.draw_active(flow, (end, tag), of, &values, canvas)?;
                if let Some(share) = share.filter(|_| arrows < self.max_arrows) {
                    arrows += 1;
                    canvas.flow(tag.binding, flow.from_to, share)?;
                }
            }
            for tag in &end.reactive {
                let power = tag.last(&values).map(|power| format!("{} Mvar", digits(power)));
                let text = power.as_deref().unwrap_or("–");
                let caption = &flow.reactive_caption;
                canvas.line(tag.binding, tag.node, Severity::Normal, caption, text)?;
            }
            verdicts.push(flow.judge(of, &values));
        }
        for (equipment, own) in self.flows.at.iter().enumerate() {
            let worst = own.iter().filter_map(|flow| verdicts.get(*flow)).max_by_key(urgency);
            if let Some(of) = worst {
                let basis = match of.verdict {
                    Verdict::Normal => {
                        let all = own.iter().filter_map(|flow| verdicts.get(*flow));
                        canvas.basis(all.flat_map(|of| of.basis.iter().copied()))?
                    }
                    _ => canvas.basis(of.basis.iter().copied())?,
                };
                let FlowVerdict { verdict, reason, assumption, .. } = of;
                let severity = VerdictSeverity::Warning;
                let judgment = Judgment { verdict: *verdict, severity, reason, assumption };
                canvas.judge(equipment, basis, &judgment)?;
            }
        }
        Ok(())
    }
}

impl LoadFlow {
    /// Draws the line of a tag of active power; returns the share that its arrow shows.
    fn draw_active(
        &self,
        flow: &Flow,
        (end, tag): (&End, &PowerTag),
        of: &FlowSettings,
        values: &[TagValue],
        canvas: &mut Canvas<'_>,
    ) -> Result<Option<f64>, Error> {
        // The last one stays where it is not good: the host marks it.
        let Some(active) = tag.last(values) else {
            canvas.line(tag.binding, tag.node, Severity::Normal, &flow.caption, "–")?;
            let is_marked = values.get(tag.binding).is_some_and(|tag| !tag.quality.is_good());
            return Ok(is_marked.then_some(0.0));
        };
        let is_known = |tag: &PowerTag| tag.value(values).is_ok();
        let reactive = end.reactive.iter().filter(|tag| is_known(tag));
        let reactive = reactive.filter_map(|tag| tag.last(values));
        let reactive = reactive.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or_default();
        let loading = active.hypot(reactive) / of.rating_mva;
        // Without all of the reactive power it is at least that.
        let least = if end.reactive.iter().all(is_known) { "" } else { "≥ " };
        let severity = if loading > 1.0 { Severity::Warning } else { Severity::Normal };
        let text = format!("{} MW  {least}{:.0} %", digits(active), loading * 100.0);
        canvas.line(tag.binding, tag.node, severity, &flow.caption, &text)?;
        let sign = if active == 0.0 { reactive } else { active };
        Ok(Some(if sign < 0.0 { -loading } else { loading }))
    }
}

/// Ranks verdicts by urgency: the most urgent one at a piece of equipment is shown, an assumption
/// before none.
fn urgency(of: &&FlowVerdict) -> (u8, bool) {
    let verdict = match of.verdict {
        Verdict::Normal => 0,
        Verdict::Unknown => 1,
        Verdict::Abnormal => 2,
    };
    (verdict, !of.assumption.is_empty())
}

busbar_plugin_sdk::export_plugin!(LoadFlow: overlay);

#[cfg(test)]
mod silence_tests;
#[cfg(test)]
mod tests;
