//! The pavement's answer to tire forces, and what of it is kept.

pub mod dense;
pub mod record;

pub use dense::{Hold, Loads, Stepper};
pub use record::{Envelope, Keep, Record};
