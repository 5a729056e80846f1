//! The mesh of a road: sections, elements, nodes, and the matrices of each element.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix2, Matrix4};

use super::element::{Weights, bending, consistent, lumped};
use crate::error::{Result, check, invalid, not_negative, positive};

/// What the beam rests on, per metre of road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bed {
    /// Stiffness `k`, N/m^2.
    pub stiffness: f64,
    /// Damping `c`, N s/m^2.
    pub damping: f64,
    /// Mass that moves with the beam, kg/m.
    pub mass: f64,
}

/// A length of road of one structure at one temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Length, m.
    pub length: f64,
    /// Bending stiffness `EI`, N m^2.
    pub bending_stiffness: f64,
    /// Bending damping `c_EI`, N m^2 s.
    pub bending_damping: f64,
    /// Mass of the beam, kg/m.
    pub mass: f64,
    /// The bed under it.
    pub bed: Bed,
}

/// How the bed carries the beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foundation {
    /// A bar under every node, with the bed of half an element on each side (the paper).
    Bars,
    /// A continuous bed with consistent matrices.
    Winkler,
}

/// How both ends of the strip are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// No displacement, no slope (the paper).
    Clamped,
    /// No displacement.
    Pinned,
    /// Not held.
    Free,
}

/// Mass, damping and stiffness of one element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ElementMatrices {
    pub(crate) mass: Matrix4<f64>,
    pub(crate) damping: Matrix4<f64>,
    pub(crate) stiffness: Matrix4<f64>,
}

impl ElementMatrices {
    /// In the order of their derivatives of the displacement, from the second down.
    pub(crate) fn all(&self) -> [&Matrix4<f64>; 3] {
        [&self.mass, &self.damping, &self.stiffness]
    }
}

/// Equal elements of one section.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    /// Number of the first element, and where it starts.
    first: usize,
    start: f64,
    /// Length of the section, its elements, and how many of them a metre has.
    length: f64,
    count: usize,
    per_metre: f64,
    matrices: ElementMatrices,
}

impl Piece {
    /// Length of an element, m.
    fn step(&self) -> f64 {
        self.length / self.count as f64
    }
}

/// A place within an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// Number of the element, which is that of the node at its beginning.
    pub(crate) element: usize,
    /// Its length, m.
    pub(crate) h: f64,
    /// How far along it the place is, 0 to 1.
    pub(crate) s: f64,
}

impl Place {
    /// Shares of a unit force here on `(w_1, theta_1, w_2, theta_2)` of the element.
    #[inline]
    pub(crate) fn weights(&self, weights: Weights) -> [f64; 4] {
        weights.at(self.h, self.s)
    }
}

/// Sections laid end to end from x = 0, in elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    sections: Vec<Section>,
    pieces: Vec<Piece>,
    /// Places of the nodes, m, which roads of other constants share.
    nodes: Arc<Vec<f64>>,
    foundation: Foundation,
    ends: Ends,
}

impl Mesh {
    /// Mesh `sections` with elements not longer than `element_length` (each section takes a whole
    /// number of equal elements).
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for a section shorter than an element, a
    /// negative or non-finite property, or a road of a single element.
    pub fn new(
        sections: &[Section],
        element_length: f64,
        foundation: Foundation,
        ends: Ends,
    ) -> Result<Self> {
        positive("element_length", element_length, "m")?;
        let mut mesh = Self::empty(foundation, ends);
        for (number, section) in sections.iter().enumerate() {
            section.check(number, element_length)?;
            // A length that is a whole number of elements but for rounding gets just those.
            let count = (section.length / element_length - 1e-9).ceil().max(1.0);
            let total = mesh.elements() as f64 + count;
            check("number of elements", total, "", "at most a million", |total| total <= 1e6)?;
            let matrices = section.matrices(section.length / count, foundation);
            mesh.add(*section, count as usize, matrices);
        }
        if mesh.elements() < 2 {
            let allowed = format!("at least two elements of {element_length:?} m");
            return Err(invalid("road length", format!("{:?} m", mesh.length()), allowed));
        }
        Ok(mesh)
    }

    fn empty(foundation: Foundation, ends: Ends) -> Self {
        Self {
            sections: Vec::new(),
            pieces: Vec::new(),
            nodes: Arc::new(vec![0.0]),
            foundation,
            ends,
        }
    }

