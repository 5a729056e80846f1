//! A pitch-plane vehicle from bodies, springs and tires, and its tire forces over a profile.
//!
//! Places are metres behind the front axle, `z` is up positive, and a body's pitch is the slope of
//! its line, positive with the tail up. `M`, `C` and `K` are sums of energy rows: the vertical
//! place of any point is a row of coefficients of the unknowns, a mass adds `m r' r`, a spring
//! between two points adds `k (r_1 - r_2)' (r_1 - r_2)`, and a tire adds `k r' r`.
//!
//! A body pinned to another has its pitch as its only unknown. A walking (equalizing) beam is such
//! a body, and so is a semitrailer on its fifth wheel.

use nalgebra::DVector;

use crate::error::{
    Error, Result, Watch, check, check_count, go_on, invalid, not_negative, positive, reserve,
    unwatched,
};
use crate::linalg::{DMatrix, Lu};
use crate::transition::{Form, System, Transition};

/// Standard gravity as the paper rounds it, m/s^2.
pub const GRAVITY: f64 = 9.81;

/// A rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Mass, kg.
    pub mass: f64,
    /// Pitch moment of inertia about its centre of gravity, kg m^2; 0 for a body that only bounces.
    pub inertia: f64,
    /// Place of its centre of gravity, m behind the front axle.
    pub x: f64,
    /// The body it is pinned to (an earlier one) and the place of the pin.
    pub pin: Option<(usize, f64)>,
}

/// A point of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Number of the body.
    pub body: usize,
    /// Place, m behind the front axle.
    pub x: f64,
}

/// A spring and a damper between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Its upper end.
    pub upper: Point,
    /// Its lower end.
    pub lower: Point,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
}

/// The tires of one axle: a spring and a damper between a point and the road below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tire {
    /// Where it carries the vehicle; the road is felt at the same place.
    pub point: Point,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
}

/// A vehicle ready to run: its matrices, tires and static loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Vehicle {
    system: System,
    tires: Vec<Tire>,
    /// Coefficients of each tire's compression.
    rows: Vec<DVector<f64>>,
    static_loads: Vec<f64>,
}

/// Numbers of a body's unknowns: its bounce where it is not pinned, its pitch where it has inertia.
#[derive(Debug, Clone, Copy)]
struct Unknowns {
    bounce: Option<usize>,
    pitch: Option<usize>,
}

/// Bodies with their unknowns numbered.
struct Frame<'a> {
    bodies: &'a [Body],
    unknowns: Vec<Unknowns>,
    n: usize,
}

impl<'a> Frame<'a> {
    fn new(bodies: &'a [Body]) -> Result<Self> {
        let mut n = 0;
        let mut next = || {
            n += 1;
            n - 1
        };
        let mut unknowns = Vec::with_capacity(bodies.len());
        for (number, body) in bodies.iter().enumerate() {
            let name = |quantity: &str| format!("body {number}: {quantity}");
            not_negative(&name("mass"), body.mass, "kg")?;
            not_negative(&name("inertia"), body.inertia, "kg m^2")?;
            check(&name("x"), body.x, "m", "finite", |_| true)?;
            if let Some((to, x)) = body.pin {
                let earlier = "the number of an earlier body";
                check_count(&name("pinned to"), to, earlier, |to| to < number)?;
                check(&name("pin"), x, "m", "finite", |_| true)?;
                positive(&name("inertia of a pinned body"), body.inertia, "kg m^2")?;
            } else {
                positive(&name("mass"), body.mass, "kg")?;
            }
            let bounce = body.pin.is_none().then(&mut next);
            let pitch = (body.inertia > 0.0).then(&mut next);
            unknowns.push(Unknowns { bounce, pitch });
        }
        Ok(Self { bodies, unknowns, n })
    }

    /// Coefficients of the height of a point.
    fn height(&self, point: Point) -> DVector<f64> {
        let (body, own) = (&self.bodies[point.body], self.unknowns[point.body]);
        let (mut row, origin) = match body.pin {
            Some((to, x)) => (self.height(Point { body: to, x }), x),
            None => (DVector::zeros(self.n), body.x),
        };
        if let Some(bounce) = own.bounce {
            row[bounce] = 1.0;
        }
        if let Some(pitch) = own.pitch {
            row[pitch] = point.x - origin;
        }
        row
    }

    fn check_point(&self, name: &str, point: Point) -> Result<()> {
        let bodies = self.bodies.len();
        let allowed = format!("one of the {bodies} bodies");
        check_count(&format!("{name}: body"), point.body, &allowed, |body| body < bodies)?;
        check(&format!("{name}: x"), point.x, "m", "finite", |_| true)?;
        Ok(())
    }
}

