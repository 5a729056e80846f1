//! The pavement: a beam on damped bars or on a Winkler bed, by finite elements.

pub mod element;
pub mod load;
pub mod mesh;
pub mod strip;

pub use load::Weights;
pub use mesh::Mesh;
pub use strip::{Bed, Ends, Foundation, Section, Strip};