    /// Lay a section of so many elements at the end.
    fn add(&mut self, section: Section, count: usize, matrices: ElementMatrices) {
        let (first, start, length) = (self.elements(), self.length(), section.length);
        let per_metre = count as f64 / length;
        self.sections.push(section);
        self.pieces.push(Piece { first, start, length, count, per_metre, matrices });
        let nodes = Arc::make_mut(&mut self.nodes);
        nodes.extend((1..count).map(|node| start + length * node as f64 / count as f64));
        // The last one is where the next section starts, to the last digit.
        nodes.push(start + length);
    }

    /// The sections it was made of.
    pub(crate) fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Number of nodes.
    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Number of elements.
    pub(crate) fn elements(&self) -> usize {
        self.nodes.len() - 1
    }

    /// Elements of each section, one after the other.
    pub(crate) fn stretches(&self) -> impl Iterator<Item = Range<usize>> {
        self.pieces.iter().map(|piece| piece.first..piece.first + piece.count)
    }

    /// Some of its elements as a road of its own, held at both ends as this one is.
    pub(crate) fn part(&self, elements: Range<usize>) -> Self {
        let mut part = Self::empty(self.foundation, self.ends);
        for (number, piece) in self.pieces.iter().enumerate() {
            let first = elements.start.max(piece.first);
            let count = elements.end.min(piece.first + piece.count).saturating_sub(first);
            if count > 0 {
                part.add_more(self, number, count);
            }
        }
        part
    }

    /// So many elements of a section as a road of its own, held at both ends as this one is.
    pub(crate) fn more_of(&self, section: usize, elements: usize) -> Self {
        let mut road = Self::empty(self.foundation, self.ends);
        road.add_more(self, section, elements);
        road
    }

    /// Lay so many elements of a section of another road at the end.
    fn add_more(&mut self, road: &Self, section: usize, count: usize) {
        let (piece, section) = (&road.pieces[section], road.sections[section]);
        let length = piece.step() * count as f64;
        self.add(Section { length, ..section }, count, piece.matrices);
    }

    fn piece(&self, element: usize) -> &Piece {
        &self.pieces[self.number(element)]
    }

    /// Places of the nodes, m, the ends included.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Place of a node, m.
    #[inline]
    pub(crate) fn node(&self, number: usize) -> f64 {
        self.nodes[number]
    }

    /// Length of the road, m.
    pub(crate) fn length(&self) -> f64 {
        self.nodes[self.elements()]
    }

    /// Largest distance between two bars, m, where the beam stands on bars.
    pub(crate) fn spacing_of_bars(&self) -> Option<f64> {
        let bars = self.foundation == Foundation::Bars;
        bars.then(|| self.pieces.iter().map(Piece::step).fold(0.0, f64::max))
    }

    /// Shortest element, m.
    pub(crate) fn shortest(&self) -> f64 {
        self.pieces.iter().map(Piece::step).fold(f64::INFINITY, f64::min)
    }

    /// Length of an element, m: to the last digit that of all others of its section.
    pub(crate) fn step(&self, element: usize) -> f64 {
        self.piece(element).step()
    }

    /// Longest element, m.
    pub(crate) fn longest(&self) -> f64 {
        self.pieces.iter().map(Piece::step).fold(0.0, f64::max)
    }

    /// Matrices of an element.
    pub(crate) fn matrices(&self, element: usize) -> &ElementMatrices {
        &self.piece(element).matrices
    }

    /// The diagonal block of a node and the block right of it, of `M`, `C` and `K`, those of the
    /// unknowns that the ends hold included (eq. 5).
    pub(crate) fn block_row(&self, node: usize) -> [[Matrix2<f64>; 2]; 3] {
        let block = |matrix: &Matrix4<f64>, row: usize, column: usize| -> Matrix2<f64> {
            matrix.fixed_view::<2, 2>(row, column).into_owned()
        };
        let mut rows = [[Matrix2::zeros(); 2]; 3];
        if let Some(left) = node.checked_sub(1) {
            for (row, matrix) in rows.iter_mut().zip(self.matrices(left).all()) {
                row[0] += block(matrix, 2, 2);
            }
        }
        if node < self.elements() {
            for (row, matrix) in rows.iter_mut().zip(self.matrices(node).all()) {
                row[0] += block(matrix, 0, 0);
                row[1] = block(matrix, 0, 2);
            }
        }
        rows
    }

    /// The same of a node between two elements like this one.
    pub(crate) fn block_row_within(&self, element: usize) -> [[Matrix2<f64>; 2]; 3] {
        self.matrices(element).all().map(|matrix| {
            let block = |row, column| matrix.fixed_view::<2, 2>(row, column).into_owned();
            [block(2, 2) + block(0, 0), block(0, 2)]
        })
    }

