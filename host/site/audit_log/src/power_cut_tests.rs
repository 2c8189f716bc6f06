//! Power cuts: every prefix of the operations on a disk is replayed, with what was not synced
//! cut, torn and in any order.

use std::collections::{BTreeMap, BTreeSet};

use busbar_alarms::AlarmRecord;
use busbar_types::AlarmState;
use fastrand::Rng;

use crate::RecoveredLog;
use crate::anchor::{Anchor, AnchorState};
use crate::chain::{ChainKey, KeyRing};
use crate::file_names::{CURRENT, SCRATCH};
use crate::log_writer::tests::record;
use crate::log_writer::{FileRules, LogWriter};
use crate::memory_storage::{CrashOrder, MemoryStorage, Operation};
use crate::probe;
use crate::verification::verify_storage;

/// Workloads in a test run; `BUSBAR_LOG_POWER_CUTS` says otherwise.
const WORKLOADS: u64 = 12;
const WORKLOADS_VARIABLE: &str = "BUSBAR_LOG_POWER_CUTS";
const RULES: FileRules = FileRules { max_file_bytes: 2_500, max_files: 1_000 };
const ALARMS: u64 = 5;

fn keys() -> KeyRing {
    KeyRing::new(Some(ChainKey::new(b"a key of some length")))
}

fn state(anchor: Option<&Anchor>) -> AnchorState {
    anchor.map_or(AnchorState::Absent, |anchor| AnchorState::Found(anchor.clone()))
}

fn random_record(number: u64, random: &mut Rng) -> AlarmRecord {
    let to = if random.bool() { AlarmState::Unacknowledged } else { AlarmState::Normal };
    record(number, &random.u64(..ALARMS).to_string(), to)
}

/// Sessions that append; the files before, all operations, and all records.
fn workload(random: &mut Rng) -> (BTreeMap<String, Vec<u8>>, Vec<Operation>, Vec<AlarmRecord>) {
    let mut records: Vec<AlarmRecord> = Vec::new();
    let mut before = BTreeMap::new();
    if random.u32(..3) == 0 {
        // A log of a release without chain.
        let line =
            |record: &AlarmRecord| probe::signed(&serde_json::to_vec(record).unwrap(), false);
        records.extend((1..=random.u64(1..10)).map(|number| random_record(number, random)));
        before.insert(CURRENT.to_owned(), records.iter().map(line).collect::<Vec<_>>().concat());
    }
    let storage = MemoryStorage::with_files(&before);
    let mut anchor: Option<Anchor> = None;
    for _ in 0..random.u32(1..4) {
        let boxed = Box::new(storage.clone());
        let (mut writer, found) =
            LogWriter::with_storage(boxed, RULES, keys(), &state(anchor.as_ref())).unwrap();
        assert_eq!(found.remarks, Vec::<String>::new());
        for _ in 0..random.u32(1..8) {
            if random.u32(..6) == 0 {
                storage.fail_syncs(1);
            }
            let first = records.len() as u64 + 1;
            let batch: Vec<_> = (first..first + random.u64(1..5))
                .map(|number| random_record(number, random))
                .collect();
            records.extend(batch.clone());
            writer.stage(batch);
            while writer.write_staged().is_err() {}
            anchor = writer.anchor();
            writer.confirm_anchor();
            storage.claim(records.len() as u64, anchor.clone().unwrap());
        }
    }
    (before, storage.operations(), records)
}

fn logged(files: &BTreeMap<String, Vec<u8>>) -> BTreeSet<u64> {
    let mut numbers = BTreeSet::new();
    for line in files.values().flat_map(|bytes| bytes.split(|byte| *byte == b'\n')) {
        if let Some(crate::line::Line::News(record)) = crate::line::read(line).map(|l| l.content) {
            numbers.insert(record.number);
        }
    }
    numbers
}

fn open_after(records: &[AlarmRecord]) -> BTreeMap<String, AlarmRecord> {
    let mut open = BTreeMap::new();
    records.iter().for_each(|record| drop(open.insert(record.alarm.clone(), record.clone())));
    open.retain(|_, record| record.to != AlarmState::Normal);
    open
}

#[track_caller]
fn check_kept(before: &BTreeMap<String, Vec<u8>>, after: &BTreeMap<String, Vec<u8>>, told: &str) {
    for (name, bytes) in before {
        let is_kept = after.values().any(|kept| kept.starts_with(bytes));
        assert!(is_kept, "{told}: bytes of {name} are destroyed");
    }
}

