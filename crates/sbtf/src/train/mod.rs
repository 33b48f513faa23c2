//! Training: from samples to a model.
mod blur;
mod kernels;
mod learner;
mod opacity;
mod options;
mod random;
mod shard;
mod texture;

pub use options::{AppearanceLoss, ColourLoss, OpacityLoss, Supervision, TrainOptions};

/// temporary experiment
#[allow(missing_docs, clippy::print_stdout, clippy::unwrap_used)]
pub fn experiment(
    form: &crate::model::Architecture,
    o: &TrainOptions,
    source: &dyn crate::samples::SampleSource,
) -> f64 {
    use crate::samples::OpacityBatch;
    let mut l = opacity::OpacityLearner::new(
        form,
        o.opacity_loss,
        o.supervision,
        &mut random::Random::new(o.seed, 0),
    );
    let mut b = OpacityBatch::default();
    b.resize(o.opacity_batch);
    let mut n = b.clone();
    let mut held = OpacityBatch::default();
    held.resize(o.held_out);
    source.fill_opacity(1 << 40, &mut held);
    source.fill_opacity(0, &mut b);
    let t = std::time::Instant::now();
    let mut stepping = 0.0;
    for s in 0..o.opacity_steps {
        let f = s as f64 / o.opacity_steps as f64;
        let decay = 0.5 * (1.0 + (std::f64::consts::PI * f).cos());
        let sigma = o.blur * (-f * o.blur_halvings).exp2();
        let u = learner::Update { network: o.network_rate * decay, texture: o.texture_rate * decay, sigma };
        let t1 = std::time::Instant::now();
        let loss = l.step(&b, u);
        stepping += t1.elapsed().as_secs_f64();
        source.fill_opacity(s + 1, &mut n);
        std::mem::swap(&mut b, &mut n);
        if (s + 1) % (o.opacity_steps / 6) == 0 {
            let sc = l.score(&held, sigma);
            println!(
                "  {s} loss {loss:.5} left {:.4} base {:.4}; step {:.2} ms total {:.0} s",
                sc.error / sc.base,
                sc.base / sc.count as f64,
                stepping * 1e3 / (s + 1) as f64,
                t.elapsed().as_secs_f64()
            );
        }
    }
    let sc = l.score(&held, 0.0);
    sc.error / sc.base
}
