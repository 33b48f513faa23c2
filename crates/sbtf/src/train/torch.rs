//! Gradients against those that `PyTorch` recorded (`tools/reference/torch_gradients.py`).

use safetensors::SafeTensors;

use super::appearance::AppearanceLearner;
use super::learner::Learner;
use super::opacity::OpacityLearner;
use super::options::{AppearanceLoss, ColourLoss, OpacityLoss, Supervision};
use super::reference::small_form;
use crate::model::{Architecture, OffsetForm, OpacityHead};
use crate::random::Random;
use crate::samples::{AppearanceBatch, OpacityBatch};

struct Recorded<'a> {
    file: SafeTensors<'a>,
    case: &'a str,
}

impl Recorded<'_> {
    fn row(&self, name: &str) -> Vec<f32> {
        let tensor = self.file.tensor(&format!("{}.{name}", self.case)).unwrap();
        tensor.data().chunks_exact(4).map(|w| f32::from_le_bytes(w.try_into().unwrap())).collect()
    }

    /// Columns of an array with so many.
    fn columns<const N: usize>(&self, name: &str) -> [Vec<f32>; N] {
        let all = self.row(name);
        std::array::from_fn(|column| all.iter().skip(column).step_by(N).copied().collect())
    }

    /// Gives a learner the recorded numbers.
    fn put(&self, module: &str, learner: &mut Learner) {
        for (part, parameters) in
            [("texture", &mut learner.state.texture), ("network", &mut learner.state.network)]
        {
            let values = self.row(&format!("{module}.{part}"));
            assert_eq!(values.len(), parameters.values.len(), "{module}.{part}");
            parameters.values = values;
        }
    }

    /// A hundred-thousandth of the largest gradient: sums of 64 samples in f32 on our side, doubles on the other.
    fn compare(&self, module: &str, (texture, network): &(Vec<f32>, Vec<f32>)) {
        for (part, ours) in [("texture", texture), ("network", network)] {
            let theirs = self.row(&format!("{module}.{part}_gradient"));
            let scale = theirs.iter().fold(0.0_f32, |a, b| a.max(b.abs()));
            assert!(scale > 0.0 && ours.len() == theirs.len());
            for (i, (a, b)) in ours.iter().zip(&theirs).enumerate() {
                assert!((a - b).abs() < 1e-5 * scale, "{} {module}.{part} {i}: {a} {b}", self.case);
            }
        }
    }
}

fn form(opacity: OpacityHead) -> Architecture {
    Architecture { opacity, offset: OffsetForm::Free, ..small_form() }
}

fn recorded<'a>(bytes: &'a [u8], case: &'a str) -> Recorded<'a> {
    Recorded { file: SafeTensors::deserialize(bytes).unwrap(), case }
}

const FILE: &[u8] =
    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/torch_gradients.safetensors"));

#[test]
fn opacity_gradients_are_pytorchs() {
    for (case, head) in [("silhouette", OpacityHead::Silhouette), ("direct", OpacityHead::Direct)] {
        let recorded = recorded(FILE, case);
        let known = |name: &str, there: bool| if there { recorded.row(name) } else { vec![0.0; 64] };
        let batch = OpacityBatch {
            uv: recorded.columns("uv"),
            wo: recorded.columns("wo"),
            kappa_hat: recorded.row("kappa"),
            silhouette_cosine: known("silhouette_cosine", head == OpacityHead::Silhouette),
            alpha: known("alpha", head == OpacityHead::Direct),
        };
        let loss = OpacityLoss { l1: 0.3, l2: 1.0 };
        let mut learner =
            OpacityLearner::new(&form(head), loss, Supervision::Full, &mut Random::new(0, 0, 0));
        recorded.put("opacity", &mut learner.learner);
        let value = learner.gradients(&batch, 0.0);
        assert!((value / f64::from(recorded.row("loss")[0]) - 1.0).abs() < 1e-5);
        recorded.compare("opacity", &learner.gathered(0.0));
    }
}

#[test]
fn gradients_through_the_offset_are_pytorchs() {
    let recorded = recorded(FILE, "chain");
    let batch = AppearanceBatch {
        uv: recorded.columns("uv"),
        wo: recorded.columns("wo"),
        wi: recorded.columns("wi"),
        kappa_hat: recorded.row("kappa"),
        offset: recorded.columns("offset"),
        rgb: recorded.columns("rgb"),
    };
    let loss = AppearanceLoss { colour: ColourLoss::Unbiased, l1: 0.1, offset: 0.5 };
    let form = form(OpacityHead::Silhouette);
    let mut learner = AppearanceLearner::new(&form, loss, Supervision::Full, &mut Random::new(0, 0, 0));
    recorded.put("offset_module", &mut learner.offset);
    recorded.put("colour_module", &mut learner.colour);
    let value = learner.gradients(&batch, 0.0);
    assert!((value / f64::from(recorded.row("loss")[0]) - 1.0).abs() < 1e-5);
    let [offset, colour] = learner.gathered(0.0);
    recorded.compare("offset_module", &offset);
    recorded.compare("colour_module", &colour);
}
