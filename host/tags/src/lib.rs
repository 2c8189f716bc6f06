//! Tag table, quality, freshness and snapshots
