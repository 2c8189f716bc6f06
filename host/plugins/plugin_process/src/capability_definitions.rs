//! Capabilities whose calls are a question and an answer, each defined once: the handle that is the
//! same wherever the plugin runs, the messages between processes and the plugin's end come from
//! here.

/// Hands the definitions to a macro. A line of a call has the method of the handle and of
/// `busbar_plugin_host`, its arguments and answer, the name of its messages, its name for people,
/// the check of an answer from another process, and the arguments whose answers may be the longest,
/// for tests of answers without a request.
macro_rules! capability_definitions {
    ($define:ident) => {
        $define! {
            /// Chart of a plugin. Calls take as long as the plugin takes: not for frames.
            RunningChart = Chart, CHART_ID {
                /// Describes the chart of the plugin.
                describe() -> busbar_chart::Description,
                    DescribeChart "describe chart", |description| description.check(), any {};
                /// Reads at most `count` records from `first` on, of a chart with so many axes.
                /// With `count` 0 the page has the total and the revision alone.
                read(axes: u32, first: u64, count: u32) -> ChartPage,
                    ReadChart "read chart", |page| page.check(axes, count),
                    any { axes: busbar_chart::MAX_AXES as u32, count: MAX_PAGE_RECORDS };
                /// Explains the last record of a piece of equipment at or before an instant
                /// (nanoseconds since 1970-01-01 UTC). States are not checked against a legend yet.
                explain(equipment: String, unix_nanos: i64) -> busbar_chart::Explanation,
                    Explain "explain", |explanation| explanation.check(usize::MAX), any {};
            }
            /// Records of a plugin. Calls take as long as the plugin takes: not for frames.
            RunningRecords = Records, RECORDS_ID {
                /// Describes the lists of records of the plugin.
                describe() -> busbar_records::Description,
                    DescribeRecords "describe records", |description| description.check(), any {};
                /// Reads at most `count` rows from `first` on, of a list with so many columns. With
                /// `count` 0 the page has the revision alone, of any list.
                read(list: u32, columns: u32, first: u64, count: u32) -> RecordPage,
                    ReadRecords "read records", |page| page.check(columns, count),
                    any {
                        columns: page.rows.first().map_or(0, |row| row.cells.len()) as u32,
                        count: MAX_PAGE_ROWS
                    };
            }
            /// Alarms of a plugin. Calls take as long as the plugin takes: not for frames.
            RunningAlarms = Alarms, ALARMS_ID {
                /// Reads the state of all alarms. A report of the revision `known` (0 for none) has
                /// no alarms.
                read(known: u64) -> SourceReport,
                    ReadAlarms "read alarms", |report| report.check(known),
                    any { known: report.revision };
            }
            /// Plugin that tells people of alarms. Calls take as long as the plugin takes: not for
            /// frames.
            RunningNotifier = Notifier, NOTIFY_ID {
                /// Hands over changes of alarms and returns the plugin's report.
                notify(batch: NotificationBatch) -> NotificationReport,
                    Notify "notify", |report| report.check(batch.handed),
                    any { batch: NotificationBatch { handed: report.taken, ..Default::default() } };
            }
        }
    };
}

pub(crate) use capability_definitions;
