//! Tags worked out of other tags.

use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};

/// The longest expression, bytes.
pub const MAX_EXPRESSION_BYTES: usize = 1000;
/// The deepest nesting of brackets in one.
pub const MAX_EXPRESSION_DEPTH: usize = 32;

/// Formula over tags. It has numbers, `+ - * / % ^`, comparisons, `&& || !`, brackets, `PI` and
/// the functions `min max abs sqrt exp ln log10 floor ceil round sin cos tan`. Tag ids stand in
/// braces: `{T1.I} * {T1.U} * sqrt(3)`.
///
/// All of it is double precision. True is 1, false 0; a double-point is 0 to 3 as IEC
/// 60870-5-101 numbers it. What has no result is not a number.
#[derive(Clone, Debug)]
pub struct Expression {
    compiled: FlatEx<f64, Operators>,
}

/// Errors of an expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ExpressionError {
    /// Too long or too deep.
    #[error("it has more than {0}")]
    TooLarge(String),
    /// The text is no expression.
    #[error("it cannot be read: {0}")]
    Syntax(String),
    /// The expression names no tag.
    #[error("it names no tag")]
    Constant,
}

/// The operators, on numbers alone: nothing in them can fail, or take long.
#[derive(Clone, Debug)]
struct Operators;

impl Expression {
    /// Parses an expression over tag ids.
    ///
    /// # Errors
    /// [`ExpressionError`].
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        if text.len() > MAX_EXPRESSION_BYTES {
            return Err(ExpressionError::TooLarge(format!("{MAX_EXPRESSION_BYTES} bytes")));
        }
        if depth(text) > MAX_EXPRESSION_DEPTH {
            let limit = format!("{MAX_EXPRESSION_DEPTH} brackets in each other");
            return Err(ExpressionError::TooLarge(limit));
        }
        let compiled = FlatEx::parse(text)
            .map_err(|error| ExpressionError::Syntax(error.msg().trim().to_owned()))?;
        let expression = Self { compiled };
        if expression.inputs().is_empty() {
            return Err(ExpressionError::Constant);
        }
        Ok(expression)
    }

    /// The ids of the tags that it names, each once.
    pub fn inputs(&self) -> &[String] {
        self.compiled.var_names()
    }

    /// Evaluates the expression for the values of its inputs, in their order; NaN where there is
    /// no result.
    pub fn evaluate(&self, inputs: &[f64]) -> f64 {
        self.compiled.eval(inputs).unwrap_or(f64::NAN)
    }
}

fn depth(text: &str) -> usize {
    let (mut depth, mut deepest) = (0_usize, 0);
    for byte in text.bytes() {
        match byte {
            b'(' => depth += 1,
            b')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    deepest
}

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        let binary = |name, prio, is_commutative, apply| {
            Operator::make_bin(name, BinOp { apply, prio, is_commutative })
        };
        let sign = |name, apply, unary| {
            Operator::make_bin_unary(name, BinOp { apply, prio: 4, is_commutative: false }, unary)
        };
        let mut operators = vec![
            binary("||", 0, true, |a, b| truth(a != 0.0 || b != 0.0)),
            binary("&&", 1, true, |a, b| truth(a != 0.0 && b != 0.0)),
            binary("==", 2, true, |a, b| truth(a == b)),
            binary("!=", 2, true, |a, b| truth(a != b)),
            binary("<=", 3, false, |a, b| truth(a <= b)),
            binary(">=", 3, false, |a, b| truth(a >= b)),
            binary("<", 3, false, |a, b| truth(a < b)),
            binary(">", 3, false, |a, b| truth(a > b)),
            sign("+", |a, b| a + b, |a| a),
            sign("-", |a, b| a - b, |a| -a),
            binary("*", 5, true, |a, b| a * b),
            binary("/", 5, false, |a, b| a / b),
            binary("%", 5, false, |a, b| a % b),
            binary("^", 6, false, f64::powf),
            binary("min", 7, true, lesser),
            binary("max", 7, true, greater),
            Operator::make_unary("!", |a| truth(a == 0.0)),
            Operator::make_constant("PI", std::f64::consts::PI),
        ];
        let functions = [
            ("abs", f64::abs as fn(f64) -> f64),
            ("sqrt", f64::sqrt),
            ("exp", f64::exp),
            ("ln", f64::ln),
            ("log10", f64::log10),
            ("floor", f64::floor),
            ("ceil", f64::ceil),
            ("round", f64::round),
            ("sin", f64::sin),
            ("cos", f64::cos),
            ("tan", f64::tan),
        ];
        operators.extend(functions.map(|(name, function)| Operator::make_unary(name, function)));
        operators
    }
}

fn truth(is_true: bool) -> f64 {
    f64::from(u8::from(is_true))
}

/// Unlike [`f64::min`], no number where one of the two is none.
fn lesser(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) }
}

fn greater(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn value(text: &str, inputs: &[f64]) -> f64 {
        Expression::parse(text).unwrap_or_else(|error| panic!("{text}: {error}")).evaluate(inputs)
    }

    #[test]
    fn formulas_of_tags_have_values() {
        assert_eq!(value("{a} + 2 * {b}", &[1.0, 3.0]), 7.0);
        assert_eq!(value("-{a} ^ 2", &[3.0]), 9.0, "signs bind closest");
        assert_eq!(value("{=S1-QA1/I b} - {a} - 1", &[10.0, 2.0]), 7.0);
        assert_eq!(value("max({a}, {b}) > 3 && !({a} == {b})", &[1.0, 4.0]), 1.0);
        assert_eq!(value("{a} <= 1 || {a} % 2 == 1", &[4.0]), 0.0);
        assert!((value("sqrt(3) * {u} * {i}", &[2.0, 10.0]) - 3_f64.sqrt() * 20.0).abs() < 1e-12);
        assert_eq!(Expression::parse("{b} + {a} * {b}").unwrap().inputs(), ["a", "b"]);
    }

    #[test]
    fn what_has_no_result_is_not_a_number() {
        assert!(value("min({a}, 1)", &[f64::NAN]).is_nan());
        assert!(value("sqrt({a})", &[-1.0]).is_nan());
        assert_eq!(value("1 / {a}", &[0.0]), f64::INFINITY);
        assert!(value("{a}", &[]).is_nan());
    }

    #[test]
    fn what_is_no_expression_is_refused_with_a_reason() {
        let fault = |text: &str| Expression::parse(text).unwrap_err().to_string();
        assert_eq!(fault("1 + 2"), "it names no tag");
        assert!(fault("{a} +").starts_with("it cannot be read"));
        assert!(fault("").starts_with("it cannot be read"));
        assert!(fault(&"(".repeat(40)).contains("32 brackets"));
        assert!(fault(&format!("{{a}}{}", "+1".repeat(600))).contains("1000 bytes"));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn any_text_is_read_or_refused(text in "[-+*/%^!=<>&|(){}a-c0-9., minaxsqrté]{0,60}") {
            if let Ok(expression) = Expression::parse(&text) {
                expression.evaluate(&vec![1.5; expression.inputs().len()]);
            }
        }
    }
}
