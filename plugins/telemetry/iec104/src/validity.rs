//! Validity of the values of each common address since data transfer started: which tags
//! have a value, and whether an event may come out of the station's buffer.
//!
//! IEC 60870-5-104 has no bit for events out of a buffer. While the interrogation that
//! follows the start of data transfer (or the end of initialisation) is not at its end, a
//! station may still send what it kept while nobody was connected. Until then an event
//! for an object that already has an interrogated value is doubtful, where its time does
//! not show that it is of this connection. The same holds for one that is older than another
//! event of its object.

use std::ops::Range;
use std::time::{Duration, SystemTime};

use crate::codec::TimeTag;
use crate::points::Points;

/// Common addresses that mean none and all stations (IEC 60870-5-101, 7.2.4).
pub(crate) const NO_STATION: u16 = 0;
pub(crate) const ALL_STATIONS: u16 = 0xFFFF;
/// Difference of the clocks that is no contradiction: the host's limit for times ahead.
const CLOCK_TOLERANCE: Duration = Duration::from_secs(10);
/// Interrogations that a station may take to empty its buffer, unanswered ones included. After these, events count
/// in order of arrival, so that a clock that is wrong holds nothing up for long.
const CATCH_UP_ROUNDS: u8 = 2;
/// Events of another type in a row, after which a tag's configuration is at fault and not
/// the data units.
const MAX_MISFITS: u8 = 4;

/// Transmission that gave a tag its value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Evidence {
    /// No value since the tag was marked bad.
    #[default]
    None,
    /// Spontaneous, or return information: perhaps kept in a buffer before.
    Event,
    /// Interrogated, requested, cyclic: the state when it was sent.
    Present,
}

/// Order in which an event counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EventOrder {
    /// Order of their arrival.
    Arrival,
    /// Out of a buffer, or of a clock that was set back.
    Doubtful {
        /// Tells whether its time is before the start of data transfer.
        is_before_start: bool,
    },
}

/// Validity of all tags of a station.
#[derive(Debug)]
pub(crate) struct Validity {
    /// Evidence of each point.
    evidence: Vec<Evidence>,
    /// By point: newest time of its events since it had no value, while a buffer may come.
    newest_events: Vec<Option<SystemTime>>,
    /// By point: objects of another type in a row, also on former connections.
    misfits: Vec<u8>,
    /// In order of the common addresses.
    addresses: Vec<AddressState>,
}

#[derive(Debug)]
struct AddressState {
    common_address: u16,
    points: Range<usize>,
    /// Number of points with evidence.
    valued: usize,
    catch_up: Option<CatchUp>,
}

/// Time in which the station's buffer may come.
#[derive(Clone, Copy, Debug)]
struct CatchUp {
    started: SystemTime,
    rounds_left: u8,
    /// Tells whether a doubtful event came in this round.
    is_doubted: bool,
}

impl Validity {
    pub(crate) fn new(points: &Points) -> Self {
        let state = |common_address| AddressState {
            common_address,
            points: points.of_station(common_address),
            valued: 0,
            catch_up: None,
        };
        let count = points.all().len();
        let addresses = points.common_addresses().into_iter().map(state).collect();
        Self {
            evidence: vec![Evidence::None; count],
            newest_events: vec![None; count],
            misfits: vec![0; count],
            addresses,
        }
    }

    /// Data transfer starts; an interrogation follows, or does not.
    pub(crate) fn begin(&mut self, started: SystemTime, is_interrogated: bool) {
        self.evidence.fill(Evidence::None);
        self.newest_events.fill(None);
        for state in &mut self.addresses {
            state.valued = 0;
            state.catch_up = is_interrogated.then(|| CatchUp::new(started));
        }
    }

    /// Common addresses that a data unit of this one concerns: all of them where it names
    /// none, and none where no tag has it.
    pub(crate) fn concerned(&self, common_address: Option<u16>) -> Vec<u16> {
        let all = self.addresses.iter().map(|state| state.common_address);
        match common_address {
            None | Some(NO_STATION | ALL_STATIONS) => all.collect(),
            Some(wanted) => all.filter(|address| *address == wanted).collect(),
        }
    }

    pub(crate) fn is_answered(&self, point: usize) -> bool {
        self.evidence.get(point).is_some_and(|evidence| *evidence != Evidence::None)
    }

    pub(crate) fn is_present(&self, point: usize) -> bool {
        self.evidence.get(point) == Some(&Evidence::Present)
    }

    /// A value of a fitting type came for a point.
    pub(crate) fn note_value(&mut self, common_address: u16, point: usize, by: Evidence) {
        if let Some(misfits) = self.misfits.get_mut(point) {
            *misfits = 0;
        }
        self.set(common_address, point, by);
    }

