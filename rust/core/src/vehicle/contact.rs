//! The road as a tire feels it: a profile between its samples, under a point or a tire print.

use crate::error::{Error, Result, check_count, invalid};

/// How a tire feels the samples of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines between samples.
    Linear,
    /// The elevation of a sample up to the next one (the paper's segments of constant elevation).
    /// The road has no vertical velocity within a segment, and dampers do not feel the jumps.
    Staircase,
}

impl Interpolation {
    /// Whether what a tire of such a print feels jumps.
    #[inline(always)]
    pub(super) fn jumps(self, print: f64) -> bool {
        print == 0.0 && self == Self::Staircase
    }
}

/// A road profile: elevations `z` at increasing stations `x`, m, of one length; level beyond its
/// ends. Elevations count from the first sample.
#[derive(Debug, Clone, Copy)]
pub struct Profile<'a> {
    x: &'a [f64],
    z: &'a [f64],
    interpolation: Interpolation,
}

impl<'a> Profile<'a> {
    /// Check and hold the samples.
    ///
    /// # Errors
    /// [`Error::Invalid`] for fewer than two samples, arrays of different length, numbers that are
    /// not finite, or stations that do not increase.
    pub fn new(x: &'a [f64], z: &'a [f64], interpolation: Interpolation) -> Result<Self> {
        check_count("samples of the profile", x.len(), "at least 2", |n| n >= 2)?;
        if x.len() != z.len() {
            return Err(Error::Shape {
                name: "elevations",
                got: (z.len(), 1),
                expected: (x.len(), 1),
            });
        }
        for (name, values) in [("station", x), ("elevation", z)] {
            if let Some(i) = values.iter().position(|value| !value.is_finite()) {
                return Err(invalid(format!("{name} {i}"), format!("{:?} m", values[i]), "finite"));
            }
        }
        if let Some(i) = x.windows(2).position(|pair| pair[1] <= pair[0]) {
            let allowed = format!("above the one before it, {:?} m", x[i]);
            let station = format!("station {}", i + 1);
            return Err(invalid(station, format!("{:?} m", x[i + 1]), allowed));
        }
        Ok(Self { x, z, interpolation })
    }

    /// Hold samples that were checked before.
    pub(crate) fn held(x: &'a [f64], z: &'a [f64], interpolation: Interpolation) -> Self {
        Self { x, z, interpolation }
    }

    /// How tires feel the samples.
    pub(crate) fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// A segment, which ends at the sample of its number; the first begins and the last ends nowhere.
    #[inline(always)]
    fn segment(&self, number: usize) -> Segment {
        let Self { x, z, interpolation } = *self;
        let last = x.len();
        let begin = if number == 0 { f64::NEG_INFINITY } else { x[number - 1] };
        let end = if number == last { f64::INFINITY } else { x[number] };
        let origin = x[number.max(1) - 1];
        let level = z[number.max(1) - 1] - z[0];
        let sloped = interpolation == Interpolation::Linear && number > 0 && number < last;
        let slope = if sloped { (z[number] - z[number - 1]) / (end - begin) } else { 0.0 };
        Segment { begin, end, origin, level, slope }
    }
}

/// A straight piece of the profile.
#[derive(Debug, Clone, Copy)]
struct Segment {
    begin: f64,
    end: f64,
    /// Where the elevation is `level`.
    origin: f64,
    level: f64,
    slope: f64,
}

impl Segment {
    #[inline(always)]
    fn elevation(&self, x: f64) -> f64 {
        self.level + self.slope * (x - self.origin)
    }
}

/// What a tire feels at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    /// Elevation, m.
    pub(super) elevation: f64,
    /// Its slope along the road.
    pub(super) slope: f64,
}

/// What a tire feels as long as it stands before `until`, by more than its [margin](Wheel::margin):
/// the elevation `level + slope (x - origin)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    pub(super) origin: f64,
    pub(super) level: f64,
    pub(super) slope: f64,
    pub(super) until: f64,
    /// What the mean elevation of a step has above the elevation at its beginning, where it jumps.
    pub(super) jump: f64,
}

/// A tire on the profile. It looks for its place from where it was last.
#[derive(Debug, Clone)]
pub(super) struct Wheel<'a> {
    profile: &'a Profile<'a>,
    print: f64,
    /// Under the rear end of the print.
    number: usize,
    segment: Segment,
}

impl<'a> Wheel<'a> {
    pub(super) fn new(profile: &'a Profile<'a>, print: f64) -> Self {
        Self { profile, print, number: 0, segment: profile.segment(0) }
    }

    /// Whether the elevation jumps: then a step takes its mean, else straight lines.
    #[inline(always)]
    pub(super) fn jumps(&self) -> bool {
        self.profile.interpolation.jumps(self.print)
    }

    /// How far ahead of a tire its line must go on.
    pub(super) fn margin(&self, reach: f64, nudge: f64) -> f64 {
        if self.jumps() { reach } else { nudge }
    }

    /// Go to `x`, however far that is.
    pub(super) fn find(&mut self, x: f64) {
        self.number = self.profile.x.partition_point(|&sample| sample <= x);
        self.segment = self.profile.segment(self.number);
    }

