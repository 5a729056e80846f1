//! What the pavement answers at a place, from the motion of the nodes around it.

use super::element::Weights;
use super::mesh::{Foundation, Mesh, Place};

/// What the pavement answers, along the beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Deflection `w`, m, up positive.
    Deflection,
    /// Its rate, m/s.
    Velocity,
    /// Curvature `w''`, 1/m: positive where the beam sags.
    Curvature,
    /// Bending moment `EI w'' + c_EI w''_t`, N m.
    Moment,
    /// What the bed carries, `-(k w + c w_t)`, N/m, positive pressing down.
    Reaction,
}

/// Weights of displacement and slope of four nodes: the two of an element and those beside them.
type FourNodes = [f64; 8];

/// How a quantity is read at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reading {
    /// The element that holds the place.
    element: usize,
    /// Weights of the motion, and of its rate.
    weights: [FourNodes; 2],
}

impl Reading {
    /// The quantity, from `[displacement, slope]` and the rates of both at a node.
    #[inline]
    pub(crate) fn of(&self, motion: impl Fn(usize) -> [[f64; 2]; 2]) -> f64 {
        let [here, rate] = &self.weights;
        let mut sum = 0.0;
        for k in 0..4 {
            let weights = [here, rate].map(|weights| [weights[2 * k], weights[2 * k + 1]]);
            // The node before the first one, and the one after the last, have no weight.
            if weights == [[0.0; 2]; 2] {
                continue;
            }
            let motion = motion(self.element + k - 1);
            for (motion, weights) in motion.into_iter().zip(weights) {
                sum += motion[0] * weights[0] + motion[1] * weights[1];
            }
        }
        sum
    }
}

impl Mesh {
    /// How to read a quantity at a place; between two sections, as in the one ahead.
    pub(crate) fn reading(&self, place: &Place, quantity: Quantity) -> Reading {
        let section = self.section(place.element);
        let (bed, none) = (section.bed, [0.0; 8]);
        let deflection = || {
            let [a, b, c, d] = place.weights(Weights::Hermite);
            [0.0, 0.0, a, b, c, d, 0.0, 0.0]
        };
        let times = |factor: f64, weights: FourNodes| weights.map(|weight| factor * weight);
        let weights = match quantity {
            Quantity::Deflection => [deflection(), none],
            Quantity::Velocity => [none, deflection()],
            Quantity::Curvature => [self.curvature(place), none],
            Quantity::Moment => {
                let curvature = self.curvature(place);
                [section.bending_stiffness, section.bending_damping].map(|c| times(c, curvature))
            }
            Quantity::Reaction => [bed.stiffness, bed.damping].map(|c| times(-c, deflection())),
        };
        Reading { element: place.element, weights }
    }

    /// Weights of the curvature.
    ///
    /// The second derivative of an element's own cubic, `N'' u`, is off by
    /// `w'''' h^2 (1/12 - s (1 - s) / 2)`. On a bed, that error at a node is the difference to
    /// `2 (w_- - 2 w + w_+) / h^2 - (t_+ - t_-) / 2h`, which is of fourth order. Between bars
    /// `w''''` is inertia alone, and at a bar the mean of both elements is taken.
    fn curvature(&self, place: &Place) -> FourNodes {
        let Place { element, h, s } = *place;
        let own = |s: f64| {
            let (a, b) = (12.0 * s - 6.0, 6.0 * s);
            [0.0, 0.0, a, h * (b - 4.0), -a, h * (b - 2.0), 0.0, 0.0]
        };
        let alike = |other: usize| {
            other < self.elements() && self.uniform(element.min(other), element.max(other))
        };
        let before = element.checked_sub(1).is_some_and(alike);
        let after = alike(element + 1);
        let minus = |a: FourNodes, b: FourNodes| std::array::from_fn(|i| a[i] - b[i]);
        let plus = |a: FourNodes, factor: f64, b: FourNodes| -> FourNodes {
            std::array::from_fn(|i| a[i] + factor * b[i])
        };
        let mut weights = own(s);
        if self.foundation() == Foundation::Bars {
            if before && s == 0.0 {
                let behind = [6.0, 2.0 * h, -6.0, 4.0 * h, 0.0, 0.0, 0.0, 0.0];
                weights = plus(weights, 0.5, minus(behind, weights));
            }
        } else {
            let fine = [2.0, 0.5 * h, -4.0, 0.0, 2.0, -0.5 * h, 0.0, 0.0];
            let mut ahead = fine;
            ahead.rotate_right(2);
            let left = before.then(|| minus(fine, own(0.0)));
            let right = after.then(|| minus(ahead, own(1.0)));
            let part = 1.0 - 6.0 * s * (1.0 - s);
            if let (Some(left), Some(right)) = (left.or(right), right.or(left)) {
                weights = plus(weights, (1.0 - s) * part, left);
                weights = plus(weights, s * part, right);
            }
        }
        weights.map(|weight| weight / (h * h))
    }
}
