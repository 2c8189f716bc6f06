use busbar_types::{DoublePoint, Reason, Text, ValueKind};

use super::*;
use crate::{SourcePolicy, TelemetryTag};

const SECOND: i64 = 1_000_000_000;
const START: i64 = 1_790_000_000 * SECOND;
const DOUBT: Quality = Quality::Uncertain(Reason::SourceTime);

struct Fixture {
    intake: SampleIntake,
    /// Seconds since the start by the clock of moments, and by the wall clock.
    now: i64,
    wall: i64,
}

impl Fixture {
    fn new() -> Self {
        let tag = |tag: u32| TelemetryTag {
            tag: TagHandle(tag),
            kind: ValueKind::F64,
            freshness: Duration::from_secs(5),
            id: format!("t{tag}"),
            address_json: String::new(),
            unit: String::new(),
        };
        let intake = SampleIntake::new(&[tag(0), tag(1)], SourcePolicy::default());
        Self { intake, now: 1000, wall: 1000 }
    }

    fn pass(&mut self, seconds: i64) {
        (self.now, self.wall) = (self.now + seconds, self.wall + seconds);
    }

    /// Returns the samples made of a value that was written `waited` seconds ago, with a source
    /// time in seconds.
    fn samples(&mut self, tag: u32, waited: i64, source_time: Option<i64>) -> Vec<Sample> {
        let (value, quality) = (Some(Value::F64(1.5)), Quality::Good);
        let said = ProgramValue { tag: TagHandle(tag), value, quality, source_time };
        let at = (Moment((self.now * SECOND) as u64), SourceTime(START + self.wall * SECOND));
        let (waited, mut all) = (Duration::from_secs(waited as u64), Vec::new());
        self.intake.take_program_value(&said, waited, at, &mut |sample: &Sample| {
            all.push(sample.clone());
        });
        all
    }

    /// Quality and age in seconds of one value.
    fn take(&mut self, waited: i64, source_time: Option<i64>) -> (Quality, i64) {
        let source_time = source_time.map(|seconds| START + seconds * SECOND);
        let samples = self.samples(0, waited, source_time);
        let [sample] = &samples[..] else { panic!("{samples:?}") };
        assert_eq!(sample.value, Some(Value::F64(1.5)));
        assert_eq!(sample.received, Moment((self.now * SECOND) as u64));
        (sample.quality, self.now - (sample.valid_from.0 / SECOND as u64) as i64)
    }
}

#[test]
fn a_value_is_as_old_as_its_time_or_its_way_says() {
    let mut fixture = Fixture::new();
    assert_eq!(fixture.take(0, None), (Quality::Good, 0));
    assert_eq!(fixture.take(3, None), (Quality::Good, 3));
    assert_eq!(fixture.take(0, Some(998)), (Quality::Good, 2));
    assert_eq!(fixture.take(3, Some(996)), (Quality::Good, 4));
    // In order of arrival, were its clock set back.
    assert_eq!(fixture.take(0, Some(990)), (Quality::Good, 10));
}

#[test]
fn the_same_time_again_is_no_younger() {
    let mut fixture = Fixture::new();
    assert_eq!(fixture.take(0, Some(999)), (Quality::Good, 1));
    assert_eq!(fixture.take(0, Some(1000)), (Quality::Good, 0));
    fixture.pass(4);
    assert_eq!(fixture.take(0, Some(1000)), (Quality::Good, 4));
    // Not either where the viewer's clock is set back.
    fixture.wall -= 4;
    assert_eq!(fixture.take(0, Some(1000)).1, 4);
}

#[test]
fn a_time_of_the_future_is_uncertain_and_stays_so() {
    let mut fixture = Fixture::new();
    assert_eq!(fixture.take(0, Some(1010)), (Quality::Good, 0));
    assert_eq!(fixture.take(0, Some(1011)).0, DOUBT);
    fixture.pass(20);
    assert_eq!(fixture.take(0, Some(1011)).0, DOUBT, "the clock caught up, the value did not");
    assert_eq!(fixture.take(0, Some(1020)).0, Quality::Good);
    // By the clock of when it was said.
    assert_eq!(fixture.take(15, Some(1016)).0, DOUBT);
}

#[test]
fn a_value_of_the_future_casts_doubt_on_those_that_showed_one_time() {
    let mut fixture = Fixture::new();
    let time = |seconds: i64| Some(START + seconds * SECOND);
    assert_eq!(fixture.samples(1, 0, time(999))[0].quality, Quality::Good);
    let samples = fixture.samples(0, 0, time(5000));
    let doubted: Vec<_> = samples.iter().map(|sample| (sample.tag.0, sample.quality)).collect();
    assert!(doubted.contains(&(1, DOUBT)) && doubted.contains(&(0, DOUBT)), "{doubted:?}");
}

#[test]
fn impossible_times_are_uncertain_and_other_tags_are_left_alone() {
    let mut fixture = Fixture::new();
    for time in [-1, i64::MIN, i64::MIN + 1, i64::MAX] {
        let samples = fixture.samples(0, 0, Some(time));
        assert_eq!(samples.last().unwrap().quality, DOUBT, "{time}");
    }
    assert!(fixture.samples(7, 0, None).is_empty(), "it is not the host program's");
}

#[test]
fn every_value_and_quality_is_handed_on() {
    let mut fixture = Fixture::new();
    let at = (Moment(1000 * SECOND as u64), SourceTime(START));
    let positions =
        [DoublePoint::Intermediate, DoublePoint::Off, DoublePoint::On, DoublePoint::BadState];
    let mut values = vec![None, Some(Value::I64(-7)), Some(Value::Bool(true))];
    values.extend([Some(Value::F64(-0.5)), Some(Value::Bool(false))]);
    values.extend(positions.map(|position| Some(Value::DoublePoint(position))));
    values.push(Text::new("AUTO").map(Value::Text));
    let unknown = Reason::Unknown;
    for value in values {
        for quality in [Quality::Good, Quality::Uncertain(unknown), Quality::Bad(unknown)] {
            let said = {
                let value = value.clone();
                ProgramValue { tag: TagHandle(0), value, quality, source_time: None }
            };
            let mut all = Vec::new();
            let mut sink = |sample: &Sample| all.push((sample.value.clone(), sample.quality));
            assert!(fixture.intake.take_program_value(&said, Duration::ZERO, at, &mut sink));
            assert_eq!(all, [(value.clone(), quality)]);
        }
    }
}
