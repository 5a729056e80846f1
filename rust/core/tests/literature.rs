//! Published and closed-form answers: the paper's nominal case, a beam on a Winkler bed under a
//! standing and a moving force, a simply supported beam under a moving force, the golden car.

// A test says what went wrong by failing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

use pavefem_core::analytical::{SimplySupportedBeam, WinklerBeam};
use pavefem_core::asphalt;
use pavefem_core::linalg::Lu;
use pavefem_core::pavement::{Bed, Ends, Foundation, Section, Strip, Weights};
use pavefem_core::response::{Hold, Keep, Loads, Record, Stepper};
use pavefem_core::roughness::{GoldenCar, iri};
use pavefem_core::transition::{Form, Transition};

/// Deflections under one axle along a path: `force` (of one wheel track) and `place` by time.
fn run(
    strip: &Strip,
    (weights, hold): (Weights, Hold),
    dt: f64,
    instants: usize,
    stations: &[f64],
    axle: impl Fn(f64) -> (f64, f64),
) -> Record {
    let transition =
        Transition::new(strip.system().clone(), dt, Form::Integral, &mut |_, _| true).unwrap();
    let keep = Keep::deflection(false, stations, 1);
    let stepper =
        Stepper::new(strip.clone(), transition, (weights, hold), &keep, &mut |_, _| true).unwrap();
    let (positions, forces): (Vec<_>, Vec<_>) = (0..instants)
        .map(|step| axle(step as f64 * dt))
        // Half of an axle's force goes into a track.
        .map(|(place, force)| (place, 2.0 * force))
        .unzip();
    let loads = Loads { axles: 1, positions: &positions, forces: &forces };
    stepper.run(&loads, &mut |_, _| true).unwrap()
}

/// Romero Navarrete, Lozano Guzman and Arroyo Contreras, Table I and section VI.B: 25 m in 0.5 m
/// elements under the nominal truck's static loads at 65 km/h, 20 degC and a VMA of 25 %, stepped
/// by 1 ms until the last axle has left. The deflections are those of an independent program
/// that follows the same reading of the paper.
#[test]
fn nominal_case_of_the_paper() {
    let speed = 65.0 / 3.6;
    let time = asphalt::loading_time(speed).unwrap();
    let binder = asphalt::binder_stiffness(time, 20.0, 60.0, -1.0).unwrap();
    let modulus = asphalt::mix_modulus(binder, 25.0).unwrap();
    assert!((modulus / 4_385_213_147.999_86 - 1.0).abs() < 1e-12, "{modulus}");

    let bar = 1.0 / (1.0 / 1.9e8 + 1.0 / 56e6);
    let bed = Bed { stiffness: bar / 0.5, damping: 140e3 / 0.5, mass: 355.0 / 3.0 / 0.5 };
    let section = Section {
        length: 25.0,
        bending_stiffness: modulus * 4.5e-5,
        bending_damping: 14_000.0 * 0.5_f64.powi(3),
        mass: 1000.0 / 0.5,
        bed,
    };
    let strip = Strip::new(&[section], 0.5, Foundation::Bars, Ends::Clamped).unwrap();
    assert_eq!((strip.nodes().len(), strip.system().len()), (51, 98));

    let (dt, steps) = (1e-3, 1708);
    let behind = [0.0, 4.55, 5.85];
    let (mut positions, mut forces) = (Vec::new(), Vec::new());
    for step in 0..=steps {
        positions.extend(behind.map(|axle| speed * dt * f64::from(step) - axle));
        forces.extend([38_925.0, 76_335.0, 80_938.0]);
    }
    assert!(positions[positions.len() - 1] < 25.0 && 25.0 < positions[positions.len() - 1] + 0.02);
    let loads = Loads { axles: 3, positions: &positions, forces: &forces };
    for form in [Form::Stiffness, Form::State, Form::Integral] {
        let system = strip.system().clone();
        let transition = Transition::new(system, dt, form, &mut |_, _| true).unwrap();
        let keep = Keep::deflection(false, &[12.5], 1);
        let stepper = Stepper::new(
            strip.clone(),
            transition,
            (Weights::Linear, Hold::Zero),
            &keep,
            &mut |_, _| true,
        )
        .unwrap();
        let record = stepper.run(&loads, &mut |_, _| true).unwrap();
        let envelope = &record.envelope;
        let lowest = envelope.lowest.iter().copied().fold(0.0, f64::min);
        for (name, found, expected, digits) in [
            ("mid", envelope.lowest[25], -0.643594386e-3, 1e-9),
            ("lowest", lowest, -0.661134721e-3, 1e-9),
            ("rebound", envelope.highest[25], 0.0606088e-3, 1e-6),
        ] {
            let error = (found / expected - 1.0).abs();
            assert!(error < digits, "{name}: {found} against {expected}, {error:.1e}");
        }
        // The station is the middle node.
        let low = record.history.iter().copied().fold(0.0, f64::min);
        assert_eq!(low, envelope.lowest[25]);
        assert_eq!(record.history[envelope.lowest_step[25]], low);
    }
}

