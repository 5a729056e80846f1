//! Pitch-plane vehicles from bodies, springs and tires, and their tire forces over a profile.

pub mod blocks;
pub mod contact;
pub(crate) mod course;
pub mod fleet;
pub(crate) mod linear;
pub mod model;
mod nonlinear;
pub mod record;
pub mod run;

pub use blocks::in_blocks;
pub use contact::{Interpolation, Profile};
pub use fleet::fleet;
pub use model::{Body, Friction, GRAVITY, Point, Spring, Tire, Vehicle};
pub use record::{Keep, Record, Statistics, Take};
pub use run::{Passage, Run};

pub(crate) use nonlinear::{Rolling, State};
