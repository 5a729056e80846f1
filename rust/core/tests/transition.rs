//! `Phi`, `Gamma` and the ramp response of any `M u'' + C u' + K u = f`: closed forms of one
//! unknown, an independent exponential of full matrices, and the published golden car.

// A test says what went wrong by failing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

use pavefem_core::error::{Error, Result};
use pavefem_core::linalg::DMatrix;
use pavefem_core::pavement::{Bed, Ends, Foundation, Section, Strip};
use pavefem_core::transition::{DENSE_LIMIT, Form, System, Transition};

const FORMS: [Form; 3] = [Form::Stiffness, Form::State, Form::Integral];

fn transition(system: &System, dt: f64, form: Form) -> Result<Transition> {
    Transition::new(system.clone(), dt, form, &mut |_, _| true)
}

fn one(m: f64, c: f64, k: f64) -> System {
    let scalar = |x| DMatrix::from_element(1, 1, x);
    System::from_dense(&scalar(m), &scalar(c), &scalar(k)).unwrap()
}

/// Largest difference relative to the largest entry expected.
fn distance(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    (found - expected).amax() / expected.amax()
}

/// Numbers in -1 to 1 that differ from platform to platform in nothing.
fn scatter(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
    let mut state = seed;
    DMatrix::from_fn(rows, columns, |_, _| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    })
}

/// A full system without any symmetry, its masses well away from singular.
fn full(n: usize) -> System {
    let unit = DMatrix::<f64>::identity(n, n);
    let mass = scatter(n, n, 1) + &unit * n as f64;
    let damping = scatter(n, n, 2) * 30.0;
    let stiffness = scatter(n, n, 3) * 2e3 + unit * 9e3;
    System::from_dense(&mass, &damping, &stiffness).unwrap()
}

/// The paper's road, shortened.
fn strip(elements: usize, foundation: Foundation) -> Strip {
    let bed = Bed { stiffness: 8.65e7, damping: 2.8e5, mass: 355.0 / 1.5 };
    let section = Section {
        length: 0.5 * elements as f64,
        bending_stiffness: 1.97335e5,
        bending_damping: 1750.0,
        mass: 2000.0,
        bed,
    };
    Strip::new(&[section], 0.5, foundation, Ends::Clamped).unwrap()
}

/// Closed form of one unknown: `Phi` by rows, then `Gamma`, then the response to a ramp.
fn oscillator(m: f64, c: f64, k: f64, t: f64) -> [f64; 8] {
    let decay = c / (2.0 * m);
    let discriminant = decay * decay - k / m;
    // cos and sin/omega of a real or an imaginary frequency, and their common limit.
    let (cosine, sine) = if discriminant < 0.0 {
        let omega = (-discriminant).sqrt();
        ((omega * t).cos(), (omega * t).sin() / omega)
    } else if discriminant > 0.0 {
        let rate = discriminant.sqrt();
        ((rate * t).cosh(), (rate * t).sinh() / rate)
    } else {
        (1.0, t)
    };
    let e = (-decay * t).exp();
    let (uu, uv) = (e * (cosine + decay * sine), e * sine);
    let (vu, vv) = (-k / m * uv, e * (cosine - decay * sine));
    let impulse = uv / m;
    let step = (1.0 - uu) / k;
    let ramp = (t - uv - c * step) / k;
    [uu, uv, vu, vv, step, impulse, ramp / t, step / t]
}

