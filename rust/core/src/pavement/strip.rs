//! A strip of pavement under one wheel track: sections, mesh, `M`, `C`, `K` (eq. 5).

use nalgebra::{Matrix2, Matrix4};

use super::element::Weights;
use super::mesh::{Ends, Foundation, Mesh, Section};
use crate::error::Result;
use crate::linalg::Banded;
use crate::transition::System;

/// A symmetric matrix of 2x2 blocks, one row of blocks a node, each coupled to its neighbours only.
#[derive(Debug, Clone, PartialEq)]
struct BlockTridiagonal {
    diagonal: Vec<Matrix2<f64>>,
    upper: Vec<Matrix2<f64>>,
}

impl BlockTridiagonal {
    fn zeros(nodes: usize) -> Self {
        Self {
            diagonal: vec![Matrix2::zeros(); nodes],
            upper: vec![Matrix2::zeros(); nodes.saturating_sub(1)],
        }
    }

    fn add(&mut self, element: usize, matrix: &Matrix4<f64>) {
        self.diagonal[element] += matrix.fixed_view::<2, 2>(0, 0);
        self.upper[element] += matrix.fixed_view::<2, 2>(0, 2);
        self.diagonal[element + 1] += matrix.fixed_view::<2, 2>(2, 2);
    }

    /// The rows and columns of the unknowns that are free.
    fn restrict(&self, free: &[Option<usize>], n: usize) -> Banded {
        let mut out = Banded::zeros(n, 3);
        let mut put = |row: usize, column: usize, block: &Matrix2<f64>| {
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                if let (Some(r), Some(c)) = (free[2 * row + i], free[2 * column + j]) {
                    out.add(r, c, block[(i, j)]);
                }
            }
        };
        for (node, block) in self.diagonal.iter().enumerate() {
            put(node, node, block);
        }
        for (node, block) in self.upper.iter().enumerate() {
            put(node, node + 1, block);
            put(node + 1, node, &block.transpose());
        }
        out
    }
}

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
        let mut mass = BlockTridiagonal::zeros(mesh.len());
        let mut damping = mass.clone();
        let mut stiffness = mass.clone();
        for element in 0..mesh.elements() {
            let matrices = mesh.matrices(element);
            mass.add(element, &matrices.mass);
            damping.add(element, &matrices.damping);
            stiffness.add(element, &matrices.stiffness);
        }
        let (free, n) = number_unknowns(&mesh);
        let system = System {
            mass: mass.restrict(&free, n),
            damping: damping.restrict(&free, n),
            stiffness: stiffness.restrict(&free, n),
        };
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
