//! Check of one log file: its lines, the links of its hash chain, and every fault of either.

use busbar_alarms::AlarmRecord;
use busbar_types::AlarmState;

use crate::chain::{Digest256, KeyRing};
use crate::file_header::FileHeader;
use crate::line::{self, Line, ReadLine};
use crate::{MAX_TAIL, RecoveredLog};

/// Lines of a kind that are named by their numbers.
const MAX_PLACES: usize = 10;

/// Lines of one kind: how many, and where the first of them are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct LinePlaces {
    pub(crate) count: u64,
    first: Vec<u64>,
}

impl LinePlaces {
    fn add(&mut self, line: u64) {
        self.count += 1;
        if self.first.len() < MAX_PLACES {
            self.first.push(line);
        }
    }

    /// Names the lines: "line 3", "lines 3, 7 and 12 more".
    pub(crate) fn shown(&self) -> String {
        let first: Vec<_> = self.first.iter().map(u64::to_string).collect();
        let more = self.count - self.first.len() as u64;
        let lines = if self.count == 1 { "line" } else { "lines" };
        match more {
            0 => format!("{lines} {}", first.join(", ")),
            more => format!("{lines} {} and {more} more", first.join(", ")),
        }
    }
}

/// Content of one file, as far as it can be understood.
#[derive(Debug, Default)]
pub(crate) struct CheckedFile {
    pub(crate) header: Option<FileHeader>,
    /// True where the reader has the key of its chain.
    pub(crate) is_checked: bool,
    pub(crate) bytes: u64,
    /// Bytes up to the end of the last line that is whole.
    pub(crate) whole_bytes: u64,
    /// Chain value after the last whole line, if that has one.
    pub(crate) chain: Option<Digest256>,
    pub(crate) carried: u64,
    pub(crate) news: u64,
    /// Greatest number of a carried record.
    pub(crate) newest_carried: u64,
    pub(crate) first_news: Option<u64>,
    /// Greatest number of all; that of the header included.
    pub(crate) last_number: u64,
    /// Ranges of numbers that no line has: the first, the last.
    pub(crate) gaps: Vec<[u64; 2]>,
    pub(crate) missing: u64,
    pub(crate) damaged: LinePlaces,
    /// Lines of a newer release.
    pub(crate) newer: LinePlaces,
    /// Lines whose chain value does not follow from that of the line before.
    pub(crate) unlinked: LinePlaces,
    /// Lines without chain value in a file that has a chain.
    pub(crate) unchained: LinePlaces,
    /// First line with a chain value.
    pub(crate) first_chained: Option<u64>,
    /// True where a line has the chain value that was searched for.
    pub(crate) has_wanted: bool,
}