/// The beam of many textbook examples: EI 75 000, m 2000, k 1.2e8.
fn winkler(zeta: f64, bending_damping: f64) -> WinklerBeam {
    let (mass, stiffness) = (2000.0, 1.2e8_f64);
    WinklerBeam {
        bending_stiffness: 75e3,
        bending_damping,
        mass,
        damping: zeta * 2.0 * (stiffness * mass).sqrt(),
        stiffness,
    }
}

/// A stretch of it, a third of its mass being that of the bed.
fn stretch(beam: &WinklerBeam, length: f64, h: f64) -> Strip {
    let bed = Bed { stiffness: beam.stiffness, damping: beam.damping, mass: beam.mass / 3.0 };
    let section = Section {
        length,
        bending_stiffness: beam.bending_stiffness,
        bending_damping: beam.bending_damping,
        mass: beam.mass - bed.mass,
        bed,
    };
    assert_eq!(WinklerBeam::from(&section), *beam);
    Strip::new(&[section], h, Foundation::Winkler, Ends::Clamped).unwrap()
}

/// The observed orders of errors at halved lengths.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Hetenyi, Beams on elastic foundation (1946): the infinite beam under a concentrated force.
#[test]
fn standing_force_on_a_winkler_bed_converges_with_the_fourth_power() {
    // The clamped ends, 3 m away, alter the middle by e^(-6 lambda), that is 2e-12.
    let beam = winkler(1.0, 0.0);
    let force = 40e3;
    let away = [0.0, 0.13, 0.25, 0.4, 0.61, -0.25, -0.8];
    let stations: Vec<f64> = away.iter().map(|x| 3.0 + x).collect();
    let error_at = |h: f64| -> Vec<f64> {
        let strip = stretch(&beam, 6.0, h);
        // At critical damping the slowest motion falls by e^-245 a second.
        let record =
            run(&strip, (Weights::Hermite, Hold::Zero), 0.02, 12, &stations, |_| (3.0, force));
        let last = &record.history[11 * stations.len()..];
        last.iter()
            .zip(away)
            .map(|(w, x)| (w + beam.static_deflection_at(force, x)).abs())
            .map(|error| error / beam.static_deflection(force))
            .collect()
    };
    let meshes = [0.25, 0.125, 0.0625];
    let errors: Vec<Vec<f64>> = meshes.map(error_at).into();
    let under: Vec<f64> = errors.iter().map(|error| error[0]).collect();
    let shape: Vec<f64> =
        errors.iter().map(|error| error.iter().copied().fold(0.0, f64::max)).collect();
    // 1.1e-4 of it (two digits) where lambda h = 0.404, as for the paper's pavement in such elements.
    assert!(under[1] < 1.15e-4 * (beam.decay() * 0.125 / 0.404).powi(4), "{under:?}");
    for (what, errors) in [("under the force", under), ("shape", shape)] {
        for order in orders(&errors) {
            assert!((3.7..4.5).contains(&order), "{what}: order {order} of {errors:?}");
        }
    }
}

/// Between nodes the deflection right under the force misses the kink in the third derivative,
/// `P h^3 / 192 EI` for a force in the middle of an element: third order there, and no better.
#[test]
fn standing_force_between_nodes() {
    let beam = winkler(1.0, 0.0);
    let force = 40e3;
    let errors = [0.25, 0.125, 0.0625].map(|h| {
        let strip = stretch(&beam, 6.0, h);
        let place = 3.0 + 0.5 * h;
        let record =
            run(&strip, (Weights::Hermite, Hold::Zero), 0.02, 12, &[place], |_| (place, force));
        let missed = record.history[11] + beam.static_deflection(force);
        let kink = force * h.powi(3) / (192.0 * beam.bending_stiffness);
        (missed - kink).abs() / beam.static_deflection(force)
    });
    // What the kink does not explain is of the fourth order again.
    for order in orders(&errors) {
        assert!((3.5..4.6).contains(&order), "order {order} of {errors:?}");
    }
}

