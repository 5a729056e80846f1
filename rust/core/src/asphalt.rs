//! Asphalt stiffness from temperature, loading time and composition (the paper's eqs. 7-8).
//!
//! Binder stiffness is Ullidtz's formula; mix stiffness is Heukelom and Klomp's, with the voids in
//! the mineral aggregate (VMA) in place of the volume concentration of the aggregate and 3 % of air.

use crate::error::{Result, check, positive};

/// Length of a tire print, m: at speed `v` a point is loaded for `0.3 / v` seconds.
pub const TIRE_PRINT: f64 = 0.300;

/// Binder stiffness `E_b`, Pa (eq. 8).
///
/// `E_b = 1.157e-7 t^-0.368 exp(-PI) (T_RB - T)^5` in MPa, with the loading time `t` in s, the
/// softening point `T_RB` (ring and ball) and the temperature `T` in degC, and the penetration
/// index `PI`.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) for a loading time that is not above 0, a
/// temperature not below the softening point, or a number that is not finite.
pub fn binder_stiffness(
    loading_time: f64,
    temperature_c: f64,
    softening_point_c: f64,
    penetration_index: f64,
) -> Result<f64> {
    positive("loading_time", loading_time, "s")?;
    check("softening_point_c", softening_point_c, "degC", "finite", |_| true)?;
    check("penetration_index", penetration_index, "", "finite", |_| true)?;
    let allowed = format!("below the softening point, {softening_point_c} degC");
    check("temperature_c", temperature_c, "degC", &allowed, |t| t < softening_point_c)?;
    let megapascal = 1.157e-7
        * loading_time.powf(-0.368)
        * (-penetration_index).exp()
        * (softening_point_c - temperature_c).powi(5);
    check("binder stiffness", megapascal * 1e6, "Pa", "finite and above 0", |e| e > 0.0)
}

/// Mix stiffness `E`, Pa, from the binder stiffness, Pa, and the VMA, % (eq. 7).
///
/// `E = E_b [1 + (257.5 - 2.5 VMA) / (n (VMA - 3))]^n` with `n = 0.83 log10(40 GPa / E_b)`.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) for a VMA outside 3 to 100 %, or a binder
/// stiffness outside 0 to 40 GPa (at 40 GPa, that of glass, `n` is zero).
pub fn mix_modulus(binder_stiffness: f64, vma: f64) -> Result<f64> {
    let limits = "above 0 and below 40 GPa";
    check("binder_stiffness", binder_stiffness, "Pa", limits, |e| e > 0.0 && e < 40e9)?;
    check("vma", vma, "%", "above 3 and below 100", |v| v > 3.0 && v < 100.0)?;
    let n = 0.83 * (40e9 / binder_stiffness).log10();
    let mix = binder_stiffness * (1.0 + (257.5 - 2.5 * vma) / (n * (vma - 3.0))).powf(n);
    check("mix stiffness", mix, "Pa", "finite and above 0", |e| e > 0.0)
}

/// Loading time at `speed`, s, from the speed in m/s.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) for a speed that is not above 0.
pub fn loading_time(speed: f64) -> Result<f64> {
    positive("loading time", TIRE_PRINT / positive("speed", speed, "m/s")?, "s")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nominal_moduli() -> Result<()> {
        let modulus = |pi, speed_kmh: f64, temperature| -> Result<f64> {
            let time = loading_time(speed_kmh / 3.6)?;
            mix_modulus(binder_stiffness(time, temperature, 60.0, pi)?, 25.0)
        };
        let cases = [
            (-1.0, 65.0, 20.0, 4.38521e9, 2e-6),
            (0.0, 65.0, 20.0, 2.163e9, 3e-4),
            (0.0, 25.0, 20.0, 1.673e9, 3e-4),
            (0.0, 105.0, 20.0, 2.457e9, 3e-4),
            (0.0, 65.0, 10.0, 4.747e9, 3e-4),
            (0.0, 65.0, 40.0, 0.149e9, 4e-3),
        ];
        for (pi, speed, temperature, expected, tolerance) in cases {
            let e = modulus(pi, speed, temperature)?;
            assert!((e / expected - 1.0).abs() < tolerance, "{e} against {expected}");
        }
        Ok(())
    }
}
