//! How fast training samples are made, on one thread: thousands a second of its own processor time, so that other work on
//! the machine counts little. Linux only.
//!
//! ```text
//! cargo run --release -p osculate-sbtf --example patch_rate -- [stones|waves|plain|weave] [DEPTH=0.1]
//! ```

mod support;

use osculate_sbtf::micro::Microstructure;
use osculate_sbtf::patch::{DatasetError, DatasetOptions, PatchDataset, Tracing};
use osculate_sbtf::samples::{AppearanceBatch, OpacityBatch, SampleSource};

const BATCH: usize = 65_536;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "stones".to_owned());
    let depth: f32 = arguments.next().map_or(Ok(0.1), |text| text.parse())?;
    let micro = support::material(&name, depth).ok_or("no such material")?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    pool.install(|| measure(&name, &micro))?;
    Ok(())
}

#[allow(clippy::print_stdout, reason = "an example reports on standard output")]
fn measure(name: &str, micro: &Microstructure) -> Result<(), DatasetError> {
    for tracing in [Tracing::March, Tracing::Triangles] {
        let start = processor_seconds();
        let dataset = PatchDataset::new(micro, DatasetOptions { tracing, ..DatasetOptions::default() })?;
        print!("{name}, prepared in {:.2} s: ", processor_seconds() - start);
        match dataset.tile() {
            Some(tile) => println!("{} triangles, off by {:.4} depths", tile.triangle_count(), tile.error()),
            None => println!("rays march"),
        }
        measure_rates(&dataset);
    }
    Ok(())
}

fn measure_rates(dataset: &PatchDataset) {
    let mut opacity = OpacityBatch::default();
    opacity.resize(BATCH);
    report("opacity", |index| dataset.fill_opacity(index, &mut opacity));
    let mut appearance = AppearanceBatch::default();
    appearance.resize(BATCH);
    report("appearance, patches not yet there", |_| dataset.fill_appearance(1000, &mut appearance));
    report("appearance", |index| dataset.fill_appearance(index, &mut appearance));
}

/// Median of six batches.
#[allow(clippy::print_stdout, reason = "an example reports on standard output")]
fn report(what: &str, mut fill: impl FnMut(u64)) {
    let mut seconds: Vec<f64> = (0..if what.contains("not yet") { 1 } else { 6 })
        .map(|index| {
            let start = processor_seconds();
            fill(index);
            processor_seconds() - start
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    let median = seconds[seconds.len() / 2];
    println!("{what}: {:.0} thousand samples/s ({median:.3} s a batch)", BATCH as f64 / median / 1000.0);
}

/// Processor time that the only worker thread has used.
fn processor_seconds() -> f64 {
    let read = || {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    };
    read().unwrap_or(f64::NAN) * 1e-9
}
