//! Transition matrix and particular response of `M u'' + C u' + K u = f` (the paper's eqs. 9-12).
//!
//! In state form, `y = (u, v)`, the system reads `y' = A y + B f` with
//! `A = [0 I; -M^-1 K, -M^-1 C]` and `B = [0; M^-1]`, and over one step of length `dt`
//!
//! ```text
//! y(t + dt) = Phi y(t) + Gamma f,   Phi = exp(A dt),   Gamma = int_0^dt exp(A s) ds B.
//! ```
//!
//! All blocks follow from two `n x n` matrices: the displacement `G(t)` and the velocity
//! `H(t) = G'(t)` that unit impulses leave behind. Because `Phi` commutes with `A`,
//!
//! ```text
//! Phi = [H M + G C,  G M;  -G K,  H M],     Gamma = [int_0^dt G ds;  G].
//! ```
//!
//! `M`, `C` and `K` of a strip or a truck are narrow bands, so this form halves what a step has to
//! read and the cost of a squaring, and cuts a term of the series to an eighth.
//!
//! The repeated integrals of `G` answer forces that last: `J = int G` a step, `Q = int J` a ramp.

use crate::error::{Error, Result, Watch, check, check_count, go_on, positive};
use crate::linalg::{
    Banded, DMatrix, Lu, add_scaled, check_finite, multiply, multiply_add, multiply_by,
    multiply_into, zeros,
};

/// Degrees of freedom above which a dense transition matrix is refused: 500 m of 0.5 m elements.
/// The dozen matrices of that size which a run holds take 400 MB.
pub const DENSE_LIMIT: usize = 2000;

/// Largest norm at which the series is summed without a further squaring: past it, a term costs
/// as many correct digits as the squaring it saves.
const SERIES_NORM: f64 = 1.0;

const STIFFNESS: &str = "stiffness matrix";
const INTEGRAL_ADVICE: &str = "; the integral form of the particular response needs no inverse";

/// Highest undamped frequency times `dt` up to which squaring takes `Phi` from `G` and `H` each time.
/// That multiplies rounding errors by the ratio of the highest frequency to the lowest; above, all
/// four blocks of `Phi - I` are squared, at twice the cost.
const BLOCK_FREQUENCY: f64 = 3.0;

/// `M u'' + C u' + K u = f`, each matrix stored by its band.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Mass matrix `M`, kg.
    pub mass: Banded,
    /// Damping matrix `C`, N s/m.
    pub damping: Banded,
    /// Stiffness matrix `K`, N/m.
    pub stiffness: Banded,
}

impl System {
    /// The system of three dense square matrices of one size.
    ///
    /// # Errors
    /// [`Error::Shape`] where a matrix is not square or differs in size from the mass matrix,
    /// [`Error::TooLarge`] above [`DENSE_LIMIT`], [`Error::NonFinite`].
    pub fn from_dense(
        mass: &DMatrix<f64>,
        damping: &DMatrix<f64>,
        stiffness: &DMatrix<f64>,
    ) -> Result<Self> {
        let n = mass.ncols();
        if n > DENSE_LIMIT {
            return Err(Error::TooLarge { unknowns: n, limit: DENSE_LIMIT });
        }
        let expected = (n, n);
        for (name, matrix) in
            [("mass matrix", mass), ("damping matrix", damping), ("stiffness matrix", stiffness)]
        {
            if matrix.shape() != expected {
                return Err(Error::Shape { name, got: matrix.shape(), expected });
            }
        }
        Ok(Self {
            mass: Banded::from_dense("mass matrix", mass)?,
            damping: Banded::from_dense("damping matrix", damping)?,
            stiffness: Banded::from_dense("stiffness matrix", stiffness)?,
        })
    }

    fn check(&self) -> Result<()> {
        let n = self.len();
        for (name, band) in
            [("damping matrix", &self.damping), ("stiffness matrix", &self.stiffness)]
        {
            if band.len() != n {
                return Err(Error::Shape { name, got: (band.len(), band.len()), expected: (n, n) });
            }
        }
        Ok(())
    }

    /// Degrees of freedom `n`.
    #[must_use]
    pub fn len(&self) -> usize {
        self.mass.len()
    }

