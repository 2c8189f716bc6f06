//! Tests of the plugin against a server of their own.

use std::io::Write;
use std::net::TcpListener;

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Quality, Value, ValueKind};

use super::*;

const LIMIT: Duration = Duration::from_secs(5);

fn started(address: String, recorder: &Recorder) -> MyPlugin {
    let mut plugin = MyPlugin::create(Settings { address }, host()).unwrap();
    let tags = [
        tag_spec(1, "Oil", ValueKind::F64, "oil".into()),
        tag_spec(2, "Alarm", ValueKind::Bool, "alarm".into()),
    ];
    plugin.start(tags.to_vec(), recorder.sink()).unwrap();
    plugin
}

#[test]
fn lines_become_samples() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let recorder = Recorder::new();
    let mut plugin = started(listener.local_addr().unwrap().to_string(), &recorder);
    let (mut client, _) = listener.accept().unwrap();
    client.write_all(b"oil 61.5\nnobody 1\nnonsense\nalarm 1\nalarm maybe\n").unwrap();
    let bad = Sample::bad(2, Reason::Configuration);
    assert!(recorder.wait_until(LIMIT, |seen| seen.latest(2).as_ref() == Some(&bad)));
    assert_eq!(recorder.latest(1), Some(Sample::good(1, Value::F64(61.5))));
    let samples = recorder.recording().samples;
    assert!(samples.contains(&Sample::good(2, Value::Bool(true))));
    plugin.stop();
}

#[test]
fn a_lost_connection_makes_every_tag_bad() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let recorder = Recorder::new();
    let mut plugin = started(listener.local_addr().unwrap().to_string(), &recorder);
    drop(listener.accept().unwrap());
    let lost = Quality::Bad(Reason::Communication);
    let is_lost = |sample: Option<Sample>| sample.is_some_and(|sample| sample.quality == lost);
    assert!(recorder.wait_until(LIMIT, |seen| [1, 2].iter().all(|&tag| is_lost(seen.latest(tag)))));
    plugin.stop();
}

#[test]
fn an_address_that_is_no_name_is_refused() {
    let plugin = MyPlugin::create(Settings { address: String::new() }, host()).unwrap();
    let fault = plugin.check(&[tag_spec(1, "Oil", ValueKind::F64, 7.into())]).unwrap_err();
    assert!(fault.message().contains("Oil"), "{fault}");
}
