//! Bodies, springs and tires to `M`, `C`, `K` and static loads.
//!
//! Places are metres behind the front axle, `z` is up positive, and a body's pitch is the slope of
//! its line, positive with the tail up. `M`, `C` and `K` are sums of energy rows: the vertical
//! place of any point is a row of coefficients of the unknowns, a mass adds `m r' r`, a spring of
//! stretch `r` adds `k r' r`, and a tire adds `k r' r`.
//!
//! A body pinned to another has its pitch as its only unknown. A walking (equalizing) beam is such
//! a body, and so is a semitrailer on its fifth wheel.

use nalgebra::DVector;

use crate::error::{Result, check, check_count, not_negative, positive};
use crate::linalg::{DMatrix, Lu};
use crate::transition::System;

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

/// A spring, a damper and dry friction, side by side between a body and one axle or several.
///
/// Its stretch is the height of the upper end less the mean height of the lower ones, so that
/// several axles share its force equally, as those on interconnected air springs do.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// Its upper end.
    pub upper: Point,
    /// Its lower ends.
    pub lower: Vec<Point>,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
    /// Dry friction, as between the leaves of a leaf spring.
    pub friction: Option<Friction>,
}

impl Spring {
    /// A spring and a damper between two points.
    #[must_use]
    pub fn between(upper: Point, lower: Point, stiffness: f64, damping: f64) -> Self {
        Self { upper, lower: vec![lower], stiffness, damping, friction: None }
    }
}

/// Dry friction that builds up over a travel: `dF = (sign(du) F_c - F) |du| / travel` for a stretch
/// `u`, from no force at rest.
///
/// This is the law of P. S. Fancher, R. D. Ervin, C. C. MacAdam, C. B. Winkler, "Measurement and
/// representation of the mechanical properties of truck leaf springs", SAE 800905 (1980), for what
/// a leaf spring's force has beyond its stiffness; P. R. Dahl's friction with a slope of
/// `F_c / travel`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Largest force `F_c`, N: half the height of the hysteresis loop.
    pub force: f64,
    /// Travel over which a change of direction takes effect by `1 - 1/e`, m.
    pub travel: f64,
}

/// The tires of one axle: a spring and a damper between a point and the road below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tire {
    /// Where it carries the vehicle; the road is felt about the same place.
    pub point: Point,
    /// Length of the tire print over which the road is averaged, m; 0 for a point.
    pub print: f64,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
}

impl Tire {
    /// Tires that touch the road in a point.
    #[must_use]
    pub fn at(point: Point, stiffness: f64, damping: f64) -> Self {
        Self { point, print: 0.0, stiffness, damping }
    }
}

/// A vehicle ready to run: its matrices, tires and static loads.
#[derive(Debug, Clone, PartialEq)]
pub struct Vehicle {
    system: System,
    pub(super) tires: Vec<Tire>,
    /// Coefficients of each tire's height.
    pub(super) rows: Vec<DVector<f64>>,
    static_loads: Vec<f64>,
    /// Dry friction, with the coefficients of the stretch that it resists.
    pub(super) frictions: Vec<(DVector<f64>, Friction)>,
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
        let mut frictions = Vec::new();
        for (number, spring) in springs.iter().enumerate() {
            let name = |quantity: &str| format!("spring {number}: {quantity}");
            frame.check_point(&name("upper end"), spring.upper)?;
            let ends = spring.lower.len();
            check_count(&name("lower ends"), ends, "at least 1", |ends| ends >= 1)?;
            not_negative(&name("stiffness"), spring.stiffness, "N/m")?;
            not_negative(&name("damping"), spring.damping, "N s/m")?;
            let mut row = frame.height(spring.upper);
            for &end in &spring.lower {
                frame.check_point(&name("lower end"), end)?;
                row.axpy(-1.0 / ends as f64, &frame.height(end), 1.0);
            }
            add(&mut stiffness, spring.stiffness, &row);
            add(&mut damping, spring.damping, &row);
            if let Some(friction) = spring.friction {
                positive(&name("friction"), friction.force, "N")?;
                positive(&name("travel of the friction"), friction.travel, "m")?;
                frictions.push((row, friction));
            }
        }
        let mut rows = Vec::with_capacity(tires.len());
        for (number, tire) in tires.iter().enumerate() {
            let name = |quantity: &str| format!("tire {number}: {quantity}");
            frame.check_point(&name("point"), tire.point)?;
            not_negative(&name("print"), tire.print, "m")?;
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
        Ok(Self { system, tires: tires.to_vec(), rows, static_loads, frictions })
    }

    /// `M`, `C`, `K` about the state of rest, the road held still.
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Places of the axles, m behind the front axle.
    pub(crate) fn axle_places(&self) -> impl Iterator<Item = f64> {
        self.tires.iter().map(|tire| tire.point.x)
    }

    /// Distance from the first to the last axle, m.
    pub(crate) fn length(&self) -> f64 {
        self.axle_places().last().unwrap_or(0.0)
    }

    /// Static load of each tire, N, solved from the weights and springs.
    #[must_use]
    pub fn static_loads(&self) -> &[f64] {
        &self.static_loads
    }
}