impl CheckedFile {
    /// Reads the bytes of a file into the recovered state. Bytes after its last whole line were
    /// cut short by a crash.
    pub(crate) fn read(
        bytes: &[u8],
        keys: &KeyRing,
        wanted: Option<&Digest256>,
        found: &mut RecoveredLog,
    ) -> Self {
        let mut reading = Self { bytes: bytes.len() as u64, ..Self::default() };
        let mut before = Some(Digest256::default());
        let (mut start, mut damaged) = (0, Vec::new());
        for (index, line) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
            let number = index as u64 + 1;
            let end = start + line.len();
            match line.strip_suffix(b"\n").map(line::read) {
                Some(Some(line)) => {
                    // Whole lines after them make them damage; else a crash cut them short.
                    damaged.drain(..).for_each(|number| reading.damaged.add(number));
                    reading.take(number, line, &mut before, keys, wanted, found);
                    (reading.whole_bytes, reading.chain) = (end as u64, before);
                }
                Some(None) => {
                    damaged.push(number);
                    before = None;
                }
                None => {}
            }
            start = end;
        }
        found.last_number = found.last_number.max(reading.last_number);
        reading
    }

    fn take(
        &mut self,
        number: u64,
        line: ReadLine<'_>,
        before: &mut Option<Digest256>,
        keys: &KeyRing,
        wanted: Option<&Digest256>,
        found: &mut RecoveredLog,
    ) {
        let ReadLine { content, link } = line;
        let is_first_header = number == 1 && matches!(content, Line::Header(_));
        if let (true, Line::Header(header)) = (is_first_header, &content) {
            self.header = Some((**header).clone());
        }
        match link {
            Some(link) => {
                self.first_chained.get_or_insert(number);
                let id = self.header.as_ref().map(|header| header.key.as_str());
                let key = id.and_then(|id| keys.find(id));
                self.is_checked |= is_first_header && key.is_some();
                // After damage the chain is taken up as it is found.
                let is_link = key.zip(*before).is_none_or(|(key, value)| link.follows(&value, key));
                let is_in_place = is_first_header == matches!(content, Line::Header(_));
                if !is_link || !is_in_place {
                    self.unlinked.add(number);
                }
                self.has_wanted |= is_link && wanted == Some(&link.value);
                *before = Some(link.value);
            }
            None => {
                if self.first_chained.is_some() && !matches!(content, Line::Newer { .. }) {
                    self.unchained.add(number);
                }
                *before = None;
            }
        }
        match content {
            Line::Header(header) => self.last_number = self.last_number.max(header.after),
            Line::Newer { number: of_record } => {
                self.newer.add(number);
                self.last_number = self.last_number.max(of_record.unwrap_or(0));
            }
            Line::Anchor(_) => self.unlinked.add(number),
            Line::Carried(record) => {
                self.carried += 1;
                self.newest_carried = self.newest_carried.max(record.number);
                self.last_number = self.last_number.max(record.number);
                stand(&record, found);
            }
            Line::News(record) => {
                self.follow(record.number);
                self.news += 1;
                stand(&record, found);
                if found.tail.len() == MAX_TAIL {
                    found.tail.pop_front();
                }
                found.tail.push_back(record);
            }
        }
    }

    /// Records the number of a record, and missing ones before it.
    fn follow(&mut self, number: u64) {
        self.first_news.get_or_insert(number);
        let is_begun = self.last_number > 0 || self.header.is_some();
        let next = self.last_number + 1;
        if is_begun && number > next {
            self.missing += number - next;
            if self.gaps.len() < MAX_PLACES {
                self.gaps.push([next, number - 1]);
            }
        }
        self.last_number = self.last_number.max(number);
    }

    /// Bytes after the last whole line.
    pub(crate) fn torn_bytes(&self) -> u64 {
        self.bytes - self.whole_bytes
    }

    /// Reports whether its beginning alone gives the state of all alarms.
    pub(crate) fn is_complete(&self) -> bool {
        match &self.header {
            Some(header) => self.carried >= header.carried,
            // Of an older release.
            None => self.whole_bytes > 0 && self.damaged.count == 0,
        }
    }

    /// Reports whether lines of it are damaged or not the log's own, so that it is quarantined.
    pub(crate) fn is_faulty(&self) -> bool {
        let kinds = [&self.damaged, &self.unlinked, &self.unchained];
        kinds.into_iter().any(|places| places.count > 0)
    }

    /// Reports whether the next line may follow in the same file.
    pub(crate) fn may_go_on(&self) -> bool {
        let is_whole = self.torn_bytes() == 0 && !self.is_faulty() && self.newer.count == 0;
        is_whole && self.is_checked && self.is_complete() && self.chain.is_some()
    }

    /// Faults of the file, for people.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        let torn = self.torn_bytes();
        if torn > 0 {
            remarks.push(format!("{torn} bytes at its end were cut short and are kept aside"));
        }
        let kinds = [
            (&self.damaged, "damaged lines in it are passed over and kept"),
            (&self.newer, "lines in it are of a newer release: they are kept, not understood"),
            (
                &self.unlinked,
                "lines in it do not follow from those before: lines were changed, \
              removed or reordered",
            ),
            (
                &self.unchained,
                "lines in it have no chain value, after some that have one: an \
              older release wrote them, or somebody else",
            ),
        ];
        for (places, cause) in kinds.into_iter().filter(|(places, _)| places.count > 0) {
            remarks.push(format!("{} {cause} ({})", places.count, places.shown()));
        }
        if self.missing > 0 {
            remarks.push(format!("{} records in it are missing", self.missing));
        }
        remarks
    }
}

/// Records the state of an alarm after a record.
fn stand(record: &AlarmRecord, found: &mut RecoveredLog) {
    if record.to == AlarmState::Normal {
        found.open.remove(&record.alarm);
    } else {
        found.open.insert(record.alarm.clone(), record.clone());
    }
}