    /// Whether it has no degree of freedom.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.mass.is_empty()
    }

    /// Bound of the 1-norm of `A dt`, and of the highest undamped frequency times `dt`, with
    /// velocities in the units that make the norm least and each unknown in units of one over the
    /// root of its own mass, so that no unit alters them.
    fn state_norm(&self, inverse_mass: &DMatrix<f64>, dt: f64) -> Result<(f64, f64)> {
        let scale: Vec<f64> = (0..self.len())
            .map(|i| self.mass.get(i, i).abs().sqrt().max(f64::MIN_POSITIVE))
            .collect();
        let norm_of = |matrix: &Banded| {
            let product = matrix.left_multiply(1.0, inverse_mass);
            let columns = product.as_slice().chunks_exact(self.len()).zip(&scale);
            columns
                .map(|(c, s)| c.iter().zip(&scale).map(|(x, r)| x.abs() * r).sum::<f64>() / s)
                .fold(0.0, |largest, sum| if sum > largest || sum.is_nan() { sum } else { largest })
        };
        let (k, c) = (dt * dt * norm_of(&self.stiffness), dt * norm_of(&self.damping));
        // |[0 s; k/s c]| is least where s = k/s + c.
        let norm = 0.5 * (c + (c * c + 4.0 * k).sqrt());
        check("norm of the state matrix times dt", norm, "", "below 1e15", |norm| norm < 1e15)?;
        Ok((norm, k.sqrt()))
    }
}

/// How the series of eq. (11) was summed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Series {
    /// Bound of the 1-norm of `A dt`, velocities scaled to make it least.
    pub norm: f64,
    /// Terms of the Taylor series, the unit matrix left out.
    pub terms: usize,
    /// Squarings: the series was summed at `dt / 2^squarings`.
    pub squarings: u32,
}

impl Series {
    /// The squarings that bring the norm to [`SERIES_NORM`], and the terms after which the
    /// remainder `x^(q+1) / (q+1)! / (1 - x / (q+2))` is below the rounding error.
    fn plan(norm: f64) -> Self {
        let squarings = (norm / SERIES_NORM).log2().ceil().max(0.0) as u32;
        let x = norm / f64::from(squarings).exp2();
        let mut terms = 1;
        let mut next = x * x / 2.0;
        while next / (1.0 - x / (terms as f64 + 2.0)) > 0.5 * f64::EPSILON {
            terms += 1;
            next *= x / (terms as f64 + 1.0);
        }
        Self { norm, terms, squarings }
    }
}

/// Which of three equal forms gives the particular response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// `Gamma = (I - Phi) [K^-1; 0]`: one LU of `K`.
    Stiffness,
    /// `Gamma = A^-1 (Phi - I) B`: one LU of the state matrix `A`, of twice the size.
    State,
    /// The integrals of the series, squared along with it: no inverse but that of `M`. The only
    /// form where `K` is singular, because then `A` is singular too.
    Integral,
}

/// The four blocks of `Phi - I`, each `n x n`: what is near one keeps its digits.
#[derive(Debug, Clone, PartialEq)]
pub struct Phi {
    uu: DMatrix<f64>,
    uv: DMatrix<f64>,
    vu: DMatrix<f64>,
    vv: DMatrix<f64>,
}

impl Phi {
    fn zeros(n: usize) -> Self {
        Self { uu: zeros(n, n), uv: zeros(n, n), vu: zeros(n, n), vv: zeros(n, n) }
    }

    /// From `H` and `G`; or, without their cancellation, from `G` and `J` where that is known, as
    /// `H M - I = -G C - J K`.
    fn set(&mut self, system: &System, levels: &Levels) {
        let System { mass, damping, stiffness } = system;
        let g = &levels.impulse;
        for block in self.blocks_mut() {
            block.as_mut_slice().fill(0.0);
        }
        mass.left_multiply_add(1.0, g, &mut self.uv);
        stiffness.left_multiply_add(-1.0, g, &mut self.vu);
        if let Some(j) = levels.integrals.first() {
            stiffness.left_multiply_add(-1.0, j, &mut self.uu);
            self.vv.copy_from(&self.uu);
            damping.left_multiply_add(-1.0, g, &mut self.vv);
        } else {
            mass.left_multiply_add(1.0, &levels.rate, &mut self.vv);
            add_diagonal(&mut self.vv, -1.0);
            self.uu.copy_from(&self.vv);
            damping.left_multiply_add(1.0, g, &mut self.uu);
        }
    }