impl Vehicle {
    /// Build the matrices and solve the static loads.
    ///
    /// Unknowns are numbered body by body: bounce (unless pinned), then pitch (where it has
    /// inertia).
    ///
    /// # Errors
    /// [`Error::Invalid`] for a property out of range, a reference to no body, or a tire that does
    /// not press on the road at rest; [`Error::Singular`] where a body is not held up.
    pub fn new(bodies: &[Body], springs: &[Spring], tires: &[Tire]) -> Result<Self> {
        check_count("number of bodies", bodies.len(), "at least 1", |bodies| bodies >= 1)?;
        check_count("number of tires", tires.len(), "at least 1", |tires| tires >= 1)?;
        let frame = Frame::new(bodies)?;
        let n = frame.n;
        let mut mass = DMatrix::zeros(n, n);
        let mut damping = DMatrix::zeros(n, n);
        let mut stiffness = DMatrix::zeros(n, n);
        let mut weight = DVector::zeros(n);
        let add = |matrix: &mut DMatrix<f64>, factor: f64, row: &DVector<f64>| {
            matrix.ger(factor, row, row, 1.0);
        };
        for (number, body) in bodies.iter().enumerate() {
            let row = frame.height(Point { body: number, x: body.x });
            add(&mut mass, body.mass, &row);
            weight -= row * (body.mass * GRAVITY);
            if let Some(pitch) = frame.unknowns[number].pitch {
                mass[(pitch, pitch)] += body.inertia;
            }
        }
        for (number, spring) in springs.iter().enumerate() {
            let name = |quantity: &str| format!("spring {number}: {quantity}");
            frame.check_point(&name("upper end"), spring.upper)?;
            frame.check_point(&name("lower end"), spring.lower)?;
            positive(&name("stiffness"), spring.stiffness, "N/m")?;
            not_negative(&name("damping"), spring.damping, "N s/m")?;
            let row = frame.height(spring.upper) - frame.height(spring.lower);
            add(&mut stiffness, spring.stiffness, &row);
            add(&mut damping, spring.damping, &row);
        }
        let mut rows = Vec::with_capacity(tires.len());
        for (number, tire) in tires.iter().enumerate() {
            let name = |quantity: &str| format!("tire {number}: {quantity}");
            frame.check_point(&name("point"), tire.point)?;
            positive(&name("stiffness"), tire.stiffness, "N/m")?;
            not_negative(&name("damping"), tire.damping, "N s/m")?;
            let row = frame.height(tire.point);
            add(&mut stiffness, tire.stiffness, &row);
            add(&mut damping, tire.damping, &row);
            rows.push(row);
        }
        let advice = "; some body is not held up by springs and tires";
        let lu = Lu::new("vehicle's stiffness matrix", &stiffness, advice)?;
        let mut rest = DMatrix::from_column_slice(n, 1, weight.as_slice());
        lu.solve_in_place(&mut rest);
        let mut static_loads = Vec::with_capacity(tires.len());
        for (number, (tire, row)) in tires.iter().zip(&rows).enumerate() {
            let name = format!("tire {number}: static load");
            let load = -tire.stiffness * row.dot(&rest.column(0));
            static_loads.push(positive(&name, load, "N")?);
        }
        let system = System::from_dense(&mass, &damping, &stiffness)?;
        Ok(Self { system, tires: tires.to_vec(), rows, static_loads })
    }

    /// `M`, `C`, `K` about the state of rest, the road held still.
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Static load of each tire, N, solved from the weights and springs.
    #[must_use]
    pub fn static_loads(&self) -> &[f64] {
        &self.static_loads
    }

    /// Tire forces over a road at constant speed.
    ///
    /// The vehicle starts at rest, at equilibrium on the level of the profile's first sample, with
    /// the front axle at `start` (a station of the profile); beyond its ends the profile goes on
    /// level. `skip` steps are left out of the answer, `steps` more are kept along with the instant
    /// they start from. The answer has `steps + 1` rows of one force a tire, N, positive pressing on
    /// the road: `F = F_static + k (z_p - z) + c (dz_p/dt - dz/dt)`.
    ///
    /// Within a step the input is taken as linear in time, which the transition matrix follows
    /// exactly: the elevation between its values at both ends of the step (or, for a staircase, its
    /// mean), so that a kink or a jump costs no more than the second order in `dt`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a speed or time step that is not above 0, [`Error::Diverged`],
    /// [`Error::Stopped`].
    pub fn tire_forces(
        &self,
        profile: &Profile<'_>,
        run: &Run,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<f64>> {
        positive("speed", run.speed, "m/s")?;
        check("start", run.start, "m", "finite", |_| true)?;
        let total = run.skip.saturating_add(run.steps);
        check_count("steps", total, "at most 1e9", |steps| steps <= 1_000_000_000)?;
        // A handful of unknowns: done before anyone could ask.
        let transition =
            Transition::new(self.system.clone(), run.dt, Form::Integral, &mut unwatched)?;
        let (gamma, ramp) = (transition.gamma(), transition.ramp());
        let inputs: Vec<_> = self.rows.iter().map(|row| (&gamma * row, &ramp * row)).collect();
        let phi = transition.phi().to_dense();
        let n = self.system.len();
        let mut state = DVector::zeros(2 * n);
        let mut next = state.clone();
        let mut wheels: Vec<Wheel<'_>> = self.tires.iter().map(|_| Wheel::new(profile)).collect();
        let mut forces = Vec::new();
        reserve(&mut forces, (run.steps + 1) * self.tires.len())?;
        for step in 0..=total {
            if step % 1024 == 0 {
                go_on(watch, step, total)?;
            }
            next.gemv(1.0, &phi, &state, 0.0);
            let front = run.start + run.speed * run.dt * step as f64;
            for (i, (tire, wheel)) in self.tires.iter().zip(&mut wheels).enumerate() {
                let road = wheel.roll(front - tire.point.x, run.speed, run.dt);
                if step >= run.skip {
                    let row = &self.rows[i];
                    let compression = road.elevation - row.dot(&state.rows(0, n));
                    let rate = road.velocity - row.dot(&state.rows(n, n));
                    let force = tire.stiffness * compression + tire.damping * rate;
                    forces.push(self.static_loads[i] + force);
                }
                let damper = tire.damping * road.mean_velocity;
                let (begin, end) = (road.begin, road.end);
                let (held, growing) = &inputs[i];
                next.axpy(tire.stiffness * begin + damper, held, 1.0);
                next.axpy(tire.stiffness * (end - begin), growing, 1.0);
            }
            std::mem::swap(&mut state, &mut next);
        }
        match forces.iter().position(|force| !force.is_finite()) {
            None => Ok(forces),
            Some(at) => {
                let step = run.skip + at / self.tires.len();
                let time = step as f64 * run.dt;
                Err(Error::Diverged { quantity: "tire force", step, time })
            }
        }
    }
}

/// How a tire feels the samples of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight lines between samples.
    Linear,
    /// The elevation of a sample up to the next one (the paper's segments of constant elevation).
    /// The road has no vertical velocity within a segment, and dampers do not feel the jumps.
    Staircase,
}

