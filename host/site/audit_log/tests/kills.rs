//! A process that walks alarms and says which records are durable is killed at random
//! instants; afterwards every one of them must be in its log.
//!
//! `kill -9` ends the process, not the machine: that what was synced outlives a power cut
//! is the file system's promise, and not tested here.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use busbar_alarms::{
    AlarmHandle, AlarmRecord, AlarmSet, AlarmSource, AlarmSpec, AlarmTable, Condition, TagCondition,
};
use busbar_audit_log::{AuditLog, AuditLogOptions, verify};
use busbar_tags::{Moment, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagTable};
use busbar_types::{AlarmAction, AlarmState, Priority, Quality, Value, ValueKind};
use fastrand::Rng;

/// Kills in a test run; `BUSBAR_ALARM_KILLS` says otherwise.
const KILLS: usize = 20;
const KILLS_VARIABLE: &str = "BUSBAR_ALARM_KILLS";
/// Environment variable with the log folder of the process that is killed.
const FOLDER_VARIABLE: &str = "BUSBAR_ALARM_LOG";
/// Before each record that it says is durable.
const CLAIM: &str = "durable ";
/// The longest that it lives, from its start or its first claim, milliseconds.
const MAX_LIFE_MILLIS: u64 = 100;
const MAX_START: Duration = Duration::from_secs(60);
const ALARMS: u32 = 40;

fn rules(folder: &Path) -> AuditLogOptions {
    AuditLogOptions {
        directory: folder.join("log"),
        // Small enough that some kills come while a new file is begun; none goes.
        max_file_bytes: 20_000,
        max_files: 100_000,
        key_file: Some(folder.join("key")),
        anchor_file: Some(folder.join("anchor")),
    }
}

fn tables(now: Moment) -> (TagTable, AlarmTable) {
    let tag = |index| TagSpec {
        id: format!("{index}"),
        name: String::new(),
        kind: ValueKind::Bool,
        unit: String::new(),
        range: None,
        freshness: Duration::from_secs(60),
        scale: None,
        dead_band: 0.0,
        expression: None,
    };
    let tags = Arc::new(TagSet::new((0..ALARMS).map(tag).collect()).expect("they can be"));
    let condition = Condition::Equals(Value::Bool(true));
    let alarm = |index: u32| AlarmSpec {
        id: format!("alarm {index}"),
        message: String::new(),
        consequence: String::new(),
        response: String::new(),
        equipment: None,
        priority: Priority::High,
        latched: index.is_multiple_of(3),
        group: None,
        source: AlarmSource::Tag {
            trigger: TagCondition { tag: TagHandle(index), condition: condition.clone() },
            on_delay: Duration::ZERO,
            off_delay: Duration::ZERO,
            suppressed_by: None,
        },
    };
    let alarms = AlarmSet::new((0..ALARMS).map(alarm).collect(), &tags).expect("they can be");
    let table = AlarmTable::new(Arc::new(alarms), Duration::from_secs(3600), now);
    (TagTable::new(tags, now), table)
}

/// Body of the killed process: run by the test below, in a process of its own.
#[test]
#[ignore = "run by its_claims_outlive_a_process_that_is_killed"]
fn walk_until_killed() {
    let Some(folder) = std::env::var_os(FOLDER_VARIABLE) else { return };
    let (mut log, found) = AuditLog::open(rules(Path::new(&folder))).expect("the log opens");
    let mut now = Moment::now();
    let (mut tags, mut alarms) = tables(now);
    let standings = found.open.values().map(|r| (r.alarm.as_str(), r.standing, r.time));
    alarms.restore(standings, found.last_number, SourceTime(now.0 as i64));
    let mut dice = Rng::new();
    let (mut unclaimed, mut out) = (Vec::<AlarmRecord>::new(), std::io::stdout().lock());
    let end = Instant::now() + Duration::from_secs(60);
    while Instant::now() < end {
        now = Moment::now();
        for _ in 0..dice.u32(..8) {
            let (tag, value) = (TagHandle(dice.u32(..ALARMS)), Some(Value::Bool(dice.bool())));
            let sample = Sample::live(tag, value, Quality::Good, now);
            tags.apply(&sample, |change| alarms.note(change));
        }
        tags.advance(now, |_| {});
        let mut take = |record: AlarmRecord| {
            log.append(record.clone());
            unclaimed.push(record);
        };
        alarms.step(tags.snapshot(), now, SourceTime(now.0 as i64), &mut take);
        let shelf = Duration::from_millis(dice.u64(1..100));
        let actions = [
            AlarmAction::Acknowledge,
            AlarmAction::Reset,
            AlarmAction::Shelve(shelf),
            AlarmAction::Unshelve,
        ];
        let service = [AlarmAction::RemoveFromService, AlarmAction::ReturnToService];
        let action =
            if dice.u32(..8) == 0 { service[dice.usize(..2)] } else { actions[dice.usize(..4)] };
        if let Ok(record) = alarms.perform(AlarmHandle(dice.u32(..ALARMS)), action, "walker") {
            take(record);
        }
        log.flush();
        let durable = log.durable();
        let claimed = unclaimed.partition_point(|record| record.number <= durable);
        for record in unclaimed.drain(..claimed) {
            let json = serde_json::to_string(&record).expect("it is JSON");
            writeln!(out, "{CLAIM}{json}").expect("somebody reads");
        }
        out.flush().expect("somebody reads");
    }
}

