//! OPC UA telemetry and alarms.
