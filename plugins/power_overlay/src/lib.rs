//! Live values at the equipment
