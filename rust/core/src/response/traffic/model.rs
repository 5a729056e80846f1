//! What a run of traffic is made of, and what follows from it before anything moves.

use std::ops::Range;

use super::events::Power;
use crate::error::{Result, check, check_count, invalid, positive};
use crate::pavement::load::Contact;
use crate::pavement::mesh::Place;
use crate::pavement::{Ends, Foundation, Mesh, Quantity, Reading, Section};
use crate::response::Hold;
use crate::response::window::extent;
use crate::vehicle::course::{Break, Course};
use crate::vehicle::linear::Step;
use crate::vehicle::{Interpolation, Profile, Vehicle};

/// What is left out of a deflection at the ends of a vehicle's window, as a part of that under a force.
///
/// The reach that follows from it is that of the force whose wave dies away the slowest; most do much
/// sooner.
pub const TOLERANCE: f64 = 3e-7;

/// Speeds at which the reach of a window is found: those between have that of the next one.
const SPEEDS: i32 = 12;

/// Number format of the pavement's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// f64.
    Double,
    /// f32.
    Single,
}

/// A road in one direction of travel.
#[derive(Debug, Clone, PartialEq)]
pub struct Carriageway {
    /// Its sections in the direction of travel, as each class of stiffness has them.
    pub classes: Vec<Vec<Section>>,
    /// Thickness of the beam in each section, m.
    pub thickness: Vec<f64>,
}

/// Elevations along a lane: x from the road's beginning in the direction of travel, m, and z, m.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Stations, m.
    pub x: Vec<f64>,
    /// Elevations, m.
    pub z: Vec<f64>,
    /// What is between samples.
    pub interpolation: Interpolation,
}

/// A lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lane {
    /// Number of its carriageway.
    pub road: usize,
    /// Number of its surface; smooth without.
    pub surface: Option<usize>,
}

/// A vehicle's stretch in one lane.
#[derive(Debug, Clone, PartialEq)]
pub struct Passage {
    /// Number of the vehicle.
    pub vehicle: usize,
    /// Number of the lane.
    pub lane: usize,
    /// Part of a wheel track's force that loads the strip.
    pub share: f64,
    /// How far ahead of where it comes onto the lane the vehicle starts at rest, m.
    pub run_in: f64,
    /// Where its front axle changes its speed, in the direction of travel.
    pub breaks: Vec<Break>,
    /// Class of stiffness from each break on.
    pub classes: Vec<usize>,
    /// When it leaves the lane, s; infinity if at its end.
    pub until: f64,
}

/// What is kept of each node.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Exponents of the sums of powers.
    pub powers: Vec<f64>,
    /// Edges of the histogram of the peaks of deflection, m.
    pub bins: Vec<f64>,
    /// Lanes and places, m in the direction of travel, whose histories are given out.
    pub stations: Vec<(usize, f64)>,
    /// Ticks at which an axle that reaches a node counts.
    pub ticks: Range<i64>,
    /// Stretch of the first carriageway whose nodes count, m.
    pub part: (f64, f64),
}

/// How the pavement is meshed and stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Discretisation {
    /// Longest element, m.
    pub element_length: f64,
    /// How the bed carries the beam.
    pub foundation: Foundation,
    /// How the ends are held.
    pub ends: Ends,
    /// How forces come onto the nodes.
    pub contact: Contact,
    /// Forces within a step.
    pub hold: Hold,
    /// Time step, s.
    pub dt: f64,
    /// Number format.
    pub precision: Precision,
}

/// All inputs of a run.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// Mesh and time step.
    pub scheme: Discretisation,
    /// The road in its directions of travel; the second is the first one seen from its end.
    pub roads: Vec<Carriageway>,
    /// Elevations.
    pub surfaces: Vec<Surface>,
    /// Lanes.
    pub lanes: Vec<Lane>,
    /// Vehicles.
    pub vehicles: Vec<Vehicle>,
    /// What they do.
    pub passages: Vec<Passage>,
    /// What is kept.
    pub outcome: Outcome,
}

/// Where the windows of vehicles at a speed end, m from their axles, and how many ticks the
/// pavement remembers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    speed: f64,
    pub(super) ahead: f64,
    pub(super) behind: f64,
    pub(super) memory: i64,
}