#[test]
fn one_oscillator_under_over_critically_damped_and_undamped() {
    // omega dt = 0.8: every number is of order one, so that the closed form itself loses nothing.
    let (m, k, dt): (f64, f64, f64) = (3.0, 1.2e4, 0.8 / 63.245_553_203_367_59);
    let critical = 2.0 * (k * m).sqrt();
    // A mass and a stiffness whose critical damping is a whole number, for the exact double root.
    let cases = [
        (m, 0.0, k, dt),
        (m, 0.2 * critical, k, dt),
        (m, 3.0 * critical, k, dt),
        (4.0, 2.0 * 4.0 * 50.0, 4.0 * 2500.0, 0.016),
    ];
    for (m, c, k, dt) in cases {
        let expected = oscillator(m, c, k, dt);
        for form in FORMS {
            let found = transition(&one(m, c, k), dt, form).unwrap();
            let phi = found.phi().to_dense();
            let (gamma, ramp) = (found.gamma(), found.ramp());
            let entries = [
                phi[(0, 0)],
                phi[(0, 1)],
                phi[(1, 0)],
                phi[(1, 1)],
                gamma[0],
                gamma[1],
                ramp[0],
                ramp[1],
            ];
            // Each against what such an entry is in size, whatever its units. (The closed form of
            // the ramp itself subtracts numbers ten times its size.)
            let w = (k / m).sqrt();
            let (held, struck) = (1.0 / k, 1.0 / (m * w));
            let sizes = [1.0, 1.0 / w, w, 1.0, held, struck, held, struck];
            for (at, (found, expected)) in entries.iter().zip(expected).enumerate() {
                let error = (found - expected).abs() / sizes[at];
                assert!(
                    error < 5e-14,
                    "c {c}, {form:?}, entry {at}: {found} against {expected}, off {error:.1e}"
                );
            }
        }
    }
}

#[test]
fn a_free_mass_needs_the_integral_form() {
    let (m, t) = (2.5, 0.04);
    let found = transition(&one(m, 0.0, 0.0), t, Form::Integral).unwrap();
    let phi = DMatrix::from_row_slice(2, 2, &[1.0, t, 0.0, 1.0]);
    assert!((found.phi().to_dense() - phi).amax() < 1e-16);
    let gamma = [t * t / (2.0 * m), t / m];
    let ramp = [t * t / (6.0 * m), t / (2.0 * m)];
    for i in 0..2 {
        assert!((found.gamma()[i] / gamma[i] - 1.0).abs() < 1e-15);
        assert!((found.ramp()[i] / ramp[i] - 1.0).abs() < 1e-15);
    }
    for (form, matrix) in [(Form::Stiffness, "stiffness matrix"), (Form::State, "state matrix A")] {
        let error = transition(&one(m, 0.0, 0.0), t, form).unwrap_err();
        assert!(matches!(error, Error::Singular { name, .. } if name == matrix), "{error}");
        assert!(error.to_string().contains(matrix) && error.to_string().contains("integral form"));
    }
}

#[test]
fn a_mass_on_a_damper_alone() {
    let (m, c, t) = (2.5, 80.0, 0.04);
    let found = transition(&one(m, c, 0.0), t, Form::Integral).unwrap();
    let impulse = (1.0 - (-c * t / m).exp()) / c;
    let step = (t - m * impulse) / c;
    let ramp = (t * t / 2.0 - m * step) / c;
    for (found, expected) in [
        (found.gamma()[1], impulse),
        (found.gamma()[0], step),
        (found.ramp()[0], ramp / t),
        (found.phi().to_dense()[(1, 1)], (-c * t / m).exp()),
    ] {
        assert!((found / expected - 1.0).abs() < 1e-14, "{found} against {expected}");
    }
}

#[test]
fn free_bodies_are_singular_whatever_joins_them() {
    // Masses joined by springs of odd stiffnesses, and a beam on nothing: rounding must not hide
    // that nothing holds them.
    let chain = {
        let n = 9;
        let mut stiffness = DMatrix::zeros(n, n);
        for i in 1..n {
            let k = 1e6 / (2.0 + i as f64).sqrt();
            for (r, c, sign) in
                [(i, i, 1.0), (i - 1, i - 1, 1.0), (i, i - 1, -1.0), (i - 1, i, -1.0)]
            {
                stiffness[(r, c)] += sign * k;
            }
        }
        System::from_dense(&DMatrix::identity(n, n), &DMatrix::zeros(n, n), &stiffness).unwrap()
    };
    let beam = {
        let bed = Bed { stiffness: 0.0, damping: 0.0, mass: 0.0 };
        let section = Section {
            length: 8.3,
            bending_stiffness: 1.97335e5,
            bending_damping: 0.0,
            mass: 2000.0,
            bed,
        };
        Strip::new(&[section], 0.4, Foundation::Winkler, Ends::Free).unwrap().system().clone()
    };
    for (what, system) in [("chain", chain), ("beam", beam)] {
        for form in [Form::Stiffness, Form::State] {
            let result = transition(&system, 1e-3, form);
            assert!(matches!(result, Err(Error::Singular { .. })), "{what}, {form:?}");
        }
        assert!(transition(&system, 1e-3, Form::Integral).is_ok(), "{what}");
    }
}