    /// `Phi^2 - I = 2 Y + Y^2` with `Y = Phi - I`.
    fn squared(&self) -> Self {
        let mut square = self.clone();
        let products = [
            (&self.uu, &self.uu, &self.uv, &self.vu),
            (&self.uu, &self.uv, &self.uv, &self.vv),
            (&self.vu, &self.uu, &self.vv, &self.vu),
            (&self.vu, &self.uv, &self.vv, &self.vv),
        ];
        for ((out, once), (a, b, c, d)) in
            square.blocks_mut().into_iter().zip(self.blocks()).zip(products)
        {
            add_scaled(out.as_mut_slice(), 1.0, once.as_slice());
            multiply_add(out, 1.0, a, b);
            multiply_add(out, 1.0, c, d);
        }
        square
    }

    /// The blocks uu, uv, vu and vv of `Phi - I`.
    #[must_use]
    pub fn blocks(&self) -> [&DMatrix<f64>; 4] {
        [&self.uu, &self.uv, &self.vu, &self.vv]
    }

    /// From what [`Phi::blocks`] gave.
    #[must_use]
    pub fn from_blocks([uu, uv, vu, vv]: [DMatrix<f64>; 4]) -> Self {
        Self { uu, uv, vu, vv }
    }

    fn blocks_mut(&mut self) -> [&mut DMatrix<f64>; 4] {
        [&mut self.uu, &mut self.uv, &mut self.vu, &mut self.vv]
    }

    /// `Phi` as one `2n x 2n` matrix.
    #[must_use]
    pub fn to_dense(&self) -> DMatrix<f64> {
        let n = self.uu.nrows();
        let mut phi = DMatrix::zeros(2 * n, 2 * n);
        let blocks = [(0, 0, &self.uu), (0, n, &self.uv), (n, 0, &self.vu), (n, n, &self.vv)];
        for (row, column, block) in blocks {
            phi.view_mut((row, column), (n, n)).copy_from(block);
        }
        add_diagonal(&mut phi, 1.0);
        phi
    }
}

/// `H`, `G` and, where known, `J` and `Q` at one time: each the integral of the one before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Levels {
    /// The time, s.
    pub time: f64,
    /// `H`: velocity after a unit impulse, `n x n`, 1/kg.
    pub rate: DMatrix<f64>,
    /// `G`: displacement after a unit impulse, `n x n`, m/(N s).
    pub impulse: DMatrix<f64>,
    /// `J`: displacement under a unit step, `n x n`, m/N; then `Q`: under a unit ramp, m s/N.
    pub integrals: Vec<DMatrix<f64>>,
}

impl Levels {
    pub(crate) fn zeros(n: usize, integrals: usize) -> Self {
        let integrals = vec![zeros(n, n); integrals];
        Self { time: 0.0, rate: zeros(n, n), impulse: zeros(n, n), integrals }
    }

