//! What is looked at: a mesh with the curvature along its rays, the cameras around it, and the scenes that show a material on it.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use glam::Vec3;
use osculate_geom::bake::BakeOptions;
use osculate_geom::curvature::{Principal, Status, VertexCurvature, estimate};
use osculate_geom::displacement::HeightTile;
use osculate_geom::field::{FilterKind, WalkLength};
use osculate_geom::mesh::{Surface, uv_scale};
use osculate_geom::{Mesh, shapes};
use osculate_render::scene::{Laying, MicroSurface, QueryForm, SilhouetteMaterial, SurfaceSource};
use osculate_render::{Camera, Environment, Light, Material, MeshInstance, Scene};
use osculate_sbtf::SilhouetteBtf;
use osculate_sbtf::micro::HeightField;
use osculate_sbtf::sampling::Sampler;
use serde::Serialize;

use super::flicker::direction;
use crate::console::Console;
use crate::field::OwnedField;
use crate::input;

/// Twice what a scene may have: leather on the torus comes to 18 million, for which the command takes 7 GB.
const MOST_TRIANGLES: usize = 32_000_000;

/// Radii of the protocol's torus.
const MAJOR: f64 = 1.0;
const MINOR: f64 = 0.45;

/// A mesh and where it is looked at from.
pub struct Subject {
    /// Its name in reports.
    pub name: String,
    mesh: Arc<Mesh>,
    curvature: Vec<VertexCurvature>,
    /// The exact curvature, where it is known.
    exact: Option<Vec<VertexCurvature>>,
    laying: Laying,
    /// Elevations in degrees, and the cameras.
    pub cameras: Vec<(f32, Camera)>,
    target: Vec3,
    distance: f32,
}

/// A material's answers, and how it is asked.
#[derive(Clone)]
pub struct Entry {
    /// What answers.
    pub btf: Arc<dyn SilhouetteBtf + Send + Sync>,
    /// Where light is looked for.
    pub sampler: Arc<Sampler>,
    /// Depth in tiles.
    pub depth: f32,
}

