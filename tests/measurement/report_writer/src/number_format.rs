//! Number formats for reports: grouped digits, percentages, factors, times.

/// Formats a number with grouped thousands: `1,057,086`.
pub fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Formats a number with grouped thousands and a sign.
pub fn signed(value: i64) -> String {
    let sign = if value < 0 { "-" } else { "" };
    format!("{sign}{}", grouped(value.unsigned_abs()))
}

/// Formats a share as per cent, with as many decimals as a small one needs.
pub fn percent(share: f64) -> String {
    // Minus nothing is nothing.
    let percent = share * 100.0 + 0.0;
    match percent.abs() {
        p if p == 0.0 || p >= 99.95 => format!("{percent:.0} %"),
        p if p >= 10.0 => format!("{percent:.1} %"),
        p if p >= 0.1 => format!("{percent:.2} %"),
        p if p >= 0.01 => format!("{percent:.3} %"),
        _ => format!("{percent:.4} %"),
    }
}

/// Formats a theta as the paper writes it: `70 %`.
pub fn theta(theta: f64) -> String {
    format!("{:.0} %", theta * 100.0)
}

/// Formats a size in pixels: `1280 x 720`.
pub fn size([width, height]: [u32; 2]) -> String {
    format!("{width} x {height}")
}

/// Formats milliseconds with about three digits.
pub fn millis(value: f64) -> String {
    match value.abs() {
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

/// Formats a factor with two decimals, or `-`.
pub fn factor(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_read_well() {
        assert_eq!([0, 999, 1000, 1_057_086].map(grouped), ["0", "999", "1,000", "1,057,086"]);
        assert_eq!(signed(-15_196), "-15,196");
        assert_eq!(
            [-0.0, 1.0, 0.1234, 0.01234, 0.0001].map(percent),
            ["0 %", "100 %", "12.3 %", "1.23 %", "0.010 %"]
        );
        assert_eq!((theta(0.85), size([320, 180])), ("85 %".to_owned(), "320 x 180".to_owned()));
        assert_eq!([812.4, 12.34, 1.234].map(millis), ["812", "12.3", "1.23"]);
        assert_eq!([Some(3.344), None].map(factor), ["3.34", "-"]);
    }
}