#[test]
fn nothing_that_was_synced_is_lost_in_a_power_cut_and_nothing_is_destroyed() {
    let count = std::env::var(WORKLOADS_VARIABLE).ok().and_then(|n| n.parse().ok());
    let (mut cuts, mut torn) = (0, 0);
    for seed in 0..count.unwrap_or(WORKLOADS) {
        let mut random = Rng::with_seed(seed);
        let (files, operations, records) = workload(&mut random);
        for prefix in 0..=operations.len() {
            for order in [CrashOrder::Sequential, CrashOrder::Reordered] {
                let made = &operations[..prefix];
                let storage = MemoryStorage::after_power_cut(&files, made, order, &mut random);
                let told = format!("seed {seed}, {prefix} operations, {order:?}");
                torn += u32::from(check_cut(&storage, made, &files, &records, order, &told));
                cuts += 1;
            }
        }
    }
    assert!(torn > cuts / 20, "only {torn} of {cuts} cuts tear a line");
    println!("{cuts} power cuts, {torn} with a line cut short");
}

/// Checks a log after a power cut; whether a line was cut short.
fn check_cut(
    storage: &MemoryStorage,
    made: &[Operation],
    old: &BTreeMap<String, Vec<u8>>,
    records: &[AlarmRecord],
    order: CrashOrder,
    told: &str,
) -> bool {
    let claims: Vec<_> = made
        .iter()
        .filter_map(|operation| match operation {
            Operation::Claim { number, anchor } => Some((*number, anchor)),
            _ => None,
        })
        .collect();
    let claimed = claims.last().map_or(0, |(number, _)| *number);
    let anchor = state(claims.last().map(|(_, anchor)| *anchor));
    let before = storage.files();
    check_kept(old, &before, told);
    let present = logged(&before);
    assert!((1..=claimed).all(|number| present.contains(&number)), "{told}: a claim is lost");

    // Without a claim there is no anchor yet.
    let of_verify = if claims.is_empty() { &AnchorState::Unused } else { &anchor };
    if let Some(verified) = verify_storage(storage, &keys(), of_verify).unwrap() {
        let has_current = before.contains_key(CURRENT);
        let counts = |name: &String| name != SCRATCH || !has_current;
        let is_begun = before.iter().any(|(name, bytes)| {
            counts(name) && bytes.get(16) == Some(&b'#') && bytes.contains(&b'\n')
        });
        let is_excused = |fault: &String| match order {
            // No line of the chain has reached the disk.
            _ if !is_begun => fault.contains("not under this key"),
            CrashOrder::Sequential => false,
            CrashOrder::Reordered => fault.starts_with(CURRENT) || fault.starts_with(SCRATCH),
        };
        let odd = verified.faults.iter().find(|fault| !is_excused(fault));
        assert_eq!(odd, None, "{told}: {:?}", before.keys());
    }

    let (mut writer, found) =
        LogWriter::with_storage(Box::new(storage.clone()), RULES, keys(), &anchor).unwrap();
    let RecoveredLog { open, last_number, remarks, .. } = found;
    assert!(last_number >= claimed, "{told}: numbers go back");
    let is_torn = remarks.iter().any(|remark| remark.contains("cut short"));
    let is_damaged = remarks.iter().any(|remark| remark.contains("damaged"));
    if !is_damaged {
        assert_eq!(open, open_after(&records[..last_number as usize]), "{told}");
    }
    if order == CrashOrder::Sequential {
        let odd = remarks.iter().find(|remark| !remark.contains("cut short"));
        assert_eq!(odd, None, "{told}: {:?}", before.keys());
    }
    check_kept(&before, &storage.files(), told);
    writer.stage(vec![record(last_number + 1, "after", AlarmState::Unacknowledged)]);
    writer.write_staged().unwrap();
    check_kept(&before, &storage.files(), told);
    let anchor = AnchorState::Found(writer.anchor().unwrap());
    drop(writer);
    let verified = verify_storage(storage, &keys(), &anchor).unwrap().unwrap();
    assert_eq!(verified.newest, last_number + 1);
    if order == CrashOrder::Sequential {
        assert_eq!(verified.faults, Vec::<String>::new(), "{told}: {:?}", storage.files().keys());
    }
    is_torn
}