/// Largest difference, over the passage of a force, from the steady state of the infinite beam, and
/// the largest deflection; both in units of the static one.
fn passage(beam: &WinklerBeam, ratio: f64, length: f64, h: f64) -> (f64, f64) {
    let speed = ratio * beam.critical_speed();
    let strip = stretch(beam, length, h);
    let steady = beam.moving_load(speed).unwrap();
    let force = 40e3;
    let w0 = beam.static_deflection(force);
    // The force swells over the first half of the way, smoothly, or free waves would run with it
    // for long; it stops short of the end, which sends none back before.
    let swell = 0.55 * length / speed;
    let dt = 2e-4;
    let instants = (0.8 * length / speed / dt) as usize;
    let station = (0.7 * length / h).round() * h;
    let record = run(&strip, (Weights::Hermite, Hold::First), dt, instants, &[station], |time| {
        let s = (time / swell).min(1.0);
        // All derivatives up to the third begin and end at zero.
        let swelling = s.powi(4) * (35.0 + s * (-84.0 + s * (70.0 - 20.0 * s)));
        (speed * time, force * swelling)
    });
    let mut error = 0.0_f64;
    for (step, w) in record.history.iter().enumerate() {
        let place = speed * dt * step as f64;
        if place > 0.6 * length {
            let expected = force * steady.deflection(station - place);
            error = error.max((w + expected).abs() / w0);
        }
    }
    let peak = -record.history.iter().copied().fold(0.0, f64::min) / w0;
    (error, peak)
}

/// Fryba, Vibration of solids and structures under moving loads (1972), ch. 13; peaks over the
/// static deflection by the closed form.
///
/// A force that rolls from element to element sheds waves as short as an element; they are of a
/// lower order (`kappa h` falls only with the root of `h`), but where bending damping ends them the
/// fourth order remains.
#[test]
fn moving_force_on_a_winkler_bed() {
    for (zeta, bending_damping, ratio, length, expected, lowest_order) in [
        (0.0, 0.0, 0.5, 16.0, Some(1.15470), 2.4),
        (0.1, 0.0, 0.5, 16.0, Some(1.15027), 2.4),
        (1.0, 0.0, 0.5, 12.0, Some(0.89144), 2.4),
        (0.1, 0.0, 0.9, 24.0, Some(2.06040), 2.4),
        (0.05, 150.0, 0.6, 16.0, None, 3.7),
    ] {
        let beam = winkler(zeta, bending_damping);
        let speed = ratio * beam.critical_speed();
        let closed = beam.moving_load(speed).unwrap().peak().0 / beam.static_deflection(1.0);
        if let Some(expected) = expected {
            assert!((closed - expected).abs() < 1e-5, "{closed} against {expected}");
        }
        let (coarse, _) = passage(&beam, ratio, length, 0.25);
        let (fine, peak) = passage(&beam, ratio, length, 0.125);
        let order = (coarse / fine).log2();
        let case = format!("zeta {zeta}, bending damping {bending_damping}, speed {ratio}");
        assert!((lowest_order..4.4).contains(&order), "{case}: order {order}, {coarse}, {fine}");
        // 4e-4 for a standing force, which the nearness of the critical speed and the waves raise.
        assert!(fine < 2.5e-3 * closed, "{case}: {fine}");
        assert!((peak - closed).abs() <= fine, "{case}: {peak} against {closed}");
    }
}

