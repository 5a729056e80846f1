//! What the roughness of 100 km costs.
//!
//! `cargo bench -p pavefem-core --bench roughness`. The last lines set the time of an index beside
//! its error: the road is a sine, whose index is (2 / pi) times gain times amplitude of the averaged
//! slope.

// A bench stops where its own model is wrong.
#![allow(clippy::unwrap_used, missing_docs)]

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput};
use pavefem_core::roughness::{BASE, iri};

const LENGTH: f64 = 100e3;
const SPACINGS: [f64; 2] = [0.25, 0.025];

/// A sine with a slope of 2 mm/m, and the golden car's gain for it.
const WAVELENGTH: f64 = 15.4;
const SLOPE: f64 = 2e-3;
const GAIN: f64 = 1.535_089_165;

fn road(spacing: f64) -> Vec<f64> {
    let wave = 2.0 * PI / WAVELENGTH;
    let samples = (LENGTH / spacing).round() as usize + 1;
    (0..samples).map(|i| SLOPE / wave * (wave * spacing * i as f64).sin()).collect()
}

/// Its index on segments of 100 m, m/km.
fn segments(elevations: &[f64], spacing: f64) -> Vec<f64> {
    iri(black_box(elevations), spacing, true, Some(100.0), &mut |_, _| true).unwrap()
}

fn hundred_kilometres(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("IRI of 100 km");
    for spacing in SPACINGS {
        let road = road(spacing);
        group.throughput(Throughput::Elements(road.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(format!("{spacing} m")), |bencher| {
            bencher.iter(|| segments(&road, spacing));
        });
    }
    group.finish();
}

fn time_and_error() {
    for spacing in SPACINGS {
        let road = road(spacing);
        let start = Instant::now();
        let found = segments(&road, spacing);
        let seconds = start.elapsed().as_secs_f64();
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        let half = PI * BASE / WAVELENGTH;
        let exact = 2.0 / PI * GAIN * SLOPE * half.sin() / half * 1e3;
        println!(
            "IRI of 100 km every {spacing} m: {:.1} ms; {mean:.5} m/km, {:+.3} % from the closed form",
            1e3 * seconds,
            100.0 * (mean / exact - 1.0),
        );
    }
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .configure_from_args();
    hundred_kilometres(&mut criterion);
    criterion.final_summary();
    // Not when tests only ask whether the bench runs.
    if std::env::args().any(|argument| argument == "--bench") {
        time_and_error();
    }
}
