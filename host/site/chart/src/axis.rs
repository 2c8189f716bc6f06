//! Axis view: scale, direction and ticks of an axis.

use crate::Axis;

/// Ticks of a linear axis, about.
const LINEAR_TICKS: f32 = 5.0;

/// View of an axis, as an operator arranged it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisView {
    /// Index of the axis described.
    pub axis: usize,
    /// True while the axis is hidden.
    pub is_hidden: bool,
    /// True while the axis is flipped: its upper end is at the foot.
    pub is_flipped: bool,
    /// True for a logarithmic scale.
    pub log: bool,
    /// The value at its lower end.
    pub low: f32,
    /// The value at its upper end.
    pub high: f32,
}

/// A place of an axis with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// 0 at the foot of the axis, 1 at its head.
    pub position: f32,
    /// Label with the value.
    pub text: String,
}

impl AxisView {
    /// Creates the view that the description asks for.
    pub fn new(index: usize, axis: &Axis) -> Self {
        let Axis { log, low, high, .. } = *axis;
        Self { axis: index, is_hidden: false, is_flipped: false, log, low, high }
    }

    /// Returns the position of a value, 0 at the foot of the axis to 1 at its head. Values beyond
    /// an end are clamped to it; `None` for a missing value.
    pub fn position(&self, value: f32) -> Option<f32> {
        if value.is_nan() {
            return None;
        }
        let share = match self.log {
            true => {
                let [low, high] = [self.low, self.high].map(f32::ln);
                (value.max(f32::MIN_POSITIVE).ln() - low) / (high - low)
            }
            false => (value - self.low) / (self.high - self.low),
        };
        let share = share.clamp(0.0, 1.0);
        Some(if self.is_flipped { 1.0 - share } else { share })
    }

    /// The value at a position.
    pub fn value_at(&self, position: f32) -> f32 {
        let share = if self.is_flipped { 1.0 - position } else { position }.clamp(0.0, 1.0);
        match self.log {
            true => {
                let [low, high] = [self.low, self.high].map(f32::ln);
                (low + share * (high - low)).exp().clamp(self.low, self.high)
            }
            false => self.low + share * (self.high - self.low),
        }
    }

    /// Decades of a logarithmic axis, round numbers of a linear one.
    pub fn ticks(&self) -> Vec<Tick> {
        let values: Vec<f32> = if self.log {
            let [first, last] = [self.low.log10().ceil() as i32, self.high.log10().floor() as i32];
            (first..=last).map(|decade| 10f32.powi(decade)).collect()
        } else {
            let step = round_step((self.high - self.low) / LINEAR_TICKS);
            let first = (self.low / step).ceil() as i64;
            let last = (self.high / step).floor() as i64;
            (first..=last).map(|index| index as f32 * step).collect()
        };
        let tick = |value: f32| Some(Tick { position: self.position(value)?, text: short(value) });
        values.into_iter().filter_map(tick).collect()
    }
}

/// 1, 2 or 5 times a power of ten, at least `least`.
fn round_step(least: f32) -> f32 {
    let decade = 10f32.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|digit| digit * decade)
        .find(|s| *s >= least)
        .unwrap_or(least)
}

/// A number with few digits, thousands as k and millions as M from ten thousand on.
pub fn short(value: f32) -> String {
    let text = match value.abs() {
        size if size >= 1e6 => return format!("{}M", trimmed(format!("{:.1}", value / 1e6))),
        size if size >= 1e4 => return format!("{}k", trimmed(format!("{:.1}", value / 1e3))),
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 1.0 => format!("{value:.1}"),
        size if size >= 0.1 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    };
    trimmed(text)
}

fn trimmed(text: String) -> String {
    if !text.contains('.') {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(log: bool, low: f32, high: f32) -> AxisView {
        AxisView { axis: 0, is_hidden: false, is_flipped: false, log, low, high }
    }

    #[test]
    fn values_and_positions_are_each_others_inverse() {
        for view in [view(true, 0.1, 1e4), view(false, -40.0, 160.0)] {
            for flipped in [false, true] {
                let view = AxisView { is_flipped: flipped, ..view };
                for step in 0..=20 {
                    let position = step as f32 / 20.0;
                    let back = view.position(view.value_at(position)).unwrap();
                    assert!((back - position).abs() < 1e-5, "{position} {back}");
                }
            }
            assert_eq!(view.position(f32::NAN), None);
            assert_eq!(view.position(-1e9), Some(0.0));
            assert_eq!(view.position(1e9), Some(1.0));
        }
    }

    #[test]
    fn ticks_are_decades_or_round_numbers() {
        let texts =
            |view: AxisView| -> Vec<_> { view.ticks().into_iter().map(|tick| tick.text).collect() };
        assert_eq!(texts(view(true, 0.5, 20_000.0)), ["1", "10", "100", "1000", "10k"]);
        assert_eq!(texts(view(false, 0.0, 150.0)), ["0", "50", "100", "150"]);
        assert_eq!(texts(view(false, 0.0, 1.2)), ["0", "0.5", "1"]);
    }
}