/// What stands on the mesh.
#[derive(Clone)]
pub enum Form<'a> {
    /// The mesh itself.
    Base,
    /// The mesh at the lowest height that the material may have.
    Inner(&'a HeightField),
    /// Real triangles.
    Displaced(&'a Truth),
    /// A material that is asked,
    /// by the chord query if the filter finds chords, by the paper's otherwise.
    Asked { entry: Entry, filter: FilterKind, exact_curvature: bool },
    /// A material that is asked without curvature.
    Blind(Entry),
    /// The mesh itself with colours and normals of the heights.
    Flat(&'a HeightField),
}

/// The displaced mesh, made once.
pub struct Truth {
    object: MeshInstance,
    /// What making it took.
    pub seconds: f64,
}

/// What a form takes, before anything is traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// Triangles that rays are traced against.
    pub triangles: usize,
    /// Corners, indices, normals and UV of the triangles in single precision, without the hierarchy over them, and a filter's table.
    pub geometry_bytes: usize,
}

impl Subject {
    /// `torus`, or a mesh file with UV.
    pub fn new(name: &str, console: &Console) -> Result<Self> {
        if name == "torus" {
            return Self::torus(console);
        }
        let path = Path::new(name);
        let mesh = input::read_mesh(path, console)?;
        let scale =
            uv_scale(&mesh, 0).with_context(|| format!("{name}: has no UV to lay a material over"))?;
        // As large against the mesh as on the torus, whose diagonal is 4.2 tiles.
        let size = 0.24 * mesh.bbox_diagonal();
        #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
        let laying = Laying::new([(scale / size) as f32; 2], size as f32);
        let centre = mesh.bounds().map_or(osculate_geom::Vec3::zeros(), |(a, b)| 0.5 * (a + b));
        // What is longer than wide is in the picture from top to bottom.
        let distance = 1.3 * mesh.bbox_diagonal();
        let title = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Self::with(title, mesh, None, laying, (centre, distance), console)
    }

    /// The protocol's torus.
    pub fn torus(console: &Console) -> Result<Self> {
        Self::torus_of([480, 240], console)
    }

    /// The same of fewer triangles, which takes a fraction of the time to prepare.
    pub fn coarse_torus(console: &Console) -> Result<Self> {
        Self::torus_of([120, 60], console)
    }

    fn torus_of([around, across]: [usize; 2], console: &Console) -> Result<Self> {
        let mesh = shapes::torus_with_uv(MAJOR, MINOR, around, across);
        let exact = mesh.positions().iter().map(torus_curvature).collect();
        let centre = osculate_geom::Vec3::zeros();
        let laying = Laying::new([6.0, 3.0], 1.0);
        Self::with("torus".to_owned(), mesh, Some(exact), laying, (centre, 4.0), console)
    }

    fn with(
        name: String,
        mesh: Mesh,
        exact: Option<Vec<VertexCurvature>>,
        laying: Laying,
        (centre, distance): (osculate_geom::Vec3, f64),
        console: &Console,
    ) -> Result<Self> {
        let _step = console.step("estimating curvature");
        let options = BakeOptions::default();
        let surface = Surface::new(&mesh, options.weld);
        let curvature = surface.spread(estimate(&surface, &options.curvature).with_context(|| name.clone())?);
        drop(surface);
        let target = osculate_geom::rays::to_f32(&centre);
        #[allow(clippy::cast_possible_truncation, reason = "rendering is f32")]
        let distance = distance as f32;
        let cameras = [10.0_f32, 35.0, 60.0].map(|degrees| (degrees, camera(target, distance, degrees, 0.0)));
        let laying = Laying { most_triangles: MOST_TRIANGLES, ..laying };
        Ok(Self {
            name,
            mesh: Arc::new(mesh),
            curvature,
            exact,
            laying,
            cameras: cameras.into(),
            target,
            distance,
        })
    }

    /// The camera at 35 degrees, turned about +Y by an angle in radians.
    pub fn camera_turned(&self, turn: f32) -> Camera {
        camera(self.target, self.distance, 35.0, turn)
    }

    /// Whether the exact curvature is known.
    pub fn has_exact_curvature(&self) -> bool {
        self.exact.is_some()
    }

    /// Displaces the mesh.
    pub fn truth(&self, heights: &HeightField) -> Result<Truth> {
        self.truth_within(heights, self.laying.tolerance)
    }

    /// Displaces the mesh so that heights are off by at most `tolerance` depths.
    pub fn truth_within(&self, heights: &HeightField, tolerance: f32) -> Result<Truth> {
        let start = Instant::now();
        let laying = Laying { tolerance, ..self.laying };
        let (made, micro) =
            MicroSurface::displaced(&self.mesh, heights, &laying).with_context(|| self.name.clone())?;
        let surface = SurfaceSource::Material(Material { micro: Some(micro), ..Material::default() });
        let object = MeshInstance { surface, ..MeshInstance::new(Arc::new(made.mesh)) };
        Ok(Truth { object, seconds: start.elapsed().as_secs_f64() })
    }

    /// A square picture of a form on the mesh from the first camera, lit from above and all around.
    pub fn scene(&self, form: &Form<'_>, pixels: u32) -> Result<(Scene, Cost)> {
        let (object, table_bytes) = self.object(form)?;
        let (triangles, vertices) = (object.mesh.triangles().len(), object.mesh.positions().len());
        let geometry_bytes = triangles * (36 + 12 + 4) + vertices * (12 + 8) + table_bytes;
        let cost = Cost { triangles, geometry_bytes };
        let sun = Light::Directional {
            direction: Vec3::new(-1.0, -1.5, -0.5),
            irradiance: Vec3::new(2.4, 2.3, 2.1),
        };
        let scene = Scene {
            camera: self.cameras[0].1,
            width: pixels,
            height: pixels,
            objects: vec![object],
            lights: vec![sun],
            environment: Environment::Constant(Vec3::new(0.35, 0.38, 0.45)),
            exposure: 0.0,
        };
        Ok((scene, cost))
    }

    /// The object, and the bytes of its filter's table.
    fn object(&self, form: &Form<'_>) -> Result<(MeshInstance, usize)> {
        let (mesh, material, field) = match form {
            Form::Base => (Arc::clone(&self.mesh), Material::default(), None),
            Form::Inner(heights) => (self.inner(heights)?, Material::default(), None),
            Form::Displaced(truth) => return Ok((truth.object.clone(), 0)),
            Form::Blind(entry) => (Arc::clone(&self.mesh), self.asked(entry, QueryForm::Paper), None),
            Form::Flat(heights) => {
                let micro = MicroSurface::flat(&self.mesh, heights, &self.laying);
                (Arc::clone(&self.mesh), Material { micro: Some(micro), ..Material::default() }, None)
            }
            Form::Asked { entry, filter, exact_curvature } => {
                let curvature = match (&self.exact, exact_curvature) {
                    (Some(exact), true) => exact,
                    (_, false) => &self.curvature,
                    (None, true) => bail!("{}: its exact curvature is not known", self.name),
                };
                let field = self.field(entry, *filter, curvature);
                let material = self.asked(entry, QueryForm::of_filter(*filter));
                (Arc::clone(&self.mesh), material, Some(field))
            }
        };
        // All of a table, so that it is what stands in the costs; rendering makes what rays meet.
        field.iter().for_each(OwnedField::fill_table);
        let table_bytes = field.as_ref().map_or(0, OwnedField::table_bytes);
        let (surface, field) = (SurfaceSource::Material(material), field.map(OwnedField::shared));
        Ok((MeshInstance { surface, field, ..MeshInstance::new(mesh) }, table_bytes))
    }

    /// What an entry's depth lets the filter see.
    fn field(&self, entry: &Entry, filter: FilterKind, curvature: &[VertexCurvature]) -> OwnedField {
        let depth = f64::from(entry.depth) * f64::from(self.laying.tile_size);
        let walk = Some(WalkLength::Shell { depth });
        OwnedField::of_mesh(&self.mesh, BakeOptions::default().weld, curvature, filter, walk)
    }

    fn asked(&self, entry: &Entry, query: QueryForm) -> Material {
        let Entry { btf, sampler, depth } = entry.clone();
        let Laying { tiles, tile_size, .. } = self.laying;
        let silhouette = SilhouetteMaterial { btf, depth, tiles, tile_size, sampler, query };
        Material { silhouette: Some(silhouette), ..Material::default() }
    }

    fn inner(&self, heights: &HeightField) -> Result<Arc<Mesh>> {
        let tile = HeightTile::level(-f64::from(heights.depth()));
        let options = osculate_geom::displacement::DisplaceOptions {
            tiles: self.laying.tiles.map(f64::from),
            tile_size: self.laying.tile_size.into(),
            ..Default::default()
        };
        let made = osculate_geom::displacement::displace(&self.mesh, &tile, &options);
        Ok(Arc::new(made.with_context(|| self.name.clone())?.mesh))
    }
}

/// The protocol's camera at an elevation in degrees, turned about +Y by an angle in radians.
fn camera(target: Vec3, distance: f32, elevation: f32, turn: f32) -> Camera {
    let position = target + distance * direction(elevation.to_radians(), turn);
    Camera::look_at(position, target, Vec3::Y, 2.0 * 0.40_f32.atan())
}

/// Curvature of the protocol's torus at a point of it.
fn torus_curvature(p: &osculate_geom::Vec3) -> VertexCurvature {
    use osculate_geom::Vec3;
    let ring = p.x.hypot(p.z);
    let around = Vec3::new(p.z, 0.0, -p.x) / ring;
    let normal = Vec3::new(p.x * (1.0 - MAJOR / ring), p.y, p.z * (1.0 - MAJOR / ring)) / MINOR;
    // d2 = n x d1 is the way around the axis.
    let d1 = around.cross(&normal);
    let kappa_min = (1.0 - MAJOR / ring) / MINOR;
    let principal = Principal { kappa_max: 1.0 / MINOR, kappa_min, d1, d2: normal.cross(&d1) };
    VertexCurvature { principal: Some(principal), error: 0.0, status: Status::Ok }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the level set's own curvature.
    #[test]
    fn the_torus_has_its_curvature() {
        let mesh = shapes::torus_with_uv(MAJOR, MINOR, 12, 9);
        for p in mesh.positions() {
            let found = torus_curvature(p).principal.unwrap();
            let ring = p.x.hypot(p.z);
            let radial = osculate_geom::Vec3::new(p.x, 0.0, p.z) / ring;
            let normal = (radial * (ring - MAJOR) + osculate_geom::Vec3::y() * p.y) / MINOR;
            assert!((found.kappa_max - 1.0 / 0.45).abs() < 1e-12);
            assert!((found.kappa_min - normal.dot(&radial) / ring).abs() < 1e-12);
            for d in [found.d1, found.d2] {
                assert!(d.dot(&normal).abs() < 1e-12 && (d.norm() - 1.0).abs() < 1e-12);
            }
            assert!((found.d2 - normal.cross(&found.d1)).norm() < 1e-12 && found.d2.y.abs() < 1e-12);
        }
    }
}
