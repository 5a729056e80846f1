//! A strip of pavement under one wheel track: sections, mesh, `M`, `C`, `K` (eq. 5).

use nalgebra::Matrix2;

use super::element::Weights;
use super::mesh::{Ends, Foundation, Mesh, Section};
use crate::error::Result;
use crate::linalg::Banded;
use crate::transition::System;

/// Shares of the four unknowns `(w_1, theta_1, w_2, theta_2)` of the element that holds a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Numbers of the unknowns in the free system; `None` where the support holds them.
    pub unknowns: [Option<usize>; 4],
    /// The share of each.
    pub weights: [f64; 4],
}

impl Shares {
    /// The weighted sum of what the unknowns are.
    #[must_use]
    pub fn read(&self, unknowns: &[f64]) -> f64 {
        let read = |unknown: Option<usize>| unknown.map_or(0.0, |at| unknowns[at]);
        self.unknowns.into_iter().zip(self.weights).map(|(at, weight)| weight * read(at)).sum()
    }
}

/// The mesh and matrices of a road.
#[derive(Debug, Clone, PartialEq)]
pub struct Strip {
    mesh: Mesh,
    free: Vec<Option<usize>>,
    system: System,
}

impl Strip {
    /// Mesh `sections`, laid end to end from x = 0, with elements not longer than `element_length`
    /// (each section takes a whole number of equal elements), and assemble `M`, `C`, `K`.
    ///
    /// # Errors
    /// As [`Mesh::new`] and [`Strip::of`].
    pub fn new(
        sections: &[Section],
        element_length: f64,
        foundation: Foundation,
        ends: Ends,
    ) -> Result<Self> {
        Self::of(Mesh::new(sections, element_length, foundation, ends)?)
    }

    /// Assemble `M`, `C`, `K` of a mesh.
    ///
    /// # Errors
    /// [`Error::NonFinite`](crate::error::Error::NonFinite) where a matrix overflows.
    pub fn of(mesh: Mesh) -> Result<Self> {
        let (free, n) = number_unknowns(&mesh);
        let mut matrices = [(); 3].map(|()| Banded::zeros(n, 3));
        for node in 0..mesh.len() {
            for (matrix, [diagonal, right]) in matrices.iter_mut().zip(mesh.block_row(node)) {
                let mut put = |row: usize, column: usize, block: &Matrix2<f64>| {
                    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let unknown = |number: usize| free.get(number).copied().flatten();
                        let (row, column) = (unknown(2 * row + i), unknown(2 * column + j));
                        if let (Some(row), Some(column)) = (row, column) {
                            matrix.add(row, column, block[(i, j)]);
                        }
                    }
                };
                put(node, node, &diagonal);
                put(node, node + 1, &right);
                put(node + 1, node, &right.transpose());
            }
        }
        let [mass, damping, stiffness] = matrices;
        let system = System { mass, damping, stiffness };
        system.mass.check_finite("mass matrix")?;
        system.damping.check_finite("damping matrix")?;
        system.stiffness.check_finite("stiffness matrix")?;
        Ok(Self { mesh, free, system })
    }

    /// Places of the nodes, m, the ends included.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        self.mesh.nodes()
    }

    /// The mesh.
    pub(crate) fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Length of the road, m.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.mesh.length()
    }

    /// `M`, `C`, `K` of the unknowns that the ends do not hold.
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Number of an unknown, counted `w_0, theta_0, w_1, ...`, in the free system; `None` where the
    /// support holds it.
    pub(crate) fn free(&self, unknown: usize) -> Option<usize> {
        self.free[unknown]
    }

    /// How a unit force at `x` is shared, or nothing off the road.
    #[must_use]
    pub fn shares(&self, x: f64, weights: Weights) -> Option<Shares> {
        self.mesh.place(x).map(|place| Shares {
            unknowns: self.unknowns(place.element),
            weights: place.weights(weights),
        })
    }

    /// Numbers of an element's `(w_1, theta_1, w_2, theta_2)`; none where the support holds them.
    pub(crate) fn unknowns(&self, element: usize) -> [Option<usize>; 4] {
        std::array::from_fn(|i| self.free[2 * element + i])
    }
}

/// Numbers of the unknowns `w_0, theta_0, w_1, ...`, those the ends hold left out, and their count.
fn number_unknowns(mesh: &Mesh) -> (Vec<Option<usize>>, usize) {
    let mut count = 0;
    let number = |unknown| {
        (!mesh.holds(unknown)).then(|| {
            count += 1;
            count - 1
        })
    };
    let free = (0..2 * mesh.len()).map(number).collect();
    (free, count)
}
