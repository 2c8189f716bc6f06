//! Settings and their schema.

use busbar_plugin_abi as abi;
use serde_json::{Value, json};

use super::plugin_instance::required;
use crate::finding::{Finding, Outcome, skip};
use crate::probe::{Probe, Subject};
use crate::schema as made_up;
use crate::text;

pub(crate) fn schema(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let Some(schema) = schema_of(probe, &subject)? else {
        return skip(
            "the plugin gives no settings schema, so that a host cannot tell users what is wrong",
        );
    };
    let validator = jsonschema::validator_for(&schema).map_err(|error| {
        let fault = format!("the settings schema is no JSON Schema: {error}");
        Finding::new(fault, "correct it; draft 2020-12 is expected")
    })?;
    for value in [json!([]), json!(1), json!("text"), Value::Null] {
        let fault = format!("the settings schema accepts {value}, which is no object");
        probe.expect(!validator.is_valid(&value), fault, "write \"type\": \"object\" into it");
    }
    let settings: Value = serde_json::from_str(&subject.settings).unwrap_or_default();
    if let Some(error) = validator.iter_errors(&settings).next() {
        let (place, settings) = (error.instance_path(), &subject.settings);
        probe.find(Finding::new(
            format!("the schema refuses the sample settings {settings}: {place} {error}"),
            "correct the sample (--sample); or give required settings a \"default\" or \
             \"examples\" in the schema",
        ));
    }
    Ok(())
}

fn schema_of(probe: &Probe, subject: &Subject) -> Result<Option<Value>, crate::finding::Stop> {
    if subject.schema.is_some() {
        return Ok(subject.schema.clone());
    }
    let Some(descriptor) = subject.factory.descriptor else { return Ok(None) };
    let raw = probe.descriptor(descriptor, probe.request.plugin);
    // SAFETY: `subject` checked it.
    match text::read(unsafe { (*raw).settings_schema }) {
        Ok(text) if text.is_empty() => Ok(None),
        Ok(_) => Err(Finding::new("the settings schema is no JSON", "correct it").into()),
        Err(what) => {
            let fault = format!("the settings schema {what}");
            Err(Finding::new(fault, "give static UTF-8 text").into())
        }
    }
}

pub(crate) fn bad(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let create = required(subject.factory.create, "create")?;
    let deep = "[".repeat(10_000);
    let texts: [(&str, &[u8]); 8] = [
        ("settings that are no JSON", b"{\"a\":"),
        ("settings that are empty text", b""),
        ("settings that are a list", b"[]"),
        ("settings that are a number", b"7"),
        ("settings that are null", b"null"),
        ("settings that are not UTF-8", b"{\"a\":\"\xff\xfe\"}"),
        ("settings with a zero byte", b"{}\0{}"),
        ("settings that never close", deep.as_bytes()),
    ];
    for (what, text) in texts {
        // What never looks at its settings may accept these, but not fall over them.
        refused(probe, &subject, create, what, text, false);
    }
    let (Some(schema), Ok(Value::Object(right))) =
        (&subject.schema, serde_json::from_str(&subject.settings))
    else {
        return Ok(());
    };
    let Ok(validator) = jsonschema::validator_for(schema) else { return Ok(()) };
    for (what, settings) in made_up::wrong(schema, &right) {
        let text = settings.to_string();
        let must_be_refused = validator.is_valid(&settings);
        refused(probe, &subject, create, &what, text.as_bytes(), must_be_refused);
    }
    Ok(())
}

/// Creates an instance with invalid settings. The host has refused those that break the schema,
/// so only others must be refused here, with a message.
fn refused(
    probe: &Probe,
    subject: &Subject,
    create: unsafe extern "C" fn(
        abi::BusbarStr,
        abi::BusbarStr,
        *const abi::BusbarHost,
        *mut abi::BusbarError,
    ) -> *mut abi::BusbarPlugin,
    what: &str,
    settings: &[u8],
    must_be_refused: bool,
) {
    let mut error = abi::BusbarError::empty();
    let (id, text) = (abi::BusbarStr::from_borrowed(&subject.id), text::of_bytes(settings));
    probe.host.open();
    let made = probe.create(create, id, text, probe.host.as_ptr(), &mut error);
    if made.is_null() {
        let allowed = [abi::BUSBAR_INVALID_SETTINGS, abi::BUSBAR_INVALID_ARGUMENT];
        probe.expect_refused(&format!("create with {what}"), error.status, &error, &allowed);
    } else {
        // SAFETY: an instance, or a breach of the ABI.
        if let Some(destroy) = unsafe { (*made).destroy } {
            probe.destroy(destroy, made);
        }
        probe.expect(
            !must_be_refused,
            format!("{what} is accepted by the schema and by `create`"),
            "let the schema refuse it (\"additionalProperties\": false, types and ranges; in \
             Rust #[serde(deny_unknown_fields)] and #[schemars(range(...))]), or `create`",
        );
    }
    probe.host.close();
}
