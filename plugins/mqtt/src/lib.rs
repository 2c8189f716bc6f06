//! MQTT and Sparkplug B telemetry.