    /// Become the levels at `before.time + after.time`, given the `phi` of `after`.
    ///
    /// A level and the one before it are the displacement and velocity of a motion, which `phi`
    /// carries on; an integral adds to that what it had gathered by `after.time`.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub(crate) fn carry(
        &mut self,
        before: &Self,
        phi: &Phi,
        after: &Self,
        watch: &mut Watch<'_>,
    ) -> Result<()> {
        // Phi x = x + (Phi - I) x
        let mut carry =
            |out: &mut DMatrix<f64>, x: &DMatrix<f64>, pairs: [(&DMatrix<f64>, &_); 2]| {
                out.copy_from(x);
                for (block, level) in pairs {
                    go_on(watch, 0, 0)?;
                    multiply_add(out, 1.0, block, level);
                }
                Ok::<(), Error>(())
            };
        let (h, g) = (&before.rate, &before.impulse);
        self.time = before.time + after.time;
        carry(&mut self.rate, h, [(&phi.vu, g), (&phi.vv, h)])?;
        carry(&mut self.impulse, g, [(&phi.uu, g), (&phi.uv, h)])?;
        for (i, next) in self.integrals.iter_mut().enumerate() {
            let (x, w) = (before.level(i + 2), before.level(i + 1));
            carry(next, x, [(&phi.uu, x), (&phi.uv, w)])?;
            let mut factor = 1.0;
            for (power, gathered) in after.integrals[..=i].iter().rev().enumerate() {
                add_scaled(next.as_mut_slice(), factor, gathered.as_slice());
                factor *= before.time / (power + 1) as f64;
            }
        }
        Ok(())
    }

    /// `H`, `G`, `J` or `Q`, by number from 0.
    pub(crate) fn level(&self, number: usize) -> &DMatrix<f64> {
        match number {
            0 => &self.rate,
            1 => &self.impulse,
            _ => &self.integrals[number - 2],
        }
    }

    /// The Taylor series at a small `time`: `G = sum Y_k` with `Y_0 = 0`, `Y_1 = t M^-1` and
    /// `Y_(k+1) = -t/(k+1) (Y_k C + t/k Y_(k-1) K) M^-1`.
    ///
    /// (`Phi` commutes with `A`, so the bands may stand on the right, where whole columns combine.)
    fn series(
        system: &System,
        inverse_mass: &DMatrix<f64>,
        time: f64,
        terms: usize,
        integrals: usize,
        watch: &mut Watch<'_>,
    ) -> Result<Self> {
        let n = system.len();
        let zeros = || zeros(n, n);
        let (mut rate, mut impulse) = (zeros(), zeros());
        let mut integrals = vec![zeros(); integrals];
        let (mut before, mut force) = (zeros(), zeros());
        let mut term = multiply_by(inverse_mass, time);
        // The velocity needs one term more than the displacement.
        for k in 1..=terms + 1 {
            go_on(watch, k - 1, terms)?;
            let order = k as f64;
            let mut factor = order / time;
            let levels = [&mut rate, &mut impulse].into_iter().chain(&mut integrals);
            for (i, level) in levels.enumerate() {
                add_scaled(level.as_mut_slice(), factor, term.as_slice());
                factor *= time / (order + i as f64);
            }
            force.as_mut_slice().fill(0.0);
            system.damping.left_multiply_add(-time / (order + 1.0), &term, &mut force);
            let factor = -time * time / (order * (order + 1.0));
            system.stiffness.left_multiply_add(factor, &before, &mut force);
            multiply_into(&mut before, &force, inverse_mass);
            std::mem::swap(&mut before, &mut term);
        }
        Ok(Self { time, rate, impulse, integrals })
    }
}

/// `Phi` and the particular response of one system and time step.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    system: System,
    series: Series,
    /// `H`, `G`, `J` and `Q` at `dt`.
    levels: Levels,
    /// `Phi` as it was squared, where `H` and `G` would not give all its digits.
    squared: Option<Phi>,
}

