//! Closed forms that the numerical models are checked against, for tests, benches and users.

use nalgebra::Complex;

use crate::error::{Result, check, not_negative, positive};

/// Frequencies at which a force may vary, Hz, and as parts of that of the bed, about which waves
/// travel furthest.
const FREQUENCIES: [f64; 11] = [0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0];
const ABOUT_THE_BED: [f64; 7] = [0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0];

/// Wave numbers that are looked at for the slowest wave.
const WAVES: i32 = 400;

/// Reach, in decay lengths of the static deflection, that counts as infinite.
const FARTHEST: f64 = 1e6;

/// An infinite beam on a damped Winkler bed, `EI w'''' + c_EI w''''_t + m w_tt + c w_t + k w = p`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WinklerBeam {
    /// Bending stiffness `EI`, N m^2.
    pub bending_stiffness: f64,
    /// Bending damping `c_EI`, N m^2 s.
    pub bending_damping: f64,
    /// Mass `m` of beam and bed, kg/m.
    pub mass: f64,
    /// Bed damping `c`, N s/m^2.
    pub damping: f64,
    /// Bed stiffness `k`, N/m^2.
    pub stiffness: f64,
}

/// The steady state under a force that moves at constant speed.
///
/// With `xi = x - v t`, ahead of the force `w = P sum e^(s xi) / D'(s)` over the roots with
/// `Re s < 0` of `D(s) = -v c_EI s^5 + EI s^4 + m v^2 s^2 - v c s + k`, and behind it minus that sum
/// over the roots with `Re s > 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingLoad {
    /// Roots `s` and `1 / D'(s)`.
    roots: Vec<(Complex<f64>, Complex<f64>)>,
    /// Length over which the force is evenly spread, m; 0 is a point.
    print: f64,
}

impl WinklerBeam {
    /// Check the properties.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for one out of range.
    pub fn check(&self) -> Result<()> {
        positive("bending_stiffness", self.bending_stiffness, "N m^2")?;
        not_negative("bending_damping", self.bending_damping, "N m^2 s")?;
        positive("mass", self.mass, "kg/m")?;
        not_negative("damping", self.damping, "N s/m^2")?;
        positive("stiffness", self.stiffness, "N/m^2")?;
        Ok(())
    }

    /// `lambda = (k / 4 EI)^(1/4)`, 1/m: the decay of the static deflection.
    #[must_use]
    pub fn decay(&self) -> f64 {
        (self.stiffness / (4.0 * self.bending_stiffness)).powf(0.25)
    }

    /// Static deflection under a force of `force` newtons, m: `P lambda / 2k`, downwards positive.
    #[must_use]
    pub fn static_deflection(&self, force: f64) -> f64 {
        force * self.decay() / (2.0 * self.stiffness)
    }

    /// Static deflection `x` metres from the force: `w_0 e^(-l x) (cos l x + sin l x)`.
    #[must_use]
    pub fn static_deflection_at(&self, force: f64, x: f64) -> f64 {
        let lx = self.decay() * x.abs();
        self.static_deflection(force) * (-lx).exp() * (lx.cos() + lx.sin())
    }

    /// Static bending moment under the force, N m: `P / 4 lambda`.
    #[must_use]
    pub fn static_moment(&self, force: f64) -> f64 {
        force / (4.0 * self.decay())
    }

    /// Speed of the slowest free wave, m/s: `(4 k EI / m^2)^(1/4)`.
    #[must_use]
    pub fn critical_speed(&self) -> f64 {
        (4.0 * self.stiffness * self.bending_stiffness / (self.mass * self.mass)).powf(0.25)
    }

    /// The steady state at `speed`, m/s.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for a property out of range, or, without damping, a speed at or above the
    /// critical one: there is no steady state then.
    pub fn moving_load(&self, speed: f64) -> Result<MovingLoad> {
        self.check()?;
        not_negative("speed", speed, "m/s")?;
        if self.damping == 0.0 && self.bending_damping == 0.0 {
            let allowed = "below the critical speed, as nothing damps the beam";
            check("speed", speed, "m/s", allowed, |v| v < self.critical_speed())?;
        }
        let (l, coefficients) = (self.decay(), self.characteristic(speed, 0.0));
        let derivative = |s: Complex<f64>| {
            let power = |i: usize| s.powu(i as u32 - 1) * coefficients[i] * i as f64;
            (1..coefficients.len()).map(power).sum::<Complex<f64>>()
        };
        let roots = roots(&coefficients)
            .into_iter()
            .map(|s| (s * l, Complex::from(l) / derivative(s)))
            .collect();
        Ok(MovingLoad { roots, print: 0.0 })
    }