/// Kills it so long after its start, or after its first claim; the records that it said
/// were durable.
fn claims_of_a_life(folder: &Path, life: Duration, after_a_claim: bool) -> Vec<AlarmRecord> {
    let program = std::env::current_exe().expect("a test has a path");
    let mut child = Command::new(program)
        .args(["--exact", "walk_until_killed", "--ignored", "--nocapture"])
        .env(FOLDER_VARIABLE, folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the test can start itself");
    let output = child.stdout.take().expect("it is piped");
    let (told, claims) = channel();
    let reader = std::thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            // The harness writes into its first line; the last one may be half.
            let json = line.split_once(CLAIM).map(|(_, json)| json);
            let claim: Option<AlarmRecord> = json.and_then(|json| serde_json::from_str(json).ok());
            claim.into_iter().for_each(|claim| told.send(claim).expect("somebody listens"));
        }
    });
    let mut found = Vec::new();
    if after_a_claim {
        found.push(claims.recv_timeout(MAX_START).expect("it claims something"));
    }
    std::thread::sleep(life);
    child.kill().expect("it runs");
    child.wait().expect("it was started");
    reader.join().expect("reading does not panic");
    found.extend(claims);
    found
}

/// All records of all files, by number.
fn logged(folder: &Path) -> BTreeMap<u64, AlarmRecord> {
    let mut records = BTreeMap::new();
    for file in std::fs::read_dir(folder).expect("the log is there").flatten() {
        let text = std::fs::read_to_string(file.path()).unwrap_or_default();
        for line in text.split_inclusive('\n').filter(|line| line.ends_with('\n')) {
            let json = &line[line.find(['{']).unwrap_or(0)..];
            if let Ok(record) = serde_json::from_str::<AlarmRecord>(json) {
                records.insert(record.number, record);
            }
        }
    }
    records
}

#[test]
fn its_claims_outlive_a_process_that_is_killed() {
    let kills = std::env::var(KILLS_VARIABLE).ok().and_then(|n| n.parse().ok()).unwrap_or(KILLS);
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    std::fs::write(folder.path().join("key"), [7; 32]).expect("it can be written");
    let mut dice = Rng::new();
    let (mut claimed, mut torn, mut newest) = (0, 0, 0);
    for kill in 0..kills {
        let life = Duration::from_micros(dice.u64(..MAX_LIFE_MILLIS * 1000));
        // Some are killed while they read what the one before left.
        let claims = claims_of_a_life(folder.path(), life, dice.u32(..5) > 0);
        let rules = rules(folder.path());
        let [key, anchor] = [&rules.key_file, &rules.anchor_file].map(|path| path.as_deref());
        if let Some(anchor) = anchor.filter(|anchor| anchor.exists()) {
            let verified = verify(&rules.directory, key, Some(anchor)).expect("it can be read");
            assert_eq!(verified.faults, Vec::<String>::new(), "kill {kill}: a false alarm");
        }
        let (log, found) = AuditLog::open(rules.clone()).expect("the log opens");
        drop(log);
        let verified = verify(&rules.directory, key, anchor).expect("it can be read");
        assert_eq!(verified.faults, Vec::<String>::new(), "kill {kill}: a false alarm");
        assert_eq!(verified.newest, found.last_number, "kill {kill}");
        torn += found.remarks.iter().filter(|remark| remark.contains("cut short")).count();
        let odd = found.remarks.iter().find(|remark| !remark.contains("cut short"));
        assert_eq!(odd, None, "kill {kill}");
        let records = logged(&rules.directory);
        for claim in &claims {
            assert_eq!(records.get(&claim.number), Some(claim), "kill {kill}: a claim is lost");
        }
        assert!(found.last_number >= newest, "kill {kill}: numbers go back");
        newest = found.last_number;
        assert!(records.keys().copied().eq(1..=newest), "kill {kill}: records are missing");
        // How alarms stand is what the last record of each says.
        let mut open = BTreeMap::new();
        records.into_values().for_each(|record| drop(open.insert(record.alarm.clone(), record)));
        open.retain(|_, record| record.to != AlarmState::Normal);
        assert_eq!(found.open, open, "kill {kill}");
        claimed += claims.len();
    }
    assert!(claimed > kills, "only {claimed} claims in {kills} lives");
    println!("{kills} kills, {claimed} records claimed and found, {torn} lines cut short");
}
