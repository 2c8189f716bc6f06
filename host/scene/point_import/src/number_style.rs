//! Decimal marks and thousands separators of a list: `1.234,5`, `1,234.5`, `1 234.5`.

/// Digits of a group of thousands.
const GROUP: usize = 3;

/// Marks that the unambiguous numbers of a list show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct NumberStyle {
    has_point: bool,
    has_comma: bool,
    /// True where a lone point is a decimal one, as long as nothing else is seen.
    takes_points: bool,
}

/// Error of a text that is no number, or an ambiguous one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum NumberFault {
    NoNumber,
    /// Number with two readings.
    Ambiguous([f64; 2]),
}

/// Readings of a number's text by itself.
enum Reading {
    /// Number without any separators.
    Plain(f64),
    /// Number with a decimal point, or commas between thousands.
    Point(f64),
    /// Number with a decimal comma, or points between thousands.
    Comma(f64),
    /// Ambiguous number: `1.234` is 1.234 by a decimal point or 1234 by a decimal comma.
    Either { by_point: f64, by_comma: f64 },
}

impl NumberStyle {
    /// Style of lists whose fields are parted by commas: a point is a decimal one there, as
    /// long as nothing else is seen.
    pub(crate) fn of_commas() -> Self {
        Self { takes_points: true, ..Self::default() }
    }

    /// Learns the style from one number.
    pub(crate) fn observe(&mut self, text: &str) {
        match reading_of(text) {
            Some(Reading::Point(_)) => self.has_point = true,
            Some(Reading::Comma(_)) => self.has_comma = true,
            _ => {}
        }
    }

    /// Parses a number in the style of the list.
    ///
    /// # Errors
    /// None, or one that could be two, and the list does not show which.
    pub(crate) fn parse(self, text: &str) -> Result<f64, NumberFault> {
        let number = match reading_of(text).ok_or(NumberFault::NoNumber)? {
            Reading::Plain(number) | Reading::Point(number) | Reading::Comma(number) => number,
            Reading::Either { by_point, by_comma } => match (self.has_point, self.has_comma) {
                (true, false) => by_point,
                (false, true) => by_comma,
                (false, false) if self.takes_points && text.contains('.') => by_point,
                _ => return Err(NumberFault::Ambiguous([by_point, by_comma])),
            },
        };
        if number.is_finite() { Ok(number) } else { Err(NumberFault::NoNumber) }
    }
}

fn reading_of(text: &str) -> Option<Reading> {
    // Blanks and apostrophes part thousands alone.
    let is_blank = |c: char| c.is_whitespace() || "'’".contains(c);
    let spaceless;
    let text = if text.contains(is_blank) {
        let whole = text.split(['.', ',']).next().unwrap_or_default();
        if !is_grouped(whole.trim_start_matches(['-', '+']).split(is_blank)) {
            return None;
        }
        spaceless = text.chars().filter(|c| !is_blank(*c)).collect::<String>();
        &spaceless
    } else {
        text
    };
    let (points, commas) = (text.matches('.').count(), text.matches(',').count());
    let unsigned = text.trim_start_matches(['-', '+']);
    let by_point = || text.replace(',', "").parse().ok();
    let by_comma = || text.replace('.', "").replace(',', ".").parse().ok();
    match (points, commas) {
        (0, 0) => text.parse().ok().map(Reading::Plain),
        (1, 0) if may_be_thousands(unsigned, '.') => {
            Some(Reading::Either { by_point: text.parse().ok()?, by_comma: by_comma()? })
        }
        (1, 0) => text.parse().ok().map(Reading::Point),
        (0, 1) if may_be_thousands(unsigned, ',') => {
            Some(Reading::Either { by_point: by_point()?, by_comma: by_comma()? })
        }
        (0, 1) => by_comma().map(Reading::Comma),
        (_, 0) if is_grouped(unsigned.split('.')) => by_comma().map(Reading::Comma),
        (0, _) if is_grouped(unsigned.split(',')) => by_point().map(Reading::Point),
        // The last mark is the decimal one.
        (1, _) if text.rfind('.') > text.rfind(',') => {
            let (whole, _) = unsigned.split_once('.')?;
            is_grouped(whole.split(',')).then(by_point)?.map(Reading::Point)
        }
        (_, 1) if text.rfind(',') > text.rfind('.') => {
            let (whole, _) = unsigned.split_once(',')?;
            is_grouped(whole.split('.')).then(by_comma)?.map(Reading::Comma)
        }
        _ => None,
    }
}

/// Reports whether `1.234` may be thousands: one to three digits, not 0 alone, then three.
fn may_be_thousands(unsigned: &str, mark: char) -> bool {
    is_grouped(unsigned.split(mark))
}

/// Reports whether digits are grouped into thousands: `1`, `234`, `567`.
fn is_grouped<'t>(mut groups: impl Iterator<Item = &'t str>) -> bool {
    let is_digits = |group: &str| group.bytes().all(|byte| byte.is_ascii_digit());
    let first = groups.next().unwrap_or_default();
    (1..=GROUP).contains(&first.len())
        && is_digits(first)
        && !first.starts_with('0')
        && groups.all(|group| group.len() == GROUP && is_digits(group))
}

#[cfg(test)]
#[path = "number_style_tests.rs"]
mod tests;