#[test]
fn two_steps_are_one_of_twice_the_length() {
    let systems = [one(3.0, 40.0, 1.2e4), full(8), strip(12, Foundation::Bars).system().clone()];
    for (system, dt) in systems.iter().zip([0.01, 0.02, 1e-3]) {
        let once = transition(system, dt, Form::Integral).unwrap();
        let twice = transition(system, 2.0 * dt, Form::Integral).unwrap();
        let phi = once.phi().to_dense();
        assert!(distance(&(&phi * &phi), &twice.phi().to_dense()) < 1e-12);
        let gamma = &phi * once.gamma() + once.gamma();
        assert!(distance(&gamma, &twice.gamma()) < 1e-12);
        // A ramp to one over both steps: to a half, then a half held and another half's ramp.
        let ramp = &phi * once.ramp() * 0.5 + once.gamma() * 0.5 + once.ramp() * 0.5;
        assert!(distance(&ramp, &twice.ramp()) < 1e-12);
    }
}

#[test]
fn a_short_step_and_a_long_one_are_the_same_motion() {
    // 64 steps of dt against one of 64 dt: what the squarings do must not show.
    let system = strip(12, Foundation::Winkler).system().clone();
    let short = transition(&system, 1e-4, Form::Stiffness).unwrap();
    let long = transition(&system, 64e-4, Form::Stiffness).unwrap();
    let mut power = short.phi().to_dense();
    for _ in 0..6 {
        power = &power * &power;
    }
    let error = distance(&power, &long.phi().to_dense());
    // Nine squarings in all, each of which may double the rounding errors of sums of 44 terms.
    assert!(
        error < 44.0 * 512.0 * f64::EPSILON,
        "{error:.1e}, {:?} {:?}",
        short.series(),
        long.series()
    );
}

#[test]
fn the_three_forms_agree() {
    let truck_like = {
        // Two bodies on springs, slow against the step: K dt^2 / M is 1e-5, where a form that
        // subtracts numbers near one loses five digits.
        let mass = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![17_400.0, 600.0]));
        let spring = |k: f64, tire: f64| DMatrix::from_row_slice(2, 2, &[k, -k, -k, k + tire]);
        System::from_dense(&mass, &spring(1e4, 1e4), &spring(1e6, 1.75e6)).unwrap()
    };
    let cases = [
        (full(8), 0.05),
        (strip(50, Foundation::Bars).system().clone(), 1e-3),
        (strip(50, Foundation::Winkler).system().clone(), 1e-3),
        (truck_like, 1e-3),
    ];
    for (case, (system, dt)) in cases.iter().enumerate() {
        let [first, rest @ ..] = FORMS.map(|form| transition(system, *dt, form).unwrap());
        for (other, form) in rest.iter().zip(&FORMS[1..]) {
            for (name, a, b) in
                [("Gamma", other.gamma(), first.gamma()), ("ramp", other.ramp(), first.ramp())]
            {
                // Displacements and velocities have their own units: compare each with its own.
                let n = system.len();
                for (part, rows) in [("u", 0), ("v", n)] {
                    let (a, b) = (a.rows(rows, n).into_owned(), b.rows(rows, n).into_owned());
                    let error = distance(&a, &b);
                    assert!(error < 1e-10, "case {case}, {form:?}, {name} {part}: {error:.1e}");
                }
            }
        }
    }
}

/// `exp(A)` by the series at `A / 2^40`, squared up as `exp - 1`, which loses no digit to the unit.
fn exponential(a: &DMatrix<f64>) -> DMatrix<f64> {
    let halvings = 40;
    let small = a / f64::from(halvings).exp2();
    let mut rest = &small + &small * &small * 0.5;
    for _ in 0..halvings {
        rest = &rest * 2.0 + &rest * &rest;
    }
    rest + DMatrix::identity(a.nrows(), a.ncols())
}