    /// The same road with other constants: sections of the same lengths.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) as for a new one.
    pub(crate) fn with_sections(&self, sections: &[Section]) -> Result<Self> {
        let lengths = |sections: &[Section]| -> Vec<f64> {
            sections.iter().map(|section| section.length).collect()
        };
        if lengths(sections) != lengths(&self.sections) {
            let given = format!("{:?} m", lengths(sections));
            return Err(invalid("lengths of sections", given, "those of the other classes"));
        }
        let mut pieces = self.pieces.clone();
        for (number, (piece, section)) in pieces.iter_mut().zip(sections).enumerate() {
            section.check(number, piece.step())?;
            piece.matrices = section.matrices(piece.step(), self.foundation);
        }
        let Self { foundation, ends, .. } = *self;
        Ok(Self {
            sections: sections.to_vec(),
            pieces,
            nodes: Arc::clone(&self.nodes),
            foundation,
            ends,
        })
    }

    /// Whether all elements from one up to another, both included, are equal.
    pub(crate) fn uniform(&self, first: usize, last: usize) -> bool {
        std::ptr::eq(self.piece(first), self.piece(last))
    }

    /// The section of an element.
    pub(crate) fn section(&self, element: usize) -> &Section {
        &self.sections[self.number(element)]
    }

    /// The number of the section of an element.
    pub(crate) fn number(&self, element: usize) -> usize {
        self.pieces.partition_point(|piece| piece.first <= element) - 1
    }

    /// What the beam rests on.
    pub(crate) fn foundation(&self) -> Foundation {
        self.foundation
    }

    /// Where on the mesh `x` is; nothing off the road.
    #[inline]
    pub(crate) fn place(&self, x: f64) -> Option<Place> {
        if !(x >= 0.0 && x <= self.length()) {
            return None;
        }
        let piece = if self.pieces.len() == 1 {
            &self.pieces[0]
        } else {
            &self.pieces[self.pieces.partition_point(|piece| piece.start <= x) - 1]
        };
        // Where x is at a node but for rounding, the quotient may be off by one.
        let along = (x - piece.start) * piece.per_metre;
        let mut i = piece.first + (along as usize).min(piece.count - 1);
        if i > piece.first && x < self.nodes[i] {
            i -= 1;
        } else if i + 1 < piece.first + piece.count && x >= self.nodes[i + 1] {
            i += 1;
        }
        let (start, end) = (self.nodes[i], self.nodes[i + 1]);
        let h = end - start;
        Some(Place { element: i, h, s: (x - start) / h })
    }

    /// Whether the ends hold an unknown, counted `w_0, theta_0, w_1, ...`.
    #[inline]
    pub(crate) fn holds(&self, unknown: usize) -> bool {
        let at_end = unknown < 2 || unknown >= 2 * self.elements();
        at_end
            && match self.ends {
                Ends::Clamped => true,
                Ends::Pinned => unknown.is_multiple_of(2),
                Ends::Free => false,
            }
    }
}

impl Section {
    fn check(&self, number: usize, element_length: f64) -> Result<()> {
        let name = |quantity: &str| format!("section {number}: {quantity}");
        let allowed = format!("at least one element of {element_length} m");
        let shortest = element_length * (1.0 - 1e-9);
        check(&name("length"), self.length, "m", &allowed, |length| length >= shortest)?;
        positive(&name("bending stiffness"), self.bending_stiffness, "N m^2")?;
        positive(&name("mass"), self.mass, "kg/m")?;
        not_negative(&name("bending damping"), self.bending_damping, "N m^2 s")?;
        not_negative(&name("bed stiffness"), self.bed.stiffness, "N/m^2")?;
        not_negative(&name("bed damping"), self.bed.damping, "N s/m^2")?;
        not_negative(&name("bed mass"), self.bed.mass, "kg/m")?;
        Ok(())
    }

    /// Matrices of an element of length `h` (eqs. 1, 2 and 4; bars or a bed).
    fn matrices(&self, h: f64, foundation: Foundation) -> ElementMatrices {
        let bed = match foundation {
            Foundation::Bars => lumped(h),
            Foundation::Winkler => consistent(h),
        };
        ElementMatrices {
            mass: consistent(h) * self.mass + bed * self.bed.mass,
            damping: bending(h) * self.bending_damping + bed * self.bed.damping,
            stiffness: bending(h) * self.bending_stiffness + bed * self.bed.stiffness,
        }
    }
}
