//! Chart, records and alarms of the well-behaved plugin.

use busbar_plugin_sdk::{
    AlarmReport, Alarms, Chart, ChartAxis, ChartDescription, ChartRecord, ChartRecords, ChartState,
    DefectSeverity, Error, Explanation, LinkState, MAX_SOURCE_ALARMS, NotificationBatch,
    NotificationReport, Notify, Pattern, Record, RecordColumn, RecordKind, RecordList, RecordSet,
    Records, SourceAlarm,
};

use crate::fault::{CallSite, Misbehavior};
use crate::injection::inject;
use crate::plugin::FaultInjector;

/// Equipment of all records and alarms.
const EQUIPMENT: &str = "=Q1";
const REVISION: u64 = 1;
const RECORDS: [ChartRecord; 2] = [
    ChartRecord { unix_nanos: 1, equipment: 0, state: 0 },
    ChartRecord { unix_nanos: 2, equipment: 0, state: 0 },
];
/// Values of the records, two axes each.
const VALUES: [f32; 4] = [1.0, 2.0, f32::NAN, 4.0];

impl Chart for FaultInjector {
    fn describe_chart(&mut self) -> Result<ChartDescription, Error> {
        inject(CallSite::DescribeChart);
        let axis = |name: &str| ChartAxis {
            name: name.into(),
            low: 0.0,
            high: 10.0,
            ..ChartAxis::default()
        };
        let state = ChartState {
            name: "normal".into(),
            color: [128; 3],
            pattern: Pattern::Solid,
            is_abnormal: false,
        };
        Ok(ChartDescription {
            name: "Of no use".into(),
            axes: vec![axis("One"), axis("Two")],
            legend: vec![state],
            equipment: vec![EQUIPMENT.into()],
            valid_seconds: 1,
        })
    }

    fn chart_records(&mut self) -> Result<ChartRecords<'_>, Error> {
        inject(CallSite::ReadChart);
        Ok(ChartRecords { revision: REVISION, records: &RECORDS, values: &VALUES })
    }

    fn explain(&mut self, equipment: &str, unix_nanos: i64) -> Result<Explanation, Error> {
        inject(CallSite::Explain);
        let known = RECORDS.iter().rfind(|record| record.unix_nanos <= unix_nanos);
        match known.filter(|_| equipment == EQUIPMENT) {
            Some(record) => Ok(Explanation {
                unix_nanos: record.unix_nanos,
                verdict: "nothing is the matter".into(),
                ..Explanation::default()
            }),
            None => Err(Error::failed(format!("there is no record of '{equipment}' then"))),
        }
    }
}

/// Returns one list, whose calls inject faults where its table is.
pub(crate) fn lists() -> Vec<RecordList> {
    let row = |cell: &str| Record {
        equipment: EQUIPMENT.into(),
        cells: vec![cell.into()],
        unix_nanos: Some(1),
        severity: Some(DefectSeverity::General),
        is_open: true,
    };
    vec![RecordList {
        title: "Work orders".into(),
        kind: RecordKind::Business,
        source: "nowhere".into(),
        columns: vec![RecordColumn { name: "Text".into(), ..RecordColumn::default() }],
        as_of_unix_nanos: Some(1),
        rows: vec![row("one"), row("two")],
        ..RecordList::default()
    }]
}

impl Records for FaultInjector {
    fn records(&mut self) -> Result<RecordSet<'_>, Error> {
        Ok(RecordSet { revision: REVISION, lists: &self.lists })
    }
}

impl Alarms for FaultInjector {
    fn alarms(&mut self, _known_revision: u64) -> Result<AlarmReport, Error> {
        let kind = inject(CallSite::ReadAlarms);
        let alarm = |id: &str| SourceAlarm {
            id: id.into(),
            source: "=Q1".into(),
            message: "Oil hot".into(),
            severity: if kind == Some(Misbehavior::OutOfRange) { u16::MAX } else { 700 },
            is_active: true,
            unix_nanos: Some(1),
            ..SourceAlarm::default()
        };
        let count = if kind == Some(Misbehavior::Flood) { MAX_SOURCE_ALARMS + 1 } else { 2 };
        Ok(AlarmReport {
            revision: REVISION,
            heard_millis: Some(0),
            alarms: Some((0..count).map(|number| alarm(&number.to_string())).collect()),
            ..AlarmReport::default()
        })
    }
}

impl Notify for FaultInjector {
    fn notify(&mut self, batch: NotificationBatch) -> Result<NotificationReport, Error> {
        let kind = inject(CallSite::Notify);
        let taken = if kind == Some(Misbehavior::OutOfRange) { u64::MAX } else { batch.handed };
        Ok(NotificationReport {
            taken,
            delivery: LinkState::Up,
            message: "Nothing waits".into(),
            waiting: 0,
            undelivered: 0,
        })
    }
}
