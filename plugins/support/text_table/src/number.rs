//! Numbers with a decimal sign and thousands separators, read strictly.
//!
//! `1.234` under a decimal comma is 1234 where `.` separates thousands, and else no number:
//! it is never 1.234.

use std::borrow::Cow;

use source_units::find_unit;

/// Bytes of the longest number that is looked at.
const MAX_NUMBER_BYTES: usize = 512;
/// Digits between two thousands separators.
const GROUP_DIGITS: usize = 3;
/// Signs that separate thousands in one country or another.
const SEPARATORS: [char; 4] = ['.', ',', '\'', ' '];

/// Signs within a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Separators {
    /// Decimal sign, `.` or `,`.
    pub decimal: char,
    /// Thousands separator: `.`, `,`, `'` or a space; a space stands for narrow and
    /// no-break spaces too, `'` for a typographic apostrophe.
    pub thousands: Option<char>,
}

/// Format of the numbers of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberFormat(Separators);

impl Default for NumberFormat {
    fn default() -> Self {
        Self(Separators { decimal: '.', thousands: None })
    }
}

impl Separators {
    /// Parses the settings `decimal` and `thousands`.
    ///
    /// # Errors
    /// The setting at fault, and what is allowed.
    pub fn parse(decimal: &str, thousands: Option<&str>) -> Result<Self, String> {
        let decimal = match decimal {
            "." => '.',
            "," => ',',
            other => {
                return Err(format!("decimal: '{}' is neither . nor ,", crate::shorten(other)));
            }
        };
        let thousands = match thousands {
            None => None,
            Some("\u{2019}") => Some('\''),
            Some("\u{a0}" | "\u{202f}") => Some(' '),
            Some(text) => {
                let mut chars = text.chars();
                let one = chars.next().filter(|c| chars.next().is_none() && SEPARATORS.contains(c));
                let fault = || {
                    let text = crate::shorten(text);
                    format!("thousands: '{text}' is none of . , ' and a space")
                };
                Some(one.ok_or_else(fault)?)
            }
        };
        if thousands == Some(decimal) {
            return Err("thousands: the same as decimal".into());
        }
        Ok(Self { decimal, thousands })
    }
}

impl NumberFormat {
    /// Makes a format from its separators.
    pub fn new(separators: Separators) -> Self {
        Self(separators)
    }