impl Transition {
    /// Sum the series of eq. (11) for a step of `dt` seconds, and find the particular response.
    ///
    /// # Errors
    /// [`Error::Invalid`] for `dt` or an empty system, [`Error::TooLarge`] above [`DENSE_LIMIT`],
    /// [`Error::Singular`] for the mass matrix and for the matrix that `form` inverts,
    /// [`Error::NonFinite`] where the response overflows, and [`Error::Stopped`].
    pub fn new(system: System, dt: f64, form: Form, watch: &mut Watch<'_>) -> Result<Self> {
        check("time step dt", dt, "s", "1e-12 to 1e6", |dt| (1e-12..=1e6).contains(&dt))?;
        system.check()?;
        let n = system.len();
        check_count("number of free unknowns", n, "at least 1", |n| n >= 1)?;
        if n > DENSE_LIMIT {
            return Err(Error::TooLarge { unknowns: n, limit: DENSE_LIMIT });
        }
        let inverse_mass = Lu::new("mass matrix", &system.mass.to_dense(), "")?.inverse();
        let (norm, frequency) = system.state_norm(&inverse_mass, dt)?;
        let series = Series::plan(norm);
        let stiff = frequency > BLOCK_FREQUENCY;
        let start = dt / f64::from(series.squarings).exp2();
        let depth = match form {
            Form::Integral => 2,
            _ if stiff => 1,
            _ => 0,
        };
        let mut levels = Levels::series(&system, &inverse_mass, start, series.terms, depth, watch)?;
        let (mut phi, mut doubled) = (Phi::zeros(n), Levels::zeros(n, depth));
        phi.set(&system, &levels);
        for squaring in 0..series.squarings as usize {
            go_on(watch, squaring, series.squarings as usize)?;
            if form == Form::Integral || !stiff {
                doubled.carry(&levels, &phi, &levels, watch)?;
                std::mem::swap(&mut levels, &mut doubled);
            }
            if stiff {
                phi = phi.squared();
            } else {
                phi.set(&system, &levels);
            }
        }
        if stiff {
            multiply_into(&mut levels.impulse, &phi.uv, &inverse_mass);
            levels.rate.copy_from(&inverse_mass);
            multiply_add(&mut levels.rate, 1.0, &phi.vv, &inverse_mass);
        }
        levels.time = dt;
        check_finite("transition matrix", &levels.impulse)?;
        check_finite("transition matrix", &levels.rate)?;
        match form {
            Form::Integral => {}
            Form::Stiffness => levels.integrals = by_stiffness(&system, &levels, &phi)?,
            Form::State => levels.integrals = by_state(&system, &inverse_mass, &levels)?,
        }
        for integral in &levels.integrals {
            check_finite("particular response", integral)?;
        }
        let squared = stiff.then_some(phi);
        Ok(Self { system, series, levels, squared })
    }

    /// The transition by the stiffness form or, where that is singular or lost in rounding, by the
    /// integral form.
    ///
    /// # Errors
    /// As [`Transition::new`].
    pub fn of(system: &System, dt: f64, watch: &mut Watch<'_>) -> Result<Self> {
        match Self::new(system.clone(), dt, Form::Stiffness, watch) {
            Err(Error::Singular { name: STIFFNESS, .. } | Error::Cancelled { .. }) => {
                Self::new(system.clone(), dt, Form::Integral, watch)
            }
            found => found,
        }
    }

    /// A transition computed before, as [`Transition::levels`], [`Transition::series`] and
    /// [`Transition::squared`] gave it.
    ///
    /// # Errors
    /// [`Error::Shape`] where a level does not fit the system, [`Error::NonFinite`],
    /// [`Error::Invalid`] for the time or where `J` or `Q` is missing.
    pub fn from_levels(
        system: System,
        series: Series,
        levels: Levels,
        squared: Option<Phi>,
    ) -> Result<Self> {
        positive("time step dt", levels.time, "s")?;
        system.check()?;
        check_count("number of integrals", levels.integrals.len(), "2, J and Q", |found| {
            found == 2
        })?;
        let expected = (system.len(), system.len());
        let responses = (0..4).map(|number| levels.level(number));
        for block in responses.chain(squared.iter().flat_map(Phi::blocks)) {
            let name = "transition matrix";
            if block.shape() != expected {
                return Err(Error::Shape { name, got: block.shape(), expected });
            }
            check_finite(name, block)?;
        }
        Ok(Self { system, series, levels, squared })
    }

    /// The system.
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Time step, s.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.levels.time
    }

    /// How the series was summed.
    #[must_use]
    pub fn series(&self) -> Series {
        self.series
    }

    /// `H`, `G`, `J` and `Q` at `dt`.
    #[must_use]
    pub fn levels(&self) -> &Levels {
        &self.levels
    }

    /// `Phi` where it was squared as a whole, because `H` and `G` do not give all its digits.
    #[must_use]
    pub fn squared(&self) -> Option<&Phi> {
        self.squared.as_ref()
    }

    /// `Phi = exp(A dt)` for the state `(u, v)` (eq. 11).
    #[must_use]
    pub fn phi(&self) -> Phi {
        self.squared.clone().unwrap_or_else(|| {
            let mut phi = Phi::zeros(self.system.len());
            phi.set(&self.system, &self.levels);
            phi
        })
    }

    /// `Gamma = [J; G]`, `2n x n`: the state that a constant unit force leaves after a step (eq. 12).
    #[must_use]
    pub fn gamma(&self) -> DMatrix<f64> {
        stack(&self.levels.integrals[0], &self.levels.impulse)
    }

    /// `[Q; J] / dt`, `2n x n`: the state that a force leaves which grew linearly to a unit in a step.
    #[must_use]
    pub fn ramp(&self) -> DMatrix<f64> {
        let [step, ramp] = [&self.levels.integrals[0], &self.levels.integrals[1]];
        multiply_by(&stack(ramp, step), 1.0 / self.dt())
    }
}

