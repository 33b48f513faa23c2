//! The meshes of a scene, with the curvature that it calls for.

use std::sync::Arc;

use anyhow::{Context, Result, bail};
use osculate_geom::bake::BakeOptions;
use osculate_geom::curvature::estimate;
use osculate_geom::field::{BakedChord, BakedMinimum, FilterKind, WalkLength};
use osculate_geom::mesh::Surface;
use osculate_geom::reference::{Axis, Shape};
use osculate_geom::{Mesh, shapes};
use osculate_render::scene::{LoadRequest, LoadedMesh, MeshSource};

use super::{Content, RenderArgs};
use crate::console::Console;
use crate::field::OwnedField;
use crate::input::{self, Input};

/// Reads or makes a mesh, of which the picture takes about so many samples.
pub(super) fn load_mesh(
    request: &LoadRequest<'_>,
    args: &RenderArgs,
    content: &Content,
    walk: Option<WalkLength>,
    samples: u64,
    console: &Console,
) -> Result<LoadedMesh> {
    let shown = match request.source {
        MeshSource::File(path) => path.display().to_string(),
        MeshSource::Shape(shape) => shape.to_string(),
    };
    let needs_filter = content.needs_filter() || request.shell.is_some();
    let needs_curvature = content.needs_curvature() || request.shell.is_some();
    let walk_on = |mesh: &Mesh| {
        let depth = request.shell.and_then(|shell| shell.depth_in_mesh(mesh));
        walk.or(depth.map(|depth| WalkLength::Shell { depth }))
    };
    let options = args.estimate.options(&BakeOptions::default())?;
    let input = match request.source {
        MeshSource::File(path) => input::read(path, console)?,
        MeshSource::Shape(shape) => Input::Raw(made(shape)?),
    };
    let (mesh, curvature) = match input {
        Input::Baked(_) if args.estimate.is_given() => {
            bail!("{shown}: is baked already, so --method and its like have no effect; leave them out")
        }
        Input::Baked(baked) => {
            let kind = filter(request, samples, baked.mesh());
            let field =
                needs_filter.then(|| OwnedField::of_baked(&baked, kind, walk_on(baked.mesh())).shared());
            let (mesh, curvature) = baked.into_parts();
            return Ok(LoadedMesh { mesh: Arc::new(mesh), curvature: Some(Arc::from(curvature)), field });
        }
        Input::Raw(mesh) if !needs_curvature => (mesh, None),
        Input::Raw(mesh) => {
            let _step = console.step("estimating curvature");
            let surface = Surface::new(&mesh, options.weld);
            let curvature = estimate(&surface, &options.curvature).with_context(|| shown.clone())?;
            let curvature = surface.spread(curvature);
            drop(surface);
            (mesh, Some(curvature))
        }
    };
    let field = match &curvature {
        Some(curvature) if needs_filter => {
            let kind = filter(request, samples, &mesh);
            Some(OwnedField::of_mesh(&mesh, options.weld, curvature, kind, walk_on(&mesh)).shared())
        }
        _ => None,
    };
    Ok(LoadedMesh { mesh: Arc::new(mesh), curvature: curvature.map(Arc::from), field })
}

/// The filter to load with: walks that nobody named give way to their table where the picture asks often enough.
fn filter(request: &LoadRequest<'_>, samples: u64, mesh: &Mesh) -> FilterKind {
    let vertices = mesh.positions().len();
    match request.filter {
        FilterKind::Chord if !request.is_named && BakedChord::pays(samples, vertices) => {
            FilterKind::BakedChord
        }
        FilterKind::March if !request.is_named && BakedMinimum::pays(samples, vertices) => FilterKind::Baked,
        walk => walk,
    }
}

/// The surface with UV that a scene asks for, fine enough that its facets do not show.
fn made(shape: Shape) -> Result<Mesh> {
    match shape {
        Shape::Torus { major, minor, axis: Axis::Fitted | Axis::Y } => {
            Ok(shapes::torus_with_uv(major, minor, 240, 120))
        }
        other => bail!("{other}: only torus:A,r can be made with UV; write a mesh file for other shapes"),
    }
}