#[test]
fn a_full_system_without_symmetry_against_an_independent_exponential() {
    // The state, a held force and a growing one in one exponential (Van Loan):
    // exp [A B 0; 0 0 I; 0 0 0] = [Phi Gamma Q; 0 I t; 0 0 I].
    let n = 8;
    for dt in [1e-3, 0.03, 0.2] {
        let system = full(n);
        let inverse = system.mass.to_dense().try_inverse().unwrap();
        let unit = DMatrix::<f64>::identity(n, n);
        let mut a = DMatrix::zeros(4 * n, 4 * n);
        for (row, column, block) in [
            (0, n, unit.clone()),
            (n, 0, -(&inverse * system.stiffness.to_dense())),
            (n, n, -(&inverse * system.damping.to_dense())),
            (n, 2 * n, inverse.clone()),
            (2 * n, 3 * n, unit),
        ] {
            a.view_mut((row, column), (n, n)).copy_from(&block);
        }
        let expected = exponential(&(a * dt));
        let block = |row: usize, column: usize, columns: usize| {
            expected.view((row, column), (n, columns)).into_owned()
        };
        for form in FORMS {
            let found = transition(&system, dt, form).unwrap();
            let (phi, gamma, ramp) = (found.phi().to_dense(), found.gamma(), found.ramp());
            for rows in [0, n] {
                let part = |matrix: &DMatrix<f64>| matrix.rows(rows, n).into_owned();
                for (name, found, expected) in [
                    ("Phi", part(&phi), block(rows, 0, 2 * n)),
                    ("Gamma", part(&gamma), block(rows, 2 * n, n)),
                    ("ramp", part(&ramp), block(rows, 3 * n, n) / dt),
                ] {
                    let error = distance(&found, &expected);
                    assert!(error < 1e-10, "dt {dt}, {form:?}, {name} row {rows}: {error:.1e}");
                }
            }
        }
    }
}

/// Golden car: Sayers, "On the calculation of International Roughness Index from longitudinal road
/// profile", Transportation Research Record 1501 (1995); the matrix at 250 mm and 80 km/h is that
/// of Sayers, Gillespie and Paterson, World Bank Technical Paper 46 (1986). The state is
/// `(z_s', z_s'', z_u', z_u'')`; the motion being linear, it holds for `(z_s, z_s', z_u, z_u')` over
/// an elevation as it does for slopes. To the seven digits printed.
#[test]
fn golden_car_at_a_quarter_metre() {
    let published = DMatrix::from_row_slice(
        4,
        5,
        &[
            0.9966071,
            0.01091514,
            -0.002083274,
            0.0003190145,
            0.005476107, //
            -0.5563044,
            0.9438768,
            -0.8324718,
            0.05064701,
            1.388776, //
            0.02153176,
            0.002126763,
            0.7508714,
            0.008221888,
            0.2275968, //
            3.335013,
            0.3376467,
            -39.12762,
            0.4347564,
            35.79262,
        ],
    );
    let (tire, suspension, damper, unsprung) = (653.0, 63.3, 6.0, 0.15);
    let mass = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, unsprung]);
    let damping = DMatrix::from_row_slice(2, 2, &[damper, -damper, -damper, damper]);
    let stiffness =
        DMatrix::from_row_slice(2, 2, &[suspension, -suspension, -suspension, suspension + tire]);
    let system = System::from_dense(&mass, &damping, &stiffness).unwrap();
    for form in FORMS {
        let found = transition(&system, 0.25 / (80.0 / 3.6), form).unwrap();
        let (phi, gamma) = (found.phi().to_dense(), found.gamma());
        // Ours is (z_s, z_u, z_s', z_u').
        let order = [0, 2, 1, 3];
        for (i, &row) in order.iter().enumerate() {
            for (j, &expected) in published.row(i).iter().enumerate() {
                // The force of a unit elevation is that of the tire.
                let found = if j < 4 { phi[(row, order[j])] } else { tire * gamma[(row, 1)] };
                let digit = 10_f64.powi(f64::abs(expected).log10().floor() as i32 - 6);
                let single = 4.0 * f64::from(f32::EPSILON) * published.row(i).amax();
                assert!(
                    (found - expected).abs() <= digit.max(single),
                    "{form:?}, row {i}, column {j}: {found} against {expected}"
                );
            }
        }
    }
}

