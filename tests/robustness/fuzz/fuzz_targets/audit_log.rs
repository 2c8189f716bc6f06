#![no_main]

#[path = "../../fuzz_corpus/tests/audit_log.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    body::fuzz_one(bytes);
});
