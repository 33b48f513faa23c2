//! The meshes of the study, with their exact curvature.

use anyhow::{Context, Result};
use clap::ValueEnum;
use osculate_geom::Mesh;
use osculate_geom::curvature::Principal;
use osculate_geom::mesh::{Surface, Weld};
use osculate_geom::shapes::study::{LimitMesh, StudyShape, add_noise, loop_limit};

use super::settings::Setting;

/// What a mesh is measured for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Error, at the study's own vertex count: every setting.
    Accuracy,
    /// Growth of time, memory and error with the mesh: the settings marked so.
    Scaling,
}

impl Use {
    /// The word for it in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Accuracy => "accuracy",
            Self::Scaling => "scaling",
        }
    }
}

/// A mesh whose curvature is known.
#[derive(Debug)]
pub struct Subject {
    /// Unique; a file name.
    pub name: String,
    /// The surface.
    pub shape: String,
    /// Standard deviation of the noise in mean edges.
    pub noise: f64,
    /// Errors are multiplied with it.
    pub radius: f64,
    /// What it is measured for.
    pub purpose: Use,
    /// The mesh, noise and all.
    pub mesh: Mesh,
    /// Truth of the clean point, where there is one.
    pub exact: Vec<Option<Principal>>,
}

impl Subject {
    /// Whether a setting is to be measured on it.
    pub fn wants(&self, setting: &Setting) -> bool {
        self.purpose == Use::Accuracy || setting.scaling
    }
}

/// Which subjects there are. They are made one at a time, since the largest do not fit into memory together.
#[derive(Debug, Clone)]
pub struct Plan {
    entries: Vec<Entry>,
    seed: u64,
}

#[derive(Debug, Clone)]
struct Entry {
    source: Source,
    vertices: usize,
    noise: f64,
    purpose: Use,
}

#[derive(Debug, Clone)]
enum Source {
    Shape(StudyShape),
    /// Limit surface of a closed mesh, refined so many times.
    Limit {
        name: String,
        control: Mesh,
        levels: u32,
    },
}

/// Which part of the study is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Both.
    All,
    /// Error against time.
    Accuracy,
    /// Growth with the mesh.
    Growth,
}

/// Noise levels in mean edges.
const NOISE: [f64; 5] = [0.0, 0.001, 0.01, 0.05, 0.2];

/// Vertices of the meshes that growth is measured on. Evenly spread over the decades, since every one weighs alike in a fit.
const SIZES: [usize; 7] = [1_000, 4_000, 16_000, 64_000, 256_000, 1_000_000, 2_000_000];

impl Plan {
    /// The full study at about `vertices` vertices, with the limit surfaces of `everyday` (name and closed mesh) beside the
    /// analytic shapes; `quick` takes a little of each part, which runs in seconds.
    pub fn new(vertices: usize, part: Part, quick: bool, seed: u64, everyday: &[(String, Mesh)]) -> Self {
        let shapes: &[StudyShape] =
            if quick { &[StudyShape::Torus, StudyShape::Bump] } else { &StudyShape::ALL };
        let noises: &[f64] = if quick { &[0.0, 0.01] } else { &NOISE };
        let sizes: &[usize] = if quick { &[500, 1_000, 2_000] } else { &SIZES };
        let mut entries = Vec::new();
        let mut add = |source: &Source, vertices, noises: &[f64], purpose| {
            entries.extend(noises.iter().map(|&noise| Entry {
                source: source.clone(),
                vertices,
                noise,
                purpose,
            }));
        };
        let (accuracy, growth) = (part != Part::Growth, part != Part::Accuracy);
        for &shape in shapes.iter().filter(|_| accuracy) {
            add(&Source::Shape(shape), vertices, noises, Use::Accuracy);
        }
        for (name, control) in everyday.iter().filter(|_| accuracy) {
            for levels in if quick { 0..1 } else { 0..2 } {
                let source = Source::Limit { name: name.clone(), control: control.clone(), levels };
                add(&source, 0, noises, Use::Accuracy);
            }
        }
        for &size in sizes.iter().filter(|_| growth) {
            add(&Source::Shape(StudyShape::Torus), size, &[0.0], Use::Scaling);
        }
        Self { entries, seed }
    }

    /// Refuses meshes that have no limit surface, before any work is done.
    pub fn check(&self) -> Result<()> {
        let limits = self.entries.iter().filter(|e| matches!(e.source, Source::Limit { .. }));
        limits.filter(|e| e.noise <= 0.0).try_for_each(|entry| entry.make(self.seed).map(|_| ()))
    }

    /// The subjects in order, each made when it is asked for.
    pub fn subjects(&self) -> impl Iterator<Item = Result<Subject>> {
        self.entries.iter().map(|entry| entry.make(self.seed))
    }

    /// A number per subject that grows as its work does, for progress.
    pub fn work(&self) -> impl Iterator<Item = f64> {
        self.entries.iter().map(|entry| match (&entry.source, entry.purpose) {
            (Source::Limit { control, levels, .. }, _) => {
                control.positions().len() as f64 * 4_f64.powi(i32::try_from(*levels).unwrap_or(0))
            }
            // Few settings are measured on these, and fewer times.
            (_, Use::Scaling) => entry.vertices as f64 * 0.2,
            (_, Use::Accuracy) => entry.vertices as f64,
        })
    }
}

impl Entry {
    fn make(&self, seed: u64) -> Result<Subject> {
        let (shape, radius, clean, exact) = match &self.source {
            Source::Shape(shape) => {
                let clean = shape.mesh(self.vertices, seed);
                let exact = clean.positions().iter().map(|p| Some(shape.exact(p))).collect();
                (shape.name().to_owned(), shape.radius(), clean, exact)
            }
            Source::Limit { name, control, levels } => {
                let LimitMesh { mesh, exact } =
                    loop_limit(&Surface::new(control, Weld::Exact), *levels).with_context(|| name.clone())?;
                let shape = if *levels == 0 { name.clone() } else { format!("{name}_refined") };
                let radius =
                    typical_radius(&exact).with_context(|| format!("{name}: no vertex of valence 6"))?;
                (shape, radius, mesh, exact)
            }
        };
        let purpose = match self.purpose {
            Use::Accuracy => "",
            Use::Scaling => "_scaling",
        };
        let name = format!("{shape}_{}_{}{purpose}", clean.positions().len(), self.noise);
        let mesh = add_noise(&clean, self.noise, seed);
        Ok(Subject { name, shape, noise: self.noise, radius, purpose: self.purpose, mesh, exact })
    }
}

/// One over the median of the stronger curvature.
fn typical_radius(exact: &[Option<Principal>]) -> Option<f64> {
    let mut strongest: Vec<f64> =
        exact.iter().flatten().map(|p| p.kappa_max.abs().max(p.kappa_min.abs())).collect();
    strongest.sort_unstable_by(f64::total_cmp);
    strongest.get(strongest.len() / 2).filter(|&&k| k > 0.0).map(|k| 1.0 / k)
}
