//! Dissolved gas analysis (DGA): fault diagnosis of transformers by the gases in their oil.
//!
//! A [`Sample`] holds concentrations in ppm (µL of gas in a litre of oil). Each method is
//! a module with `zone`, its bare result, and `diagnose`, the same with the rule that
//! gave it, how far the sample is from another result, and the source ([`Verdict`]).
//!
//! | module | method |
//! |---|---|
//! | [`iec60599`] | ratios of IEC 60599, table 1: a set, for its zones overlap |
//! | [`rogers`], [`doernenburg`], [`key_gas`] | methods of IEEE C57.104 |
//! | [`dlt722`] | three-ratio method of DL/T 722-2014 |
//! | [`triangle_1`], [`triangle_4`], [`triangle_5`] | Duval's triangles |
//! | [`pentagon`] | Duval's pentagons 1 and 2 |
//! | [`c57_104`], [`c57_104_2008`] | status by the tables of IEEE C57.104-2019; conditions of 2008 |
//! | [`indicators`] | ratios that hint at paper, tap changers, oxygen |
//! | [`typical`] | typical and attention values of IEC 60599, CIGRE and DL/T 722 |
//! | [`rates`] | how fast gas forms |
//! | [`uncertainty`] | how probable each result is, given the laboratory's accuracy |
//!
//! # What holds for all methods
//! - A gas that was not measured is *absent*: methods that need it say
//!   [`Zone::NotApplicable`]. So does a triangle or a pentagon all of whose gases are 0.
//! - A gas *below the detection limit* counts as 0. Its uncertainty reaches up to that
//!   limit.
//! - A ratio x/0 is infinite, above every limit; 0/0 cannot be computed and meets no
//!   condition but "any". No result is ever NaN.
//! - Percentages are `100 * gas / sum` in `f64`, and limits are compared with them as
//!   they are, without tolerance: whole numbers of ppm are decided exactly, and decimal
//!   fractions as `f64` has them (0.3/0.1 is a little less than 3).
#![doc = include_str!("../DESIGN.md")]

pub mod c57_104;
pub mod c57_104_2008;
pub mod dlt722;
pub mod doernenburg;
mod gas;
pub mod iec60599;
pub mod indicators;
pub mod key_gas;
mod margin;
pub mod pentagon;
mod plane;
pub mod rates;
mod ratio;
pub mod rogers;
mod sample;
mod triangle;
pub mod triangle_1;
pub mod triangle_4;
pub mod triangle_5;
pub mod typical;
pub mod uncertainty;
mod verdict;

pub use gas::Gas;
pub use ratio::Ratio;
pub use sample::{Concentration, MAX_PPM, Sample, SampleError};
pub use verdict::{Margin, Verdict, Zone};