    /// How far ahead of a moving force, and behind it, the deflection is more than a part
    /// `tolerance` of that under it, m; infinite where nothing damps it out.
    ///
    /// From the slowest roots, ahead and behind, for a force that varies at some frequencies.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for a property or speed out of range.
    pub fn reach(&self, speed: f64, tolerance: f64) -> Result<[f64; 2]> {
        self.check()?;
        not_negative("speed", speed, "m/s")?;
        let (l, mut reach) = (self.decay(), [0.0_f64; 2]);
        let bed = (self.stiffness / self.mass).sqrt() / std::f64::consts::TAU;
        for frequency in FREQUENCIES.into_iter().chain(ABOUT_THE_BED.map(|part| part * bed)) {
            for s in roots(&self.characteristic(speed, frequency)) {
                let side = usize::from(s.re > 0.0);
                reach[side] = reach[side].max(-tolerance.ln() / (s.re.abs() * l));
            }
        }
        // A root that rounding alone keeps from the imaginary axis decays nowhere.
        Ok(reach.map(|length| if length * l < FARTHEST { length } else { f64::INFINITY }))
    }

    /// How long a deflection lasts until it is no more than a part `tolerance` of that under a
    /// force, s; infinite where nothing damps it out.
    ///
    /// A wave of the wave number `q` has a share `k / (k + EI q^4)` of the static deflection and the
    /// slowest root of `m s^2 + (c + c_EI q^4) s + k + EI q^4 = 0` as its decay.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for a property out of range.
    pub fn memory(&self, tolerance: f64) -> Result<f64> {
        self.check()?;
        let lasts = |i: i32| {
            // Shares from one down to the tolerance.
            let share = tolerance.powf(f64::from(i) / f64::from(WAVES));
            let stiffness = self.stiffness / share;
            let bending = (stiffness - self.stiffness) / self.bending_stiffness;
            let half = 0.5 * (self.damping + self.bending_damping * bending) / self.mass;
            (share / tolerance).ln() / slowest(half, stiffness / self.mass)
        };
        Ok((0..WAVES).map(lasts).fold(0.0, f64::max))
    }

    /// How long half a wave between two bars lasts, s, which only the beam itself damps.
    #[must_use]
    pub fn memory_without_bed(&self, tolerance: f64, spacing: f64) -> f64 {
        let bending = (std::f64::consts::PI / spacing).powi(4);
        let half = 0.5 * self.bending_damping * bending / self.mass;
        -tolerance.ln() / slowest(half, self.bending_stiffness * bending / self.mass)
    }

    /// Coefficients of `EI s^4 + c_EI s^4 d + m d^2 + c d + k` with `d = i o - v s`, in powers of
    /// `s / lambda`, for a force that moves at `speed` and varies as `e^(i o t)`, at `frequency` Hz.
    fn characteristic(&self, speed: f64, frequency: f64) -> [Complex<f64>; 6] {
        // Lengths in units of 1 / lambda keep the coefficients of one size.
        let (v, l) = (speed, self.decay());
        let d = Complex::new(0.0, std::f64::consts::TAU * frequency);
        let real = Complex::from;
        [
            d * d * self.mass + d * self.damping + self.stiffness,
            -(d * (2.0 * self.mass) + self.damping) * v * l,
            real(self.mass * v * v * l * l),
            real(0.0),
            (d * self.bending_damping + self.bending_stiffness) * l.powi(4),
            real(-v * self.bending_damping * l.powi(5)),
        ]
    }
}

impl MovingLoad {
    /// The same force evenly spread over a length of `print` metres about its place.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for a negative or non-finite length.
    pub fn spread(self, print: f64) -> Result<Self> {
        not_negative("tire print", print, "m")?;
        Ok(Self { print, ..self })
    }

    /// Deflection `xi` metres ahead of (the middle of) a unit force, m/N, downwards positive.
    #[must_use]
    pub fn deflection(&self, xi: f64) -> f64 {
        if self.print == 0.0 {
            return self.sum(xi, |s, xi| (s * xi).exp());
        }
        // The integral of each exponential, from the place of the force on.
        let integral = |xi: f64| self.sum(xi, |s, xi| ((s * xi).exp() - 1.0) / s);
        let half = 0.5 * self.print;
        (integral(xi + half) - integral(xi - half)) / self.print
    }

    /// Sum of a function of the roots that decay on that side of the force.
    fn sum(&self, xi: f64, of: impl Fn(Complex<f64>, f64) -> Complex<f64>) -> f64 {
        let ahead = xi >= 0.0;
        let sign = if ahead { 1.0 } else { -1.0 };
        let decaying = self.roots.iter().filter(|(s, _)| (s.re < 0.0) == ahead);
        sign * decaying.map(|(s, factor)| (of(*s, xi) * factor).re).sum::<f64>()
    }

