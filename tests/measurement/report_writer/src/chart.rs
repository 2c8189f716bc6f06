//! Line charts in SVG format.

use std::fmt::Write as _;

use crate::html::escaped;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 380.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 190.0;
const TOP: f64 = 20.0;
const BOTTOM: f64 = 52.0;
/// Strokes distinguished by colour and dash, in greyscale too.
const STROKES: [(&str, &str); 6] = [
    ("#1f4e79", ""),
    ("#b4532a", "7 4"),
    ("#4d7a3a", "2 3"),
    ("#7a5195", "10 3 2 3"),
    ("#6b6f73", "4 2"),
    ("#a08a1b", "1 2"),
];

/// Chart of lines over common axes.
#[derive(Clone, Debug)]
pub struct LineChart<'a> {
    /// Label of the x axis, with unit.
    pub x: &'a str,
    /// Label of the y axis, with unit.
    pub y: &'a str,
    /// Flag for a logarithmic y axis.
    pub log_y: bool,
    /// Lines: name, and points in ascending x.
    pub lines: Vec<(String, Vec<[f64; 2]>)>,
}

/// Mapping of values to pixels along one axis.
#[derive(Clone, Copy)]
struct Axis {
    low: f64,
    high: f64,
    pixels: [f64; 2],
    log: bool,
}

impl Axis {
    fn at(&self, value: f64) -> f64 {
        let place = |v: f64| if self.log { v.log10() } else { v };
        let share = (place(value) - place(self.low)) / (place(self.high) - place(self.low));
        self.pixels[0] + share * (self.pixels[1] - self.pixels[0])
    }

    /// Returns round tick values along the axis.
    fn ticks(&self) -> Vec<f64> {
        if self.log {
            let (first, last) = (self.low.log10().ceil() as i32, self.high.log10().floor() as i32);
            return (first..=last).map(|power| 10_f64.powi(power)).collect();
        }
        let span = self.high - self.low;
        let rough = 10_f64.powf((span / 5.0).log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|m| m * rough);
        let step = steps.into_iter().find(|step| span / step <= 6.0).unwrap_or(span);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

impl LineChart<'_> {
    /// Draws the chart. Lines without points, and values that have no
    /// logarithm where one is needed, are left out.
    pub fn svg(&self) -> String {
        let points = |i: usize| {
            self.lines.iter().flat_map(|(_, line)| self.drawable(line)).map(move |point| point[i])
        };
        let x = axis(points(0), [LEFT, WIDTH - RIGHT], false);
        let y = axis(points(1), [HEIGHT - BOTTOM, TOP], self.log_y);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             font-family=\"system-ui, sans-serif\" font-size=\"12\" fill=\"#23282d\">\n"
        );
        self.draw_axes(&mut svg, x, y);
        for (index, (name, line)) in self.lines.iter().enumerate() {
            self.draw_line(&mut svg, (x, y), index, name, line);
        }
        svg.push_str("</svg>");
        svg
    }

    fn drawable<'l>(&self, line: &'l [[f64; 2]]) -> impl Iterator<Item = &'l [f64; 2]> + use<'l> {
        let log = self.log_y;
        line.iter().filter(move |p| p.iter().all(|v| v.is_finite()) && (!log || p[1] > 0.0))
    }

    // Writing to a string cannot fail.
    fn draw_axes(&self, svg: &mut String, x: Axis, y: Axis) {
        let bottom = HEIGHT - BOTTOM;
        for tick in y.ticks() {
            let (at, label) = (y.at(tick), label(tick, y.log));
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {at:.1}H{}\" stroke=\"#e2e4e5\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                WIDTH - RIGHT,
                LEFT - 8.0,
                at + 4.0
            );
        }
        for tick in x.ticks() {
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                x.at(tick),
                bottom + 18.0,
                label(tick, false)
            );
        }
        let middle = [(LEFT + WIDTH - RIGHT) / 2.0, (TOP + bottom) / 2.0];
        let _ = writeln!(
            svg,
            "<path d=\"M{LEFT} {bottom}H{}\" stroke=\"#23282d\"/>\
             <text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            WIDTH - RIGHT,
            middle[0],
            HEIGHT - 12.0,
            escaped(self.x),
            middle[1],
            escaped(self.y)
        );
    }

    fn draw_line(
        &self,
        svg: &mut String,
        (x, y): (Axis, Axis),
        index: usize,
        name: &str,
        line: &[[f64; 2]],
    ) {
        let (color, dash) = STROKES[index % STROKES.len()];
        let mut path = String::new();
        for (i, point) in self.drawable(line).enumerate() {
            let start = if i == 0 { 'M' } else { 'L' };
            let (x, y) = (x.at(point[0]), y.at(point[1]));
            let _ = write!(path, "{start}{x:.1} {y:.1}");
            let _ =
                writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\" fill=\"{color}\"/>");
        }
        let stroke = format!(
            "fill=\"none\" stroke=\"{color}\" stroke-width=\"1.8\" stroke-dasharray=\"{dash}\""
        );
        let (legend_x, legend_y) = (WIDTH - RIGHT + 16.0, TOP + 10.0 + 22.0 * index as f64);
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" {stroke}/><path d=\"M{legend_x} {legend_y}h26\" {stroke}/>\
             <text x=\"{}\" y=\"{}\">{}</text>",
            legend_x + 34.0,
            legend_y + 4.0,
            escaped(name)
        );
    }
}

/// Creates an axis with room for all values; linear ones begin at zero.
fn axis(values: impl Iterator<Item = f64>, pixels: [f64; 2], log: bool) -> Axis {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let (low, high) = match (low <= high, log) {
        (false, _) => (1.0, 10.0),
        (true, true) => (low / 1.5, high * 1.5),
        (true, false) => (low.min(0.0), if high > low.min(0.0) { high * 1.04 } else { low + 1.0 }),
    };
    Axis { low, high, pixels, log }
}

fn label(value: f64, log: bool) -> String {
    if log && value < 1e-2 {
        format!("{value:.0e}")
    } else {
        format!("{}", (value * 1e6).round() / 1e6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_where_their_values_are() {
        let line = |log_y| LineChart {
            x: "theta, %",
            y: "a < b",
            log_y,
            lines: vec![("one".to_owned(), vec![[0.0, 1.0], [100.0, 100.0]])],
        };
        let svg = line(false).svg();
        assert!(svg.contains("a &lt; b") && svg.contains(">40<") && svg.contains("M64.0 "));
        let axis = axis([1.0, 100.0].into_iter(), [0.0, 1.0], true);
        assert_eq!(axis.ticks(), [1.0, 10.0, 100.0]);
        assert!((axis.at(10.0) - 0.5).abs() < 1e-9);
        assert!(line(true).svg().contains(">10<"));
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let lines = vec![("none".to_owned(), vec![[0.0, 0.0], [f64::NAN, 1.0]])];
        let svg = LineChart { x: "", y: "", log_y: true, lines }.svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf") && !svg.contains("<circle"));
    }
}