/// Fryba, Vibration of solids and structures under moving loads (1972), ch. 1, on the bridge of a
/// published vehicle-bridge code: L 25 m, E 3.5e10 Pa, I 1.3901 m^4, 18 358 kg/m, 5750 kg at 25 m/s;
/// static mid-span deflection 3.773997e-4 m.
#[test]
fn simply_supported_beam_under_a_moving_force() {
    let (length, speed, force) = (25.0, 25.0, 5750.0 * 9.81);
    let beam = SimplySupportedBeam { length, bending_stiffness: 3.5e10 * 1.3901, mass: 18_358.0 };
    let static_deflection = beam.static_deflection(force);
    assert!((static_deflection / 3.773997e-4 - 1.0).abs() < 2e-7, "{static_deflection}");

    let bridge = |h: f64, bending_damping: f64| {
        let bed = Bed { stiffness: 0.0, damping: 0.0, mass: 0.0 };
        let section = Section {
            length,
            bending_stiffness: beam.bending_stiffness,
            bending_damping,
            mass: beam.mass,
            bed,
        };
        Strip::new(&[section], h, Foundation::Winkler, Ends::Pinned).unwrap()
    };

    // Nodal values of a beam without a bed are exact on any mesh.
    let strip = bridge(6.25, 0.0);
    let lu = Lu::new("stiffness", &strip.system().stiffness.to_dense(), "").unwrap();
    let at = strip.shares(strip.nodes()[2], Weights::Linear).unwrap();
    let mid = at.unknowns[0].unwrap();
    let sag = lu.inverse()[(mid, mid)] * force;
    assert!((sag / static_deflection - 1.0).abs() < 1e-12, "{sag}");
    // The same in time, where internal damping lets the motion die out: the first mode at half of
    // its critical damping falls by e^-8 a second, higher ones faster.
    let first =
        std::f64::consts::PI.powi(2) / length.powi(2) * (beam.bending_stiffness / beam.mass).sqrt();
    let strip = bridge(6.25, beam.bending_stiffness / first);
    let scheme = (Weights::Hermite, Hold::Zero);
    let record = run(&strip, scheme, 0.25, 20, &[12.5], |_| (12.5, force));
    assert!((record.history[19] / -static_deflection - 1.0).abs() < 1e-9, "{:?}", record.history);

    let stations = [6.25, 12.5, 20.0];
    let error_of = |h: f64, dt: f64| {
        let instants = (length / speed / dt).round() as usize + 1;
        let strip = bridge(h, 0.0);
        let scheme = (Weights::Hermite, Hold::First);
        let record = run(&strip, scheme, dt, instants, &stations, |time| (speed * time, force));
        let mut error = 0.0_f64;
        for (step, row) in record.history.chunks_exact(stations.len()).enumerate() {
            for (w, x) in row.iter().zip(stations) {
                let exact = beam.moving_load(force, speed, x, step as f64 * dt, 400);
                error = error.max((w + exact).abs() / static_deflection);
            }
        }
        error
    };
    // Fine in time, the mesh alone errs (and sheds short waves, see above).
    let meshes = [3.125, 1.5625, 0.78125].map(|h| error_of(h, 1e-4));
    assert!(meshes[2] < 1e-5, "{meshes:?}");
    assert!(orders(&meshes).iter().all(|order| (2.5..4.5).contains(order)), "{meshes:?}");
    // Long steps and short elements, where the stiffest mode turns a thousand times in a step: the
    // second order of a mode that the force does follow.
    let steps = [5e-3, 2.5e-3, 1.25e-3].map(|dt| error_of(0.3125, dt));
    assert!(steps[2] < 1e-5, "{steps:?}");
    assert!(orders(&steps).iter().all(|order| (1.5..2.5).contains(order)), "{steps:?}");
}

/// Sayers, Gillespie and Paterson, World Bank Technical Paper 46 (1986), and Sayers, Transportation
/// Research Record 1501 (1995): the transition matrix and the particular response of the golden car
/// for samples 0.25 m apart, state (z_s', z_s'', z_u', z_u''). The numbers were computed in single
/// precision and are held to a few of its roundings: of each entry, and in the particular response,
/// which is a difference from one, of one.
#[test]
fn golden_car_at_a_quarter_of_a_metre() {
    let phi = [
        [0.9966071, 0.01091514, -0.002083274, 0.0003190145],
        [-0.5563044, 0.9438768, -0.8324718, 0.05064701],
        [0.02153176, 0.002126763, 0.7508714, 0.008221888],
        [3.335013, 0.3376467, -39.12762, 0.4347564],
    ];
    let gamma = [0.005476107, 1.388776, 0.2275968, 35.79262];
    let car = GoldenCar::new(0.25).unwrap();
    let rounding = 4.0 * f64::from(f32::EPSILON);
    for (found, published) in car.phi.as_flattened().iter().zip(phi.as_flattened()) {
        let error = (found / published - 1.0).abs();
        assert!(error < rounding, "{found} for {published}, {error:.1e}");
    }
    for (found, published) in car.gamma.iter().zip(gamma) {
        let error = (found - published).abs() / f64::max(1.0, published);
        assert!(error < rounding, "{found} for {published}, {error:.1e}");
    }
}

/// The golden car's gain for a sinusoidal slope, from its two equations of motion solved by hand at
/// one frequency, and the mean of a rectified sine, 2/pi.
#[test]
fn golden_car_over_sinusoids() {
    for (wavelength, published) in
        [(2.4, 1.6640), (5.0, 1.1697), (10.0, 1.2597), (15.4, 1.5351), (30.0, 0.4548)]
    {
        let wave = 2.0 * std::f64::consts::PI / wavelength;
        let (spacing, amplitude) = (0.01, 2e-3);
        let elevations: Vec<f64> = (0..200_000)
            .map(|i| amplitude / wave * (wave * spacing * f64::from(i)).sin())
            .collect();
        let found = iri(&elevations, spacing, false, Some(1000.0), &mut |_, _| true).unwrap();
        let gain = found[1] / (1e3 * amplitude * 2.0 / std::f64::consts::PI);
        assert!((gain / published - 1.0).abs() < 1e-3, "{wavelength} m: {gain} for {published}");
    }
}