    /// Largest deflection under and near a unit force, m/N, and where it is, m ahead of the force.
    #[must_use]
    pub fn peak(&self) -> (f64, f64) {
        let slowest = self.roots.iter().map(|(s, _)| s.re.abs()).fold(f64::INFINITY, f64::min);
        let far = 8.0 / slowest + 0.5 * self.print;
        let (mut low, mut high) = (-far, far);
        // A scan finds the peak, then the golden section narrows it.
        let shortest = self.roots.iter().map(|(s, _)| s.im.abs()).fold(slowest, f64::max);
        let points = ((high - low) * shortest * 4.0).clamp(4000.0, 1e6) as i32;
        let step = (high - low) / f64::from(points);
        let at = |i: i32| low + step * f64::from(i);
        let best =
            (0..=points).max_by(|a, b| self.deflection(at(*a)).total_cmp(&self.deflection(at(*b))));
        let centre = at(best.unwrap_or(points / 2));
        (low, high) = (centre - step, centre + step);
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        for _ in 0..60 {
            let (a, b) = (high - golden * (high - low), low + golden * (high - low));
            if self.deflection(a) > self.deflection(b) { high = b } else { low = a }
        }
        let xi = 0.5 * (low + high);
        (self.deflection(xi), xi)
    }
}

/// Decay of the slowest motion of `s^2 + 2 half s + square = 0`, 1/s.
fn slowest(half: f64, square: f64) -> f64 {
    let rest = half * half - square;
    // The product of the roots is `square`; their difference would lose its digits.
    if rest > 0.0 { square / (half + rest.sqrt()) } else { half }
}

/// Roots of `sum c_i s^i`, by the simultaneous iteration of Durand and Kerner.
fn roots(coefficients: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let largest = coefficients.iter().fold(0.0_f64, |largest, c| largest.max(c.norm()));
    // A negligible leading term has its root so far out that it decays at once.
    let counts = |c: &Complex<f64>| c.norm() > 1e-13 * largest;
    let degree = coefficients.iter().rposition(counts).unwrap_or(0);
    let leading = coefficients[degree];
    let value = |s: Complex<f64>| {
        let horner = |value: Complex<f64>, c: &Complex<f64>| value * s + c / leading;
        coefficients[..=degree].iter().rev().fold(Complex::from(0.0), horner)
    };
    // No start is real or a root of unity, which symmetry could keep from converging.
    let mut found: Vec<_> = (0..degree).map(|i| Complex::new(0.4, 0.9).powu(i as u32)).collect();
    for _ in 0..500 {
        let mut largest = 0.0_f64;
        for i in 0..degree {
            let s = found[i];
            let others = found.iter().enumerate().filter(|(j, _)| *j != i);
            let product: Complex<f64> = others.map(|(_, other)| s - other).product();
            let change = value(s) / product;
            found[i] -= change;
            largest = largest.max(change.norm() / found[i].norm());
        }
        if largest < 4.0 * f64::EPSILON {
            break;
        }
    }
    found
}

/// A simply supported beam without a foundation, from rest, under a force that crosses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimplySupportedBeam {
    /// Span, m.
    pub length: f64,
    /// Bending stiffness `EI`, N m^2.
    pub bending_stiffness: f64,
    /// Mass, kg/m.
    pub mass: f64,
}

impl SimplySupportedBeam {
    /// Check the properties.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for one out of range.
    pub fn check(&self) -> Result<()> {
        positive("length", self.length, "m")?;
        positive("bending_stiffness", self.bending_stiffness, "N m^2")?;
        positive("mass", self.mass, "kg/m")?;
        Ok(())
    }

    /// Static deflection at mid-span under a force there, m: `P L^3 / 48 EI`.
    #[must_use]
    pub fn static_deflection(&self, force: f64) -> f64 {
        force * self.length.powi(3) / (48.0 * self.bending_stiffness)
    }

    /// Deflection at `x` while the force is at `speed * time` on the beam, m, downwards positive, by
    /// `modes` terms of the modal series (Fryba, Vibration of solids and structures under moving
    /// loads, ch. 1):
    /// `w = sum 2P/(mL) sin(n pi x/L) [sin(O t) - (O/o) sin(o t)] / (o^2 - O^2)` with the mode's
    /// frequency `o` and the load's `O = n pi v / L`.
    #[must_use]
    pub fn moving_load(&self, force: f64, speed: f64, x: f64, time: f64, modes: usize) -> f64 {
        let mode = |n: usize| {
            let k = n as f64 * std::f64::consts::PI / self.length;
            let own = k * k * (self.bending_stiffness / self.mass).sqrt();
            let load = k * speed;
            let amplitude = 2.0 * force / (self.mass * self.length) * (k * x).sin();
            if (own / load - 1.0).abs() < 1e-7 {
                // At resonance, the limit of the quotient.
                let phase = own * time;
                return amplitude * (phase.sin() - phase * phase.cos()) / (2.0 * own * own);
            }
            amplitude * ((load * time).sin() - load / own * (own * time).sin())
                / (own * own - load * load)
        };
        (1..=modes).map(mode).sum()
    }
}