fn add_diagonal(matrix: &mut DMatrix<f64>, by: f64) {
    for i in 0..matrix.nrows() {
        matrix[(i, i)] += by;
    }
}

/// `[upper; lower]`.
fn stack(upper: &DMatrix<f64>, lower: &DMatrix<f64>) -> DMatrix<f64> {
    let n = upper.nrows();
    let mut values = Vec::with_capacity(2 * upper.len());
    for (upper, lower) in upper.as_slice().chunks_exact(n).zip(lower.as_slice().chunks_exact(n)) {
        values.extend_from_slice(upper);
        values.extend_from_slice(lower);
    }
    DMatrix::from_vec(2 * n, upper.ncols(), values)
}

/// `J = (I - Phi_uu) K^-1`, and `Q = (dt I - G M - J C) K^-1` from the equation of motion
/// `G'' M + G' C + G K = 0`, integrated twice.
fn by_stiffness(system: &System, levels: &Levels, phi: &Phi) -> Result<Vec<DMatrix<f64>>> {
    let lu = Lu::new(STIFFNESS, &system.stiffness.to_dense(), INTEGRAL_ADVICE)?;
    let inverse = lu.inverse();
    let step = multiply_by(&multiply(&phi.uu, &inverse), -1.0);
    // Rounding leaves I - Phi_uu this much.
    check_digits("stiffness", f64::EPSILON * inverse.amax() / step.amax())?;
    let mut rest = system.mass.left_multiply(-1.0, &levels.impulse);
    system.damping.left_multiply_add(-1.0, &step, &mut rest);
    add_diagonal(&mut rest, levels.time);
    let ramp = multiply(&rest, &inverse);
    Ok(vec![step, ramp])
}

/// Most relative error accepted in a particular response that is a small difference.
const CANCELLATION_LIMIT: f64 = 1e-12;

fn check_digits(form: &'static str, error: f64) -> Result<()> {
    if error < CANCELLATION_LIMIT {
        return Ok(());
    }
    let name = "particular response";
    Err(Error::Cancelled { name, form, error, advice: INTEGRAL_ADVICE })
}

/// `J` and `Q` from `[J; G] = A^-1 ([G; H] - B)` and `[Q; J] = A^-1 ([J; G] - dt B)`.
fn by_state(
    system: &System,
    inverse_mass: &DMatrix<f64>,
    levels: &Levels,
) -> Result<Vec<DMatrix<f64>>> {
    let n = system.len();
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    a.view_mut((0, n), (n, n)).fill_with_identity();
    for (column, matrix) in [(0, &system.stiffness), (n, &system.damping)] {
        let block = multiply(inverse_mass, &matrix.to_dense());
        a.view_mut((n, column), (n, n)).copy_from(&-block);
    }
    let lu = Lu::new("state matrix A", &a, INTEGRAL_ADVICE)?;
    // The integral is A^-1 times a difference of size one, against one of the size of the step.
    let slowness = lu.inverse().view((0, 0), (n, 2 * n)).amax();
    check_digits("state", f64::EPSILON * slowness / levels.time)?;
    let mut state = stack(&levels.impulse, &levels.rate);
    let mut integrate = |constant: f64| {
        let mut lower = state.rows_mut(n, n);
        lower -= inverse_mass * constant;
        lu.solve_in_place(&mut state);
        state.rows(0, n).into_owned()
    };
    Ok(vec![integrate(1.0), integrate(levels.time)])
}