/// A station of a lane.
#[derive(Debug, Clone)]
pub(super) struct Station {
    pub(super) column: usize,
    pub(super) lane: usize,
    /// Last of the nodes that it needs.
    pub(super) last: usize,
    pub(super) reading: Reading,
}

/// The inputs, checked, and what follows from them.
pub(super) struct Model {
    pub(super) inputs: Inputs,
    pub(super) courses: Vec<Course>,
    /// A mesh of each carriageway, in its first class.
    meshes: Vec<Mesh>,
    /// Of each passage: how far windows go at its speeds, and how long what it leaves behind lasts.
    pub(super) reaches: Vec<Reach>,
    /// A step of each vehicle, over lines and over a staircase.
    steps: Vec<[Option<Step>; 2]>,
    pub(super) stations: Vec<Station>,
    /// Nodes of each carriageway that count.
    pub(super) counted: Vec<Range<usize>>,
    /// Half the thickness of the beam at each node of each carriageway, m.
    pub(super) fibre: Vec<Vec<f64>>,
    pub(super) powers: Vec<Power>,
}

impl Model {
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) for an input out of range, or a pavement that
    /// does not forget.
    pub(super) fn new(inputs: Inputs) -> Result<Self> {
        let scheme = inputs.scheme;
        positive("time step dt", scheme.dt, "s")?;
        scheme.contact.check()?;
        let mesh = |road: &Carriageway| {
            let sections = road.classes.first().map_or(&[][..], Vec::as_slice);
            Mesh::new(sections, scheme.element_length, scheme.foundation, scheme.ends)
        };
        let meshes = inputs.roads.iter().map(mesh).collect::<Result<Vec<Mesh>>>()?;
        let mut model = Self {
            courses: Vec::new(),
            reaches: Vec::new(),
            steps: Vec::new(),
            stations: Vec::new(),
            counted: counted(&meshes, inputs.outcome.part),
            fibre: Vec::new(),
            powers: inputs.outcome.powers.iter().map(|&power| Power::of(power)).collect(),
            meshes,
            inputs,
        };
        model.check()?;
        let course = |passage: &Passage| Course::new(&passage.breaks, scheme.dt);
        model.courses = model.inputs.passages.iter().map(course).collect::<Result<_>>()?;
        model.reaches = model.found_reaches()?;
        model.fibre = model.found_fibres();
        model.steps = model.found_steps()?;
        model.stations = model.placed_stations()?;
        Ok(model)
    }

    fn check(&self) -> Result<()> {
        let Inputs { roads, surfaces, lanes, vehicles, passages, outcome, .. } = &self.inputs;
        let below = |name: String, number: usize, count: usize| {
            check_count(&name, number, &format!("below {count}"), |number| number < count)
        };
        for (number, road) in roads.iter().enumerate() {
            let sections = road.classes.first().map_or(0, Vec::len);
            let same = road.classes.iter().all(|class| class.len() == sections);
            if !same || road.thickness.len() != sections || self.meshes[number].len() != self.len()
            {
                let allowed = "the same sections in all classes and both directions";
                return Err(invalid(format!("road {number}"), "sections", allowed));
            }
        }
        surfaces.iter().try_for_each(Surface::check)?;
        for (number, lane) in lanes.iter().enumerate() {
            below(format!("road of lane {number}"), lane.road, roads.len())?;
            if let Some(surface) = lane.surface {
                below(format!("profile of lane {number}"), surface, surfaces.len())?;
            }
        }
        for (number, passage) in passages.iter().enumerate() {
            let name = |quantity: &str| format!("passage {number}: {quantity}");
            below(name("vehicle"), passage.vehicle, vehicles.len())?;
            below(name("lane"), passage.lane, lanes.len())?;
            let (breaks, given) = (passage.breaks.len(), passage.classes.len());
            let allowed = format!("{breaks}, one for each break");
            check_count(&name("number of classes"), given, &allowed, |count| count == breaks)?;
            if passage.until.is_nan() {
                return Err(invalid(name("until"), "nan", "a time, s, or infinity"));
            }
            let classes = self.road(passage).classes.len();
            for &class in &passage.classes {
                below(name("stiffness class"), class, classes)?;
            }
            check(&name("share"), passage.share, "", "0 to 1", |s| (0.0..=1.0).contains(&s))?;
            check(&name("run-in"), passage.run_in, "m", "0 to 1e6 m", |r| {
                (0.0..=1e6).contains(&r)
            })?;
        }
        let increase = outcome.bins.is_sorted_by(|a, b| a < b);
        if !increase || outcome.bins.iter().any(|edge| !(edge.is_finite() && *edge > 0.0)) {
            return Err(invalid("bins", format!("{:?}", outcome.bins), "above 0 and increasing"));
        }
        for &power in &outcome.powers {
            check("power", power, "", "above 0, at most 20", |p| p > 0.0 && p <= 20.0)?;
        }
        Ok(())
    }

    /// Nodes of a carriageway.
    pub(super) fn len(&self) -> usize {
        self.meshes.first().map_or(0, Mesh::len)
    }

    /// The mesh of a carriageway, of whatever stiffness.
    pub(super) fn geometry(&self, road: usize) -> &Mesh {
        &self.meshes[road]
    }

    /// The mesh of a passage's carriageway with the stiffness of a class.
    pub(super) fn mesh(&self, passage: &Passage, class: usize) -> Result<Mesh> {
        let road = self.inputs.lanes[passage.lane].road;
        self.meshes[road].with_sections(&self.inputs.roads[road].classes[class])
    }

    fn road(&self, passage: &Passage) -> &Carriageway {
        &self.inputs.roads[self.inputs.lanes[passage.lane].road]
    }

    pub(super) fn dt(&self) -> f64 {
        self.inputs.scheme.dt
    }

    pub(super) fn surface(&self, passage: &Passage) -> Option<&Surface> {
        let surface = self.inputs.lanes[passage.lane].surface;
        surface.map(|surface| &self.inputs.surfaces[surface])
    }

    /// The step of a passage's vehicle; none on a smooth road.
    pub(super) fn step(&self, number: usize) -> Option<&Step> {
        let passage = &self.inputs.passages[number];
        let surface = self.surface(passage)?;
        self.steps[passage.vehicle][usize::from(surface.jumps())].as_ref()
    }

    /// Length of a passage's window, m.
    pub(super) fn window(&self, number: usize) -> f64 {
        let (reach, vehicle) = (self.reaches[number], self.inputs.passages[number].vehicle);
        reach.ahead + self.inputs.vehicles[vehicle].length() + reach.behind
    }

    /// Of each passage, the farthest reach at any of its speeds.
    fn found_reaches(&self) -> Result<Vec<Reach>> {
        let by_speed = self.reaches_by_speed()?;
        let of = |passage: &Passage| {
            let speeds = || passage.breaks.iter().map(|at| at.speed);
            let (slowest, fastest) =
                (speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max));
            let at = |speed: f64| by_speed.partition_point(|reach| reach.speed < speed);
            let last = by_speed.len() - 1;
            let (from, to) = (at(slowest).saturating_sub(1), at(fastest).min(last));
            let most = |a: Reach, b: Reach| Reach {
                speed: b.speed,
                ahead: a.ahead.max(b.ahead),
                behind: a.behind.max(b.behind),
                memory: a.memory.max(b.memory),
            };
            by_speed[from..=to].iter().copied().reduce(most).unwrap_or(by_speed[last])
        };
        Ok(self.inputs.passages.iter().map(of).collect())
    }

    /// Reaches at speeds from the slowest to the fastest.
    fn reaches_by_speed(&self) -> Result<Vec<Reach>> {
        let Inputs { scheme, passages, .. } = &self.inputs;
        let pieces = passages.iter().flat_map(|passage| {
            let speeds = passage.breaks.iter().map(|at| at.speed);
            let road = self.inputs.lanes[passage.lane].road;
            speeds.zip(&passage.classes).map(move |(speed, class)| (speed, road, *class))
        });
        let mut pieces: Vec<(f64, usize, usize)> = pieces.collect();
        pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(fastest, ..)) = pieces.last() else { return Ok(Vec::new()) };
        let slowest = pieces.iter().find(|piece| piece.0 > 0.0).map_or(1.0, |piece| piece.0);
        let ratio = (fastest / slowest).max(1.0);
        let mut reaches: Vec<Reach> = Vec::new();
        for i in 0..=SPEEDS {
            let wanted = slowest * ratio.powf(f64::from(i) / f64::from(SPEEDS));
            let at = pieces.partition_point(|piece| piece.0 < wanted * (1.0 - 1e-12));
            let (speed, road, class) = pieces[at.min(pieces.len() - 1)];
            if reaches.last().is_some_and(|reach| reach.speed == speed) {
                continue;
            }
            let mesh = self.meshes[road].with_sections(&self.inputs.roads[road].classes[class])?;
            let ([ahead, behind], steps) =
                extent(&mesh, scheme.dt, scheme.contact.print, speed, TOLERANCE)?;
            if steps.is_infinite() {
                let allowed = "damped, with bars close enough, so that waves die away: traffic on \
                               others would need the whole road at each step";
                return Err(invalid("pavement", "one that does not forget", allowed));
            }
            reaches.push(Reach { speed, ahead, behind, memory: steps as i64 + 1 });
        }
        Ok(reaches)
    }

    fn found_fibres(&self) -> Vec<Vec<f64>> {
        let of = |(road, mesh): (&Carriageway, &Mesh)| {
            let last = mesh.elements() - 1;
            let half = |node: usize| 0.5 * road.thickness[mesh.number(node.min(last))];
            (0..mesh.len()).map(half).collect()
        };
        self.inputs.roads.iter().zip(&self.meshes).map(of).collect()
    }

    /// The steps of each vehicle over the surfaces that it comes onto.
    fn found_steps(&self) -> Result<Vec<[Option<Step>; 2]>> {
        let mut steps: Vec<[Option<Step>; 2]> =
            self.inputs.vehicles.iter().map(|_| [None, None]).collect();
        for passage in &self.inputs.passages {
            let Some(surface) = self.surface(passage) else { continue };
            let slot = &mut steps[passage.vehicle][usize::from(surface.jumps())];
            if slot.is_none() {
                let vehicle = &self.inputs.vehicles[passage.vehicle];
                *slot = Some(Step::new(vehicle, self.dt(), surface.interpolation)?);
            }
        }
        Ok(steps)
    }

    fn placed_stations(&self) -> Result<Vec<Station>> {
        let place = |(column, &(lane, x)): (usize, &(usize, f64))| {
            let lanes = self.inputs.lanes.len();
            check_count("lane of a station", lane, &format!("below {lanes}"), |l| l < lanes)?;
            let mesh = &self.meshes[self.inputs.lanes[lane].road];
            let at: Place = mesh.place(x).ok_or_else(|| {
                let allowed = format!("on the road, 0 to {:?} m", mesh.length());
                invalid("station", format!("{x:?} m"), allowed)
            })?;
            let reading = mesh.reading(&at, Quantity::Deflection);
            Ok(Station { column, lane, last: at.element + 1, reading })
        };
        self.inputs.outcome.stations.iter().enumerate().map(place).collect()
    }
}

impl Surface {
    /// Whether elevations jump under a point.
    fn jumps(&self) -> bool {
        self.interpolation == Interpolation::Staircase
    }

    fn check(&self) -> Result<()> {
        Profile::new(&self.x, &self.z, self.interpolation).map(|_| ())
    }

    /// The profile, once it is checked.
    pub(super) fn held(&self) -> Profile<'_> {
        Profile::held(&self.x, &self.z, self.interpolation)
    }
}

/// The nodes of a stretch of the first carriageway, on each of them.
fn counted(meshes: &[Mesh], (from, to): (f64, f64)) -> Vec<Range<usize>> {
    let Some(first) = meshes.first() else { return Vec::new() };
    let at = |x: f64| first.nodes().partition_point(|node| *node < x - 1e-9);
    let (begin, end) = (at(from), if to >= first.length() { first.len() } else { at(to) });
    let mirrored = first.len() - end..first.len() - begin;
    [begin..end, mirrored].into_iter().take(meshes.len()).collect()
}
