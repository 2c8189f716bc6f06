use super::*;

const PERIOD: Duration = Duration::from_secs(20);
const LONGEST: Duration = Duration::from_secs(6);

fn plan(seed: u64) -> FaultPlan {
    FaultPlan::new(seed, &FaultKind::ALL, PERIOD, LONGEST).unwrap()
}

#[test]
fn every_kind_has_its_turn_and_leaves_healthy_time() {
    for seed in 0..20 {
        let plan = plan(seed);
        let mut kinds = Vec::new();
        for number in 0..7 {
            let fault = plan.fault_of(number).unwrap();
            let start = PERIOD * u32::try_from(number).unwrap();
            let length = fault.ends - fault.begins;
            assert!((LONGEST / 2..=LONGEST).contains(&length), "{fault:?}");
            assert!(fault.begins >= start + (PERIOD - LONGEST) / 4, "{fault:?}");
            assert!(fault.ends <= start + PERIOD, "{fault:?}");
            assert_eq!(fault.clock_ahead_seconds != 0, fault.kind == FaultKind::ClockJump);
            kinds.push(fault.kind);
        }
        kinds.sort();
        assert_eq!(kinds, FaultKind::ALL, "seed {seed}");
    }
}

#[test]
fn changes_are_where_the_fault_begins_and_ends() {
    let plan = plan(3);
    let (mut now, mut changes) = (Duration::ZERO, 0);
    while now < PERIOD * 10 {
        let next = plan.next_change(now).unwrap();
        assert!(next > now);
        let just_before = next - Duration::from_nanos(1);
        assert_ne!(plan.at(just_before), plan.at(next), "{next:?}");
        for between in [now, now + (next - now) / 2, just_before] {
            assert_eq!(plan.at(between), plan.at(now), "{between:?}");
        }
        (now, changes) = (next, changes + 1);
    }
    assert_eq!(changes, 21);
}

#[test]
fn seeds_repeat_and_differ() {
    let faults = |seed| (0..20).map(|n| plan(seed).fault_of(n)).collect::<Vec<_>>();
    assert_eq!(faults(5), faults(5));
    assert_ne!(faults(5), faults(6));
}

#[test]
fn no_kinds_are_no_faults() {
    let quiet = FaultPlan::new(1, &[], PERIOD, LONGEST).unwrap();
    for plan in [quiet, FaultPlan::none()] {
        assert_eq!((plan.at(LONGEST), plan.next_change(LONGEST)), (None, None));
    }
    assert!(FaultPlan::new(1, &[], LONGEST, LONGEST).is_err());
    assert!(FaultPlan::new(1, &[], LONGEST, Duration::ZERO).is_err());
}

#[test]
fn sums_are_kinds() {
    let all = FaultKind::ALL.iter().map(|kind| kind.bit()).sum();
    assert_eq!(fault_kinds(all), Some(FaultKind::ALL.to_vec()));
    assert_eq!(fault_kinds(0), Some(Vec::new()));
    assert_eq!(fault_kinds(4), Some(vec![FaultKind::HalfOpen]));
    assert_eq!(fault_kinds(1 << 20), None);
}

#[test]
fn the_faults_of_a_scenario_hold_when_told() {
    let seconds = Duration::from_secs;
    let fault =
        |kind, begins, ends| LinkFault { kind, begins: seconds(begins), ends: seconds(ends) };
    let told = vec![fault(FaultKind::LinkLoss, 10, 20), fault(FaultKind::HalfOpen, 30, 40)];
    // The simulation was started again 12 s into the scenario.
    let plan = FaultPlan::none().with_link_faults(seconds(12), told);
    let kind = |since| plan.at(seconds(since)).map(|fault| fault.kind);
    assert_eq!(kind(0), Some(FaultKind::LinkLoss));
    assert_eq!([kind(8), kind(17)], [None, None]);
    assert_eq!([kind(18), kind(27)], [Some(FaultKind::HalfOpen); 2]);
    assert_eq!(kind(28), None);
    let changes = [0, 8, 18, 28].map(|since| plan.next_change(seconds(since)));
    assert_eq!(changes, [Some(seconds(8)), Some(seconds(18)), Some(seconds(28)), None]);
}
