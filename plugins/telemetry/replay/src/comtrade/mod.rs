//! COMTRADE, the common format for transient data exchange: IEEE C37.111-1991,
//! -1999 and -2013 (IEC 60255-24:2013).
//!
//! [`Cfg`] is what a configuration says, [`RecordLayout`] reads one record of data, and
//! [`Data`] finds records in a file without keeping them. [`Cff`] is the single file
//! of 2013. Clauses are those of the edition of 2013 where no other is named.

mod cff;
mod cfg;
mod cfg_error;
mod channel;
mod data;
mod fields;
mod layout;
mod record;
mod revision;
mod sample_clock;
mod sampling;
mod stamp;

pub use cff::{Cff, CffError, MAX_CFF_HEAD_BYTES};
pub use cfg::{Cfg, Clock, DataType, MAX_CFG_BYTES, MAX_CHANNELS};
pub use cfg_error::CfgError;
pub use channel::{Analog, Digital, Side};
pub use data::{Data, DataFault, MAX_BLOCKS};
pub use record::{Record, RecordError, RecordLayout};
pub use revision::Revision;
pub(crate) use sample_clock::SampleClock;
pub use sampling::{MAX_RATES, Rate, Sampling};
pub use stamp::Stamp;

#[cfg(test)]
pub(crate) mod writer;
