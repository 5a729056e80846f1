//! The pavement: a beam on damped bars or on a Winkler bed, by finite elements.

pub mod element;
pub mod load;
pub mod mesh;
mod reading;
pub mod strip;

pub use element::Weights;
pub use load::Contact;
pub use mesh::{Bed, Ends, Foundation, Mesh, Section};
pub use reading::Quantity;
pub(crate) use reading::Reading;
pub use strip::Strip;