impl From<&crate::pavement::Section> for WinklerBeam {
    /// The infinite beam of a section's constants.
    fn from(section: &crate::pavement::Section) -> Self {
        Self {
            bending_stiffness: section.bending_stiffness,
            bending_damping: section.bending_damping,
            mass: section.mass + section.bed.mass,
            damping: section.bed.damping,
            stiffness: section.bed.stiffness,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    /// Numbers that follow from the textbook formulas for EI 75 000, m 2000, k 1.2e8, P 40 kN.
    fn beam(zeta: f64) -> WinklerBeam {
        let (mass, stiffness) = (2000.0, 1.2e8_f64);
        let damping = zeta * 2.0 * (stiffness * mass).sqrt();
        WinklerBeam { bending_stiffness: 75e3, bending_damping: 0.0, mass, damping, stiffness }
    }

    #[test]
    fn static_and_critical_values() {
        let beam = beam(0.0);
        assert!((beam.decay() - 4.472136).abs() < 1e-6);
        assert!((beam.static_deflection(40e3) - 0.745356e-3).abs() < 1e-9);
        assert!((beam.static_moment(40e3) - 2236.068).abs() < 1e-3);
        assert!((beam.critical_speed() - 54.7723).abs() < 1e-4);
    }

    #[test]
    fn peak_of_the_moving_load() -> Result<()> {
        for (zeta, ratio, peak) in
            [(0.0, 0.5, 1.15470), (0.1, 0.5, 1.15027), (1.0, 0.5, 0.89144), (0.1, 0.9, 2.06040)]
        {
            let beam = beam(zeta);
            let moving = beam.moving_load(ratio * beam.critical_speed())?;
            let found = moving.peak().0 / beam.static_deflection(1.0);
            assert!((found - peak).abs() < 1e-5, "{found} against {peak}");
        }
        Ok(())
    }

    #[test]
    fn at_rest_it_is_the_static_deflection() -> Result<()> {
        let beam = beam(0.3);
        let moving = beam.moving_load(0.0)?;
        for xi in [-0.7, -0.1, 0.0, 0.2, 1.0] {
            let expected = beam.static_deflection_at(1.0, xi);
            assert!((moving.deflection(xi) - expected).abs() < 1e-12 * beam.static_deflection(1.0));
        }
        Ok(())
    }

    /// The mean over a print by the midpoint rule, which is of second order.
    #[test]
    fn a_print_is_the_mean_of_points() -> Result<()> {
        let beam = WinklerBeam { bending_damping: 100.0, ..beam(0.3) };
        let (moving, print) = (beam.moving_load(25.0)?, 0.3);
        let spread = moving.clone().spread(print)?;
        for xi in [-0.6, -0.15, -0.02, 0.0, 0.1, 0.4] {
            let at = |i: i32| moving.deflection(xi + print * ((f64::from(i) + 0.5) / 2000.0 - 0.5));
            let expected = (0..2000).map(at).sum::<f64>() / 2000.0;
            let error = (spread.deflection(xi) - expected).abs();
            assert!(error < 1e-7 * moving.peak().0, "{xi}: {error}");
        }
        let (peak, xi) = spread.peak();
        assert!(peak < moving.peak().0 && peak >= spread.deflection(xi + 1e-3));
        assert!(matches!(moving.spread(-0.1), Err(Error::Invalid { .. })));
        Ok(())
    }

    #[test]
    fn roots_of_known_polynomials() {
        // (s - 1)(s + 2)(s^2 + 9) and s^4 + 4
        for coefficients in [[-18.0, 9.0, 7.0, 1.0, 1.0], [4.0, 0.0, 0.0, 0.0, 1.0]] {
            for s in roots(&coefficients.map(Complex::from)) {
                let powers = coefficients.iter().enumerate();
                let value: Complex<f64> = powers.map(|(i, c)| s.powu(i as u32) * *c).sum();
                assert!(value.norm() < 1e-12, "{s} gives {value}");
            }
        }
    }

    #[test]
    fn no_steady_state_without_damping_above_the_critical_speed() {
        let beam = beam(0.0);
        assert!(matches!(beam.moving_load(60.0), Err(Error::Invalid { .. })));
    }
}