/// A road profile: elevations `z` at increasing stations `x`, m, of one length.
#[derive(Debug, Clone, Copy)]
pub struct Profile<'a> {
    x: &'a [f64],
    z: &'a [f64],
    interpolation: Interpolation,
}

/// One run over a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Speed, m/s.
    pub speed: f64,
    /// Time step, s.
    pub dt: f64,
    /// Station of the front axle when the run starts, m.
    pub start: f64,
    /// Steps before the first one that is kept.
    pub skip: usize,
    /// Steps that are kept.
    pub steps: usize,
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
}

/// What the road does to one tire during one step, elevations counted from the first sample.
struct Contact {
    elevation: f64,
    velocity: f64,
    begin: f64,
    end: f64,
    mean_velocity: f64,
}

/// A wheel's place among the samples; it only moves forward.
struct Wheel<'a> {
    profile: &'a Profile<'a>,
    /// The last sample not ahead of the wheel.
    sample: usize,
}

impl<'a> Wheel<'a> {
    fn new(profile: &'a Profile<'a>) -> Self {
        Self { profile, sample: 0 }
    }

    /// The step from `x` to `x + speed dt`.
    fn roll(&mut self, x: f64, speed: f64, dt: f64) -> Contact {
        let ahead = x + speed * dt;
        // A sample that a wheel stands on but for rounding is reached, whatever the origin of x.
        let reached = x + 1e-6 * speed * dt;
        self.sample = self.last_sample_before(reached, self.sample);
        match self.profile.interpolation {
            Interpolation::Linear => {
                let (elevation, slope) = self.line(self.sample, x);
                let (end, _) = self.line(self.last_sample_before(ahead, self.sample), ahead);
                let mean_velocity = (end - elevation) / dt;
                let velocity = slope * speed;
                Contact { elevation, velocity, begin: elevation, end, mean_velocity }
            }
            Interpolation::Staircase => {
                let Profile { x: stations, z, .. } = self.profile;
                let (mut sum, mut from, mut sample) = (0.0, x, self.sample);
                while sample + 1 < stations.len() && stations[sample + 1] < ahead {
                    sum += (z[sample] - z[0]) * (stations[sample + 1] - from);
                    from = stations[sample + 1];
                    sample += 1;
                }
                sum += (z[sample] - z[0]) * (ahead - from);
                // So far out that a step is lost in rounding, the road is level.
                let mean = if ahead > x { sum / (ahead - x) } else { z[sample] - z[0] };
                let elevation = z[self.sample] - z[0];
                Contact { elevation, velocity: 0.0, begin: mean, end: mean, mean_velocity: 0.0 }
            }
        }
    }

    fn last_sample_before(&self, x: f64, from: usize) -> usize {
        let ahead = self.profile.x[from + 1..].iter().take_while(|station| **station <= x);
        from + ahead.count()
    }

    /// Elevation and slope of the line after `sample`, level beyond the ends.
    fn line(&self, sample: usize, x: f64) -> (f64, f64) {
        let Profile { x: stations, z, .. } = self.profile;
        if sample + 1 == stations.len() || x < stations[0] {
            return (z[sample] - z[0], 0.0);
        }
        let slope = (z[sample + 1] - z[sample]) / (stations[sample + 1] - stations[sample]);
        (z[sample] - z[0] + slope * (x - stations[sample]), slope)
    }
}
