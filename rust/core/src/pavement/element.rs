//! Matrices of one beam element (the paper's eqs. 1, 2 and 4).
//!
//! Unknowns `(w_1, theta_1, w_2, theta_2)`: vertical displacement, m, up positive, and slope
//! `dw/dx`, with cubic (Hermite) shape functions.

use nalgebra::Matrix4;

/// The bending shape `[12 6h -12 6h; ...] / h^3`, 1/m^3.
///
/// Times the bending stiffness `EI`, N m^2, it is the stiffness matrix (eq. 1); times the bending
/// damping `c_EI`, N m^2 s, the damping matrix. The paper's `c_d` is `c_EI / h^3`.
#[must_use]
pub fn bending(h: f64) -> Matrix4<f64> {
    let (a, b) = (6.0 * h, h * h);
    #[rustfmt::skip]
    let shape = Matrix4::new(
        12.0,  a,       -12.0,  a,
        a,     4.0 * b, -a,     2.0 * b,
        -12.0, -a,      12.0,   -a,
        a,     2.0 * b, -a,     4.0 * b,
    );
    shape / (h * h * h)
}

/// The consistent shape `h/420 [156 22h 54 -13h; ...]`, m.
///
/// Times a mass per metre it is the mass matrix (eq. 2); times a bed's stiffness or damping per
/// metre, the matrix of a Winkler bed under the element.
#[must_use]
pub fn consistent(h: f64) -> Matrix4<f64> {
    let b = h * h;
    #[rustfmt::skip]
    let shape = Matrix4::new(
        156.0,     22.0 * h,  54.0,      -13.0 * h,
        22.0 * h,  4.0 * b,   13.0 * h,  -3.0 * b,
        54.0,      13.0 * h,  156.0,     -22.0 * h,
        -13.0 * h, -3.0 * b,  -22.0 * h, 4.0 * b,
    );
    shape * (h / 420.0)
}

/// Bed lumped at the two ends, each carrying half the element, m.
#[must_use]
pub fn lumped(h: f64) -> Matrix4<f64> {
    let mut shape = Matrix4::zeros();
    shape[(0, 0)] = h / 2.0;
    shape[(2, 2)] = h / 2.0;
    shape
}

/// Hermite shape functions at `s` in 0 to 1 along the element: `w = N . (w_1, theta_1, w_2, theta_2)`.
#[must_use]
pub fn shape_functions(h: f64, s: f64) -> [f64; 4] {
    let (r, s2) = (1.0 - s, s * s);
    [(1.0 + 2.0 * s) * r * r, h * s * r * r, s2 * (3.0 - 2.0 * s), -h * s2 * r]
}

/// Their derivatives along the element, 1/m: `dw/dx = N' . (w_1, theta_1, w_2, theta_2)`.
#[must_use]
pub fn shape_slopes(h: f64, s: f64) -> [f64; 4] {
    let bend = 6.0 * s * (1.0 - s) / h;
    [-bend, (1.0 - s) * (1.0 - 3.0 * s), bend, s * (3.0 * s - 2.0)]
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rigid_motion_bends_nothing_and_keeps_its_mass() {
        let h = 0.37;
        let heave = nalgebra::Vector4::new(1.0, 0.0, 1.0, 0.0);
        let pitch = nalgebra::Vector4::new(0.0, 1.0, h, 1.0);
        assert!((bending(h) * heave).amax() < 1e-12);
        assert!((bending(h) * pitch).amax() < 1e-11);
        assert!(((heave.transpose() * consistent(h) * heave)[0] - h).abs() < 1e-15);
        assert!(((pitch.transpose() * consistent(h) * pitch)[0] - h.powi(3) / 3.0).abs() < 1e-15);
    }

    #[test]
    fn slopes_are_those_of_the_shape_functions() {
        let (h, step) = (0.37, 1e-6);
        for s in [0.0, 0.21, 0.5, 0.83, 1.0] {
            let (before, after) = (shape_functions(h, s - step), shape_functions(h, s + step));
            for (slope, (a, b)) in shape_slopes(h, s).into_iter().zip(before.into_iter().zip(after))
            {
                assert!((slope - (b - a) / (2.0 * step * h)).abs() < 1e-8, "at {s}");
            }
        }
    }

    #[test]
    fn consistent_matrix_integrates_the_shape_functions() {
        // Four-point Gauss quadrature is exact for the products, of degree six.
        let h = 0.5;
        let (a, b) = (0.861_136_311_594_052_6, 0.339_981_043_584_856_3);
        let (wa, wb) = (0.347_854_845_137_453_85, 0.652_145_154_862_546_1);
        let mut integral = Matrix4::zeros();
        for (x, weight) in [(-a, wa), (-b, wb), (b, wb), (a, wa)] {
            let n = nalgebra::Vector4::from(shape_functions(h, (1.0 + x) / 2.0));
            integral += n * n.transpose() * (weight * h / 2.0);
        }
        assert!((integral - consistent(h)).amax() < 1e-15);
    }
}
