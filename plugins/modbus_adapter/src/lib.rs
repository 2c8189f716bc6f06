//! Modbus TCP telemetry