#[test]
fn what_is_wrong_with_a_system_is_said_by_name() {
    let unit = DMatrix::<f64>::identity(3, 3);
    let named = |error: &Error, words: &[&str]| {
        let text = error.to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
    };
    let singular = DMatrix::from_row_slice(3, 3, &[2.0, 1.0, 0.0, 4.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
    let system = System::from_dense(&singular, &unit, &unit).unwrap();
    for form in FORMS {
        let error = transition(&system, 1e-3, form).unwrap_err();
        assert!(matches!(error, Error::Singular { name: "mass matrix", .. }), "{error}");
    }
    let mut holed = unit.clone();
    holed[(2, 1)] = f64::NAN;
    for (matrices, name) in [
        ([&holed, &unit, &unit], "mass matrix"),
        ([&unit, &holed, &unit], "damping matrix"),
        ([&unit, &unit, &holed], "stiffness matrix"),
    ] {
        let error = System::from_dense(matrices[0], matrices[1], matrices[2]).unwrap_err();
        assert!(matches!(error, Error::NonFinite { row: 2, column: 1, .. }), "{error}");
        named(&error, &[name, "NaN", "row 2", "column 1"]);
    }
    let small = DMatrix::<f64>::identity(2, 2);
    let error = System::from_dense(&unit, &unit, &small).unwrap_err();
    named(&error, &["stiffness matrix", "(2, 2)", "(3, 3)"]);
    let error = System::from_dense(&unit.rows(0, 2).into_owned(), &unit, &unit).unwrap_err();
    assert!(matches!(error, Error::Shape { .. }), "{error}");
    let system = System::from_dense(&unit, &unit, &unit).unwrap();
    for dt in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        named(&transition(&system, dt, Form::Integral).unwrap_err(), &["time step dt"]);
    }
    let none = DMatrix::<f64>::zeros(0, 0);
    let empty = System::from_dense(&none, &none, &none).unwrap();
    named(&transition(&empty, 1e-3, Form::Integral).unwrap_err(), &["unknowns"]);
    let many = strip(DENSE_LIMIT / 2 + 2, Foundation::Bars);
    let error = transition(many.system(), 1e-3, Form::Integral).unwrap_err();
    assert!(matches!(error, Error::TooLarge { unknowns: 2002, .. }), "{error}");
}

#[test]
fn a_long_sum_can_be_stopped() {
    let system = strip(50, Foundation::Bars).system().clone();
    let mut calls = 0;
    let stop = &mut |step: usize, steps: usize| {
        assert!(step <= steps, "step {step} of {steps}");
        calls += 1;
        calls < 5
    };
    let error = Transition::new(system, 1e-3, Form::Stiffness, stop).unwrap_err();
    assert!(matches!(error, Error::Stopped { .. }), "{error}");
    assert_eq!(calls, 5);
}

/// Without damping the energy of any state stays what it is, also where the stiffest mode turns a
/// thousand times in a step: squaring may lose digits in proportion to those turns, not more.
#[test]
fn a_long_step_of_a_stiff_system_keeps_the_energy() {
    let bed = Bed { stiffness: 0.0, damping: 0.0, mass: 0.0 };
    let section = Section {
        length: 25.0,
        bending_stiffness: 3.5e10 * 1.3901,
        bending_damping: 0.0,
        mass: 18_358.0,
        bed,
    };
    let strip = Strip::new(&[section], 0.3125, Foundation::Winkler, Ends::Pinned).unwrap();
    let System { mass, stiffness, .. } = strip.system();
    let (mass, stiffness) = (mass.to_dense(), stiffness.to_dense());
    let n = mass.nrows();
    let energy = |state: &DMatrix<f64>| {
        let (u, v) = (state.rows(0, n), state.rows(n, n));
        (u.transpose() * &stiffness * u + v.transpose() * &mass * v)[0]
    };
    let mut state = DMatrix::zeros(2 * n, 1);
    state.view_mut((n, 0), (n, 1)).copy_from(&scatter(n, 1, 7));
    for dt in [1e-4, 1e-3, 8e-3] {
        let phi = transition(strip.system(), dt, Form::Integral).unwrap().phi().to_dense();
        let ratio = energy(&(phi * &state)) / energy(&state);
        assert!((ratio - 1.0).abs() < 1e-7, "dt {dt}: {ratio}");
    }
}