    /// The line under `x`, for steps of length `reach`.
    #[inline(always)]
    pub(super) fn line(&mut self, x: f64, reach: f64, nudge: f64) -> Line {
        let Touch { elevation, slope } = self.touch(x, nudge);
        let Segment { origin, level, end, .. } = self.segment;
        if self.print > 0.0 {
            let until = f64::NEG_INFINITY;
            return Line { origin: x, level: elevation, slope, until, jump: 0.0 };
        }
        if !self.jumps() {
            return Line { origin, level, slope, until: end, jump: 0.0 };
        }
        if x + reach <= end {
            return Line { origin, level, slope, until: end, jump: 0.0 };
        }
        let jump = self.mean(x, x + reach) - level;
        Line { origin, level, slope, until: f64::NEG_INFINITY, jump }
    }

    /// Elevation under `x`, and the slope just ahead of it; or just behind it for a `nudge` below 0.
    ///
    /// The `nudge` says how near a sample counts as the sample itself: so much that no rounding of
    /// `x` decides on which side of it the tire stands.
    #[inline(always)]
    pub(super) fn touch(&mut self, x: f64, nudge: f64) -> Touch {
        if self.print == 0.0 {
            self.seek(x + nudge);
            return Touch { elevation: self.segment.elevation(x), slope: self.segment.slope };
        }
        let (rear, front) = (x - 0.5 * self.print, x + 0.5 * self.print);
        self.seek(rear + nudge);
        let (mean, end) = self.sweep(rear, front, nudge);
        // So far out that the print is lost in rounding, the road is level.
        let length = if front > rear { front - rear } else { f64::INFINITY };
        let slope = (end.elevation(front) - self.segment.elevation(rear)) / length;
        Touch { elevation: mean, slope }
    }

    /// Mean elevation from `x`, where the wheel stands, to `ahead`.
    #[inline(always)]
    pub(super) fn mean(&mut self, x: f64, ahead: f64) -> f64 {
        self.seek(x);
        self.sweep(x, ahead, 0.0).0
    }

    /// Mean elevation between two places, the wheel being at the first, and the segment under the
    /// second.
    #[inline(always)]
    fn sweep(&self, from: f64, to: f64, nudge: f64) -> (f64, Segment) {
        let (mut area, mut at) = (0.0, from);
        let (mut number, mut segment) = (self.number, self.segment);
        while segment.end <= to + nudge {
            let end = segment.end;
            area += (end - at) * segment.elevation(0.5 * (at + end));
            at = end;
            number += 1;
            segment = self.profile.segment(number);
        }
        area += (to - at) * segment.elevation(0.5 * (at + to));
        let mean = if to > from { area / (to - from) } else { segment.elevation(to) };
        (mean, segment)
    }

    /// Move to the segment that `x` is on; the one ahead if it is on a sample.
    #[inline(always)]
    fn seek(&mut self, x: f64) {
        while x >= self.segment.end {
            self.number += 1;
            self.segment = self.profile.segment(self.number);
        }
        while x < self.segment.begin {
            self.number -= 1;
            self.segment = self.profile.segment(self.number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [f64; 5] = [0.0, 1.0, 1.5, 2.5, 4.0];
    const Z: [f64; 5] = [3.0, 3.2, 3.0, 3.4, 3.1];

    /// Mean of the elevation by the midpoint rule in 200 000 parts.
    fn mean_by_parts(profile: &Profile<'_>, from: f64, to: f64) -> f64 {
        let parts = 200_000;
        let width = (to - from) / f64::from(parts);
        let mut wheel = Wheel::new(profile, 0.0);
        let place = |i: i32| from + width * (f64::from(i) + 0.5);
        (0..parts).map(|i| wheel.touch(place(i), 0.0).elevation).sum::<f64>() / f64::from(parts)
    }

    #[test]
    fn a_print_feels_the_mean_elevation_and_the_slope_of_it() -> Result<()> {
        for interpolation in [Interpolation::Linear, Interpolation::Staircase] {
            let profile = Profile::new(&X, &Z, interpolation)?;
            let mut wheel = Wheel::new(&profile, 0.7);
            // Forward and back, over the ends too.
            for x in [-2.0, 0.1, 0.9, 1.3, 2.2, 3.9, 4.4, 9.0, 1.1, -0.2] {
                let touch = wheel.touch(x, 0.0);
                let mean = mean_by_parts(&profile, x - 0.35, x + 0.35);
                assert!((touch.elevation - mean).abs() < 1e-5, "{interpolation:?} at {x}");
                let step = 1e-6;
                let ahead = wheel.touch(x + step, 0.0).elevation;
                assert!((ahead - touch.elevation - step * touch.slope).abs() < 1e-9, "at {x}");
            }
        }
        Ok(())
    }

    #[test]
    fn a_point_takes_the_slope_of_either_side_as_asked() -> Result<()> {
        let profile = Profile::new(&X, &Z, Interpolation::Linear)?;
        let mut wheel = Wheel::new(&profile, 0.0);
        assert!((wheel.touch(1.0, 1e-9).slope + 0.4).abs() < 1e-12);
        assert!((wheel.touch(1.0, -1e-9).slope - 0.2).abs() < 1e-12);
        assert_eq!(wheel.touch(-5.0, 0.0), Touch { elevation: 0.0, slope: 0.0 });
        let beyond = wheel.touch(1e300, 0.0);
        assert!(beyond.slope == 0.0 && (beyond.elevation - 0.1).abs() < 1e-12);
        Ok(())
    }
}
