//! Axle forces as nodal forces (the paper's Fig. 6).

use super::element::shape_functions;

/// How a force between two nodes is shared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// `(1 - s) F` and `s F` on the two displacements (Fig. 6).
    Linear,
    /// The element's own shape functions, moments included: the consistent load.
    Hermite,
}

impl Weights {
    /// Shares on `(w_1, theta_1, w_2, theta_2)` of a unit force at `s` in 0 to 1 along an element
    /// of length `h`.
    #[must_use]
    pub fn at(self, h: f64, s: f64) -> [f64; 4] {
        match self {
            Self::Linear => [1.0 - s, 0.0, s, 0.0],
            Self::Hermite => shape_functions(h, s),
        }
    }
}

/// Share of an axle's force that one wheel track carries: the vehicle is symmetric left to right.
pub const TRACK_SHARE: f64 = 0.5;
