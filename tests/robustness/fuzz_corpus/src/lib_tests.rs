use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::*;

#[test]
fn a_run_is_the_same_each_time_and_has_every_kept_input() {
    let inputs = || {
        let seen = RefCell::new(Vec::new());
        check("iec104", |input| {
            seen.borrow_mut().push(input.to_vec());
            seen.borrow().len() % 2 == 0
        });
        seen.into_inner()
    };
    let (first, second) = (inputs(), inputs());
    assert_eq!(first, second);
    let kept = kept("iec104");
    assert_eq!(first.len(), kept.len() + ROUNDS as usize);
    assert!(kept.iter().map(|(_, input)| input).eq(&first[..kept.len()]));
    assert!(first.iter().all(|input| input.len() <= MAX_INPUT_BYTES));
}

#[test]
fn what_tests_nothing_fails() {
    let fails = |target: &str, taken: bool| {
        catch_unwind(AssertUnwindSafe(|| check(target, |_| taken))).is_err()
    };
    assert!(fails("iec104", true) && fails("iec104", false));
    assert!(fails("no such target", true));
}