    /// Rewrites a number as `-1234.5e6`: ASCII digits, a decimal point, no groups.
    ///
    /// # Errors
    /// The character that fits no number of this format, and the setting to change.
    pub fn normalize<'t>(&self, text: &'t str) -> Result<Cow<'t, str>, String> {
        let text = text.trim();
        let fault = || format!("'{}' is no number", crate::shorten(text));
        if text.len() > MAX_NUMBER_BYTES {
            return Err(fault());
        }
        if is_plain(text, self.0.decimal) {
            return Ok(Cow::Borrowed(text));
        }
        let (sign, digits) = match text.strip_prefix(['-', '\u{2212}']) {
            Some(digits) => ("-", digits),
            None => ("", text.strip_prefix('+').unwrap_or(text)),
        };
        let (mantissa, exponent) = digits.split_once(['e', 'E']).unwrap_or((digits, "0"));
        let (whole, fraction) = mantissa.split_once(self.0.decimal).unwrap_or((mantissa, ""));
        let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        let is_exponent = {
            let digits = exponent.strip_prefix(['+', '-']).unwrap_or(exponent);
            (1..=4).contains(&digits.len()) && is_number(digits)
        };
        let whole = self.ungroup(whole).ok_or_else(|| self.separator_fault(text))?;
        if whole.len() + fraction.len() == 0 || !is_number(fraction) || !is_exponent {
            return Err(self.separator_fault(text));
        }
        let exponent = if exponent == "0" { String::new() } else { format!("e{exponent}") };
        let point = if fraction.is_empty() { "" } else { "." };
        Ok(Cow::Owned(format!("{sign}{whole}{point}{fraction}{exponent}")))
    }

    /// Removes thousands separators; nothing where they do not stand at thousands.
    fn ungroup(&self, whole: &str) -> Option<String> {
        let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        let Some(separator) = self.0.thousands else {
            return is_digits(whole).then(|| whole.to_owned());
        };
        let mut groups = whole.split(|c: char| is_separator(c, separator));
        let first = groups.next()?;
        let rest: Vec<&str> = groups.collect();
        // No group of zeros leads: "0.500" where "." separates thousands is half of another format.
        let is_grouped = rest.is_empty()
            || ((1..=GROUP_DIGITS).contains(&first.len())
                && !first.starts_with('0')
                && rest.iter().all(|group| group.len() == GROUP_DIGITS));
        let digits: String = std::iter::once(first).chain(rest).collect();
        (is_grouped && is_digits(&digits)).then_some(digits)
    }

    fn separator_fault(&self, text: &str) -> String {
        let shown = crate::shorten(text);
        let has_separators = text.contains(SEPARATORS)
            && text.chars().all(|c| c.is_ascii_digit() || "+-\u{2212}eE.,' ".contains(c));
        if !has_separators {
            return format!("'{shown}' is no number");
        }
        let Separators { decimal, thousands } = self.0;
        let has = match thousands {
            None => "no sign separates thousands".to_owned(),
            Some(sign) => format!("'{sign}' separates thousands, in groups of three digits"),
        };
        format!(
            "'{shown}' is no number where '{decimal}' is the decimal sign and {has}: set `decimal` \
             and `thousands` as the file has them"
        )
    }

    /// Reads a number; `NaN` and infinities as such.
    ///
    /// # Errors
    /// That it is none, and the setting to change.
    pub fn parse_f64(&self, text: &str) -> Result<f64, String> {
        let text = text.trim();
        let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
        let is_word = |word: &str| unsigned.eq_ignore_ascii_case(word);
        if ["nan", "inf", "infinity"].iter().any(|word| is_word(word)) {
            return Ok(f64::NAN);
        }
        let plain = self.normalize(text)?;
        plain.parse().map_err(|_| format!("'{}' is no number", crate::shorten(text)))
    }

    /// Reads a whole number, which may be written `7.0`.
    ///
    /// # Errors
    /// That it is none of 64 bits, or has a fraction.
    pub fn parse_i64(&self, text: &str) -> Result<i64, String> {
        let plain = self.normalize(text)?;
        let shown = || crate::shorten(text);
        exact_whole(&plain).ok_or_else(|| match plain.parse::<f64>() {
            Ok(number) if number.fract() != 0.0 => format!("'{}' is no whole number", shown()),
            _ => format!("'{}' is no whole number of 64 bits", shown()),
        })
    }

    /// Splits a known unit, or `expected`, from the end of a cell.
    pub fn split_unit<'t>(
        &self,
        text: &'t str,
        expected: Option<&str>,
    ) -> (&'t str, Option<&'t str>) {
        const MAX_UNIT_CHARS: usize = 16;
        let text = text.trim();
        if text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.,".contains(&byte)) {
            return (text, None);
        }
        // The longest unit first: "5 kV" is no "5 k" in V.
        let starts = text.char_indices().rev().take(MAX_UNIT_CHARS).collect::<Vec<_>>();
        for (start, _) in starts.into_iter().rev().filter(|(start, _)| *start > 0) {
            let (number, unit) = text.split_at(start);
            let unit = unit.trim();
            let is_unit = find_unit(unit).is_some() || expected.is_some_and(|e| e.trim() == unit);
            if is_unit && self.normalize(number).is_ok() {
                return (number.trim(), Some(unit));
            }
        }
        (text, None)
    }
}

fn is_plain(text: &str, decimal: char) -> bool {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, "0"));
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    is_digits(whole) && is_digits(fraction) && (decimal == '.' || !digits.contains('.'))
}

fn is_separator(found: char, separator: char) -> bool {
    match separator {
        ' ' => matches!(found, ' ' | '\u{a0}' | '\u{202f}' | '\u{2009}'),
        '\'' => matches!(found, '\'' | '\u{2019}'),
        other => found == other,
    }
}

/// Scales a plain number by ten to the power of `shift`: the whole part, and whether nothing
/// was cut off. Nothing where it has more than 127 bits.
pub(crate) fn scale(plain: &str, shift: i32) -> Option<(i128, bool)> {
    let (mantissa, exponent) = plain.split_once(['e', 'E']).unwrap_or((plain, "0"));
    let (sign, digits) = match mantissa.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, mantissa),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all = format!("{whole}{fraction}");
    let all = all.trim_start_matches('0');
    if all.is_empty() {
        return Some((0, true));
    }
    let zeros = exponent.parse::<i32>().ok()?.checked_add(shift)?;
    let zeros = zeros.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let cut = usize::try_from(-zeros.min(0)).ok()?.min(all.len());
    let (kept, rest) = all.split_at_checked(all.len() - cut)?;
    let mut number = 0_i128;
    for digit in kept.bytes() {
        number = number.checked_mul(10)?.checked_add(i128::from(digit.checked_sub(b'0')?))?;
    }
    for _ in 0..if number == 0 { 0 } else { zeros.max(0) } {
        number = number.checked_mul(10)?;
    }
    Some((sign * number, rest.bytes().all(|digit| digit == b'0')))
}

fn exact_whole(plain: &str) -> Option<i64> {
    let (number, is_exact) = scale(plain, 0)?;
    i64::try_from(number).ok().filter(|_| is_exact)
}

#[cfg(test)]
#[path = "number_tests.rs"]
mod tests;