    /// An object of another type came for a point. Returns whether it may be the value of
    /// another object at the wrong address. Where it stays so, and at once where it is
    /// told as the present state again, the tag's configuration is at fault.
    pub(crate) fn note_misfit(&mut self, common_address: u16, point: usize, by: Evidence) -> bool {
        self.set(common_address, point, Evidence::None);
        let Some(misfits) = self.misfits.get_mut(point) else { return false };
        let is_doubtful = match by {
            Evidence::Present => *misfits == 0,
            _ => *misfits < MAX_MISFITS,
        };
        *misfits = if by == Evidence::Present { MAX_MISFITS } else { misfits.saturating_add(1) };
        is_doubtful
    }

    /// Nothing is known of a common address any more; returns the points that had a value.
    pub(crate) fn distrust(&mut self, common_address: u16) -> Vec<usize> {
        let Some(state) = self.addresses.iter_mut().find(|s| s.common_address == common_address)
        else {
            return Vec::new();
        };
        // Those that have none are bad already, so that a flood costs nothing.
        if std::mem::take(&mut state.valued) == 0 {
            return Vec::new();
        }
        self.newest_events[state.points.clone()].fill(None);
        let evidence = &mut self.evidence;
        let take = |point: &usize| {
            evidence.get_mut(*point).map(std::mem::take).unwrap_or_default() != Evidence::None
        };
        state.points.clone().filter(take).collect()
    }

    /// A common address has started anew.
    pub(crate) fn restart(&mut self, common_address: u16, started: SystemTime) -> Vec<usize> {
        let points = self.distrust(common_address);
        if let Some(state) = self.state(common_address) {
            state.catch_up = Some(CatchUp::new(started));
        }
        points
    }

    /// An interrogation has ended, however. Without an answer the buffer may still come.
    pub(crate) fn end_round(&mut self, common_address: u16, is_answered: bool) {
        let Some(state) = self.state(common_address) else { return };
        state.catch_up = state.catch_up.and_then(|round| round.next_round(is_answered));
    }

    /// Judges the order of an event; `time` is what its tag resolves to.
    pub(crate) fn order_of(
        &mut self,
        common_address: u16,
        point: usize,
        tag: TimeTag,
        time: Option<SystemTime>,
    ) -> EventOrder {
        let is_present = self.is_present(point);
        let newest = self.newest_events.get(point).copied().flatten();
        let state = self.state(common_address);
        let Some(catch_up) = state.and_then(|state| state.catch_up.as_mut()) else {
            return EventOrder::Arrival;
        };
        let is_older = newest.zip(time).is_some_and(|(newest, time)| time < newest);
        if !is_present && !is_older {
            // A buffer is sent in order.
            if let Some(own) = self.newest_events.get_mut(point) {
                *own = time.or(newest);
            }
            return EventOrder::Arrival;
        }
        let is_of_now = match tag {
            // The hour is not in it.
            TimeTag::Cp24(_) => false,
            TimeTag::Cp56(_) => time.is_some_and(|time| time >= catch_up.started + CLOCK_TOLERANCE),
        };
        if is_of_now && !is_older {
            return EventOrder::Arrival;
        }
        catch_up.is_doubted = true;
        let is_long = matches!(tag, TimeTag::Cp56(_));
        let is_before_start = is_long && time.is_some_and(|time| time < catch_up.started);
        EventOrder::Doubtful { is_before_start }
    }

    fn set(&mut self, common_address: u16, point: usize, by: Evidence) {
        let Some(evidence) = self.evidence.get_mut(point) else { return };
        let before = std::mem::replace(evidence, by);
        if by == Evidence::None
            && let Some(newest) = self.newest_events.get_mut(point)
        {
            *newest = None;
        }
        let Some(state) = self.state(common_address) else { return };
        match (before, by) {
            (Evidence::None, Evidence::None) => {}
            (Evidence::None, _) => state.valued += 1,
            (_, Evidence::None) => state.valued -= 1,
            _ => {}
        }
    }

    fn state(&mut self, common_address: u16) -> Option<&mut AddressState> {
        let found = self.addresses.binary_search_by_key(&common_address, |s| s.common_address);
        found.ok().and_then(|index| self.addresses.get_mut(index))
    }
}

impl CatchUp {
    fn new(started: SystemTime) -> Self {
        Self { started, rounds_left: CATCH_UP_ROUNDS, is_doubted: false }
    }

    /// The next round, if the buffer may still come.
    fn next_round(self, is_answered: bool) -> Option<Self> {
        let rounds_left = self.rounds_left.saturating_sub(1);
        let may_come = self.is_doubted || !is_answered;
        (may_come && rounds_left > 0).then_some(Self { rounds_left, is_doubted: false, ..self })
    }
}
