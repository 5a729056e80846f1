//! The pavement's answer to tire forces, and what of it is kept.

pub mod banded;
pub mod dense;
mod kernel;
mod passes;
pub mod record;
mod sdirk;
pub mod traffic;
pub mod window;

pub use crate::pavement::Quantity;
pub use crate::pavement::load::Loads;
pub use dense::Stepper;
pub use record::{Envelope, Keep, Record};

/// What the nodal forces do within a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// They keep their value and place at its beginning: first order in `dt` (the paper).
    Zero,
    /// They go linearly from their value at its beginning to that at its end: second order.
    First,
}
