//! Fuzzing of expressions: any text is an expression or refused with a message. No panic or stack
//! overflow occurs, inputs are those that the text names, and equal numbers give equal values.

use busbar_tags::{Expression, MAX_EXPRESSION_BYTES};

/// Numbers assigned to the inputs, in turn.
const NUMBERS: [f64; 6] = [1.5, -3.0, 0.0, f64::NAN, f64::INFINITY, 1e300];

/// Runs one input; reports whether the expression is accepted.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let expression = match Expression::parse(text) {
        Ok(expression) => expression,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            return false;
        }
    };
    assert!(text.len() <= MAX_EXPRESSION_BYTES);
    let inputs = expression.inputs();
    assert!(!inputs.is_empty());
    for (index, input) in inputs.iter().enumerate() {
        assert!(text.contains(input.as_str()), "'{input}' is not in it");
        assert!(!inputs[..index].contains(input), "'{input}' is there twice");
    }
    for shift in 0..NUMBERS.len() {
        let numbers: Vec<_> =
            NUMBERS.iter().cycle().skip(shift).take(inputs.len()).copied().collect();
        let [first, second] = [(); 2].map(|()| expression.evaluate(&numbers));
        assert!(first == second || first.is_nan() && second.is_nan());
    }
    assert!(expression.evaluate(&[]).is_nan(), "a value without inputs");
    true
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("expression", fuzz_one);
}
