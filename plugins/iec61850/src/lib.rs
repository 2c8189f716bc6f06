//! IEC 61850 MMS telemetry.
