//! The pace on machines of several kinds, without a device.

use super::*;

const TARGET: f64 = 16.6;

/// A machine: what a frame takes whatever it shows, and what its triangles take at full
/// detail, milliseconds. Triangles go with the error that may show, by this power.
struct Machine {
    fixed: f64,
    triangles: f64,
    power: f64,
}

impl Machine {
    fn frame(&self, coarseness: f32, tremor: f64) -> f64 {
        (self.fixed + self.triangles * f64::from(coarseness).powf(-self.power)) * (1.0 + tremor)
    }
}

/// Steps taken after each of so many frames.
fn run(frame_budget: &mut FrameBudget, machine: &Machine, frames: usize) -> Vec<u32> {
    let mut seed = 7_u32;
    let mut step = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Within a twentieth, and now and then a frame that something else delays.
        let tremor = f64::from(seed >> 8) / f64::from(1 << 24) * 0.1 - 0.05;
        let delay = if seed.is_multiple_of(17) { 3.0 } else { 0.0 };
        frame_budget.evaluate(machine.frame(frame_budget.coarseness(), tremor + delay));
        frame_budget.steps
    };
    (0..frames).map(|_| step()).collect()
}

fn changes(steps: &[u32]) -> usize {
    steps.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

#[test]
fn a_fast_machine_keeps_full_detail() {
    let mut frame_budget = FrameBudget::new(Some(TARGET));
    let machine = Machine { fixed: 2.0, triangles: 5.0, power: 1.0 };
    assert!(run(&mut frame_budget, &machine, 2_000).iter().all(|&steps| steps == 0));
}

#[test]
fn a_slow_machine_reaches_its_frame_time_and_stays_there() {
    for (triangles, power) in [(25.0, 1.0), (40.0, 1.0), (60.0, 1.5), (30.0, 0.7)] {
        let mut frame_budget = FrameBudget::new(Some(TARGET));
        let machine = Machine { fixed: 6.0, triangles, power };
        let settled = run(&mut frame_budget, &machine, 300);
        let took = machine.frame(frame_budget.coarseness(), 0.0);
        assert!(took <= TARGET * OVERRUN_SHARE * 1.05, "{took} after {settled:?}");
        let steps = run(&mut frame_budget, &machine, 10_000);
        assert_eq!(changes(&steps), 0, "{triangles}, {power}");
    }
}

#[test]
fn detail_that_saves_no_time_is_kept() {
    let mut frame_budget = FrameBudget::new(Some(TARGET));
    let machine = Machine { fixed: 40.0, triangles: 0.5, power: 1.0 };
    let frames = 10_000;
    let steps = run(&mut frame_budget, &machine, frames);
    let given_up = steps.iter().filter(|&&steps| steps > 0).count();
    assert!(given_up < frames / 20, "{given_up}");
    assert!(steps.iter().all(|&steps| steps <= 1));
}

#[test]
fn detail_returns_with_time() {
    let mut frame_budget = FrameBudget::new(Some(TARGET));
    run(&mut frame_budget, &Machine { fixed: 2.0, triangles: 60.0, power: 1.0 }, 1_000);
    assert!(frame_budget.steps >= 3);
    let steps = run(&mut frame_budget, &Machine { fixed: 2.0, triangles: 4.0, power: 1.0 }, 1_000);
    assert_eq!(steps.last(), Some(&0));
    assert!(steps.is_sorted_by(|a, b| a >= b), "there is no way round");
}

#[test]
fn without_a_target_detail_is_as_configured() {
    let mut frame_budget = FrameBudget::new(None);
    run(&mut frame_budget, &Machine { fixed: 90.0, triangles: 90.0, power: 1.0 }, 500);
    assert_eq!(frame_budget.coarseness(), 1.0);
}

#[test]
fn frames_that_wait_for_meshes_do_not_change_the_budget() {
    let mut frame_budget = FrameBudget::new(Some(TARGET));
    let slow = FrameStats { cpu_millis: 90.0, draw_calls: 1, ..FrameStats::default() };
    (0..100).for_each(|_| frame_budget.record_frame(&FrameStats { waiting: 1, ..slow }));
    (0..100).for_each(|_| frame_budget.record_frame(&FrameStats { draw_calls: 0, ..slow }));
    assert_eq!(frame_budget.steps, 0);
    (0..MEDIAN_FRAMES).for_each(|_| frame_budget.record_frame(&slow));
    assert_eq!(frame_budget.steps, 1);
}
